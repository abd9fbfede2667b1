#include "model.h"

#include <stddef.h>
#include <string.h>

const struct host_paper_sequential host_paper_sequential[] = {
    {2000, 428, 14, 926, 61.7},  {4000, 1838, 32, 820, 54.6},
    {6000, 4507, 51, 776, 51.7}, {8000, 9023, 75, 706, 47.0},
    {10000, 0, 96, 692, 46.1},   {20000, 0, 223, 598, 39.8}};

static const struct host_paper_series all[] = {
    {"2",
     "Uniform",
     "",
     10000,
     66445,
     684.88,
     {{1, 684.88, 684.88, 0.50, 1.00},
      {2, 374.97, 391.19, 0.71, 1.05},
      {4, 190.07, 226.23, 1.39, 1.11},
      {8, 105.30, 134.28, 2.01, 1.17},
      {16, 58.36, 85.08, 2.69, 1.30},
      {32, 33.60, 53.50, 3.42, 1.44},
      {64, 19.19, 35.56, 4.11, 1.58},
      {128, 12.59, 27.49, 4.92, 1.87}}},
    {"2",
     "Uniform",
     "",
     20000,
     133450,
     1670.25,
     {{1, 1670.25, 1670.25, 0.88, 1.00},
      {2, 913.13, 929.69, 1.38, 1.04},
      {4, 509.21, 534.12, 2.57, 1.09},
      {8, 252.48, 312.52, 3.48, 1.14},
      {16, 140.83, 187.68, 4.25, 1.23},
      {32, 77.03, 121.60, 5.17, 1.34},
      {64, 39.37, 87.55, 6.07, 1.44},
      {128, 26.26, 80.64, 7.04, 1.66}}},
    {"3",
     "Uniform",
     "",
     10000,
     66445,
     96.35,
     {{1, 0, 96.35, 0, 1.00},
      {2, 0, 55.01, 0, 1.05},
      {4, 0, 32.40, 0, 1.11},
      {8, 0, 20.27, 0, 1.17}}},
    {"3",
     "Uniform",
     "",
     20000,
     133450,
     223.27,
     {{1, 0, 223.27, 0, 1.00},
      {2, 0, 123.82, 0, 1.04},
      {4, 0, 72.26, 0, 1.09},
      {8, 0, 43.54, 0, 1.14}}},
    {"4",
     "Uniform",
     "adaptive",
     10000,
     66445,
     790.5,
     {{1, 0, 790.5, 0, 0},
      {2, 0, 455.3, 0, 0},
      {4, 0, 256.6, 0, 0},
      {8, 0, 151.0, 0, 0},
      {16, 0, 97.1, 0, 0},
      {32, 0, 65.2, 0, 0},
      {64, 0, 44.2, 0, 0},
      {128, 0, 35.8, 0, 0}}},
    {"4",
     "Uniform",
     "uniform",
     10000,
     66445,
     790.5,
     {{1, 0, 790.5, 0, 0},
      {2, 0, 452.1, 0, 0},
      {4, 0, 261.7, 0, 0},
      {8, 0, 155.5, 0, 0},
      {16, 0, 98.7, 0, 0},
      {32, 0, 47.1, 0, 0},
      {64, 0, 41.3, 0, 0},
      {128, 0, 31.9, 0, 0}}},
    {"4",
     "Bubbles",
     "adaptive",
     20000,
     0,
     1972.3,
     {{1, 0, 1972.3, 0, 0},
      {2, 0, 1069.3, 0, 0},
      {4, 0, 597.6, 0, 0},
      {8, 0, 342.1, 0, 0},
      {16, 0, 245.1, 0, 0},
      {32, 0, 144.2, 0, 0},
      {64, 0, 104.8, 0, 0},
      {128, 0, 94.5, 0, 0}}},
    {"4",
     "Bubbles",
     "uniform",
     20000,
     0,
     1972.3,
     {{1, 0, 1972.3, 0, 0},
      {2, 0, 1537.1, 0, 0},
      {4, 0, 868.9, 0, 0},
      {8, 0, 498.0, 0, 0},
      {16, 0, 330.5, 0, 0},
      {32, 0, 240.2, 0, 0},
      {64, 0, 173.8, 0, 0},
      {128, 0, 124.0, 0, 0}}},
    {"4",
     "Blunt Fin",
     "adaptive",
     10240,
     0,
     4138.9,
     {{1, 0, 4138.9, 0, 0},
      {2, 0, 2856.2, 0, 0},
      {4, 0, 1581.2, 0, 0},
      {8, 0, 961.8, 0, 0},
      {16, 0, 1145.6, 0, 0},
      {32, 0, 756.8, 0, 0},
      {64, 0, 498.2, 0, 0},
      {128, 0, 371.7, 0, 0}}},
    {"4",
     "Blunt Fin",
     "uniform",
     10240,
     0,
     4138.9,
     {{1, 0, 4138.9, 0, 0},
      {2, 0, 3935.5, 0, 0},
      {4, 0, 3883.3, 0, 0},
      {8, 0, 3179.0, 0, 0},
      {16, 0, 3158.8, 0, 0},
      {32, 0, 3118.0, 0, 0},
      {64, 0, 2480.0, 0, 0},
      {128, 0, 2114.4, 0, 0}}},
    {"5",
     "Uniform",
     "",
     20000,
     133450,
     1670.25, /* the authors' estimates */
     {{1, 0, 1670.25, 0, 0},
      {8, 0, 330.99, 0, 0},
      {16, 0, 190.16, 0, 0},
      {32, 0, 111.26, 0, 0},
      {64, 0, 66.82, 0, 0},
      {128, 0, 43.29, 0, 0},
      {256, 0, 31.17, 0, 0}}},
    {"6",
     "Uniform",
     "",
     4000,
     26241,
     230.56,
     {{0, 0, 230.56, 0, 1.00},
      {1, 0, 189.48, 0, 1.07},
      {3, 0, 88.82, 0, 1.18},
      {7, 0, 80.39, 0, 1.18}}},
    {"6",
     "Uniform",
     "",
     6000,
     39579,
     357.19,
     {{0, 0, 357.19, 0, 1.00},
      {1, 0, 310.71, 0, 1.07},
      {3, 0, 137.94, 0, 1.25},
      {7, 0, 118.62, 0, 1.18}}},
    {"6",
     "Uniform",
     "",
     8000,
     52940,
     534.64,
     {{0, 0, 534.64, 0, 1.00},
      {1, 0, 460.75, 0, 1.07},
      {3, 0, 199.68, 0, 1.16}}},
    {"6",
     "Uniform",
     "",
     10000,
     66445,
     684.88,
     {{0, 0, 684.88, 0, 1.00},
      {1, 0, 613.25, 0, 1.07},
      {3, 0, 250.94, 0, 1.16},
      {7, 0, 232.00, 0, 1.25}}},
    {"6",
     "Uniform",
     "",
     20000,
     133450,
     1670.25,
     {{0, 0, 1670.25, 0, 1.00},
      {1, 0, 1565.57, 0, 1.07},
      {3, 0, 599.28, 0, 1.15},
      {7, 0, 492.23, 0, 1.26}}},
    {"7",
     "Uniform",
     "",
     10000,
     66445,
     96.35,
     {{0, 0, 96.35, 0, 1.00},
      {1, 0, 145.39, 0, 1.38},
      {2, 0, 81.17, 0, 1.44},
      {3, 0, 59.60, 0, 1.51},
      {4, 0, 51.79, 0, 1.53},
      {5, 0, 47.83, 0, 1.52}}},
    {"7",
     "Uniform",
     "",
     20000,
     133450,
     223.49,
     {{0, 0, 223.49, 0, 1.00},
      {1, 0, 355.49, 0, 1.32},
      {2, 0, 192.71, 0, 1.43},
      {3, 0, 137.57, 0, 1.48},
      {4, 0, 112.24, 0, 1.51},
      {5, 0, 102.56, 0, 1.50}}},
};

const struct host_paper_series *host_paper_find(const char *table,
                                                const char *set,
                                                uint64_t points,
                                                const char *what) {
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        const struct host_paper_series *s = &all[i];
        if (strcmp(s->table, table) == 0 && strcmp(s->set, set) == 0 &&
            s->points == points && strcmp(s->what, what) == 0)
            return s;
    }
    return NULL;
}

const struct host_paper_row *
host_paper_row_of(const struct host_paper_series *series, unsigned nodes) {
    for (int i = 0; series != NULL && i < HOST_PAPER_ROWS; i++)
        if (series->row[i].t_max > 0 && series->row[i].nodes == nodes)
            return &series->row[i];
    return NULL;
}

/* --- model ---------------------------------------------------------------- */

const char *const host_bench_count_names[HOST_BENCH_COUNTS] = {
    "calls", "built", "candidates", "exact in_sphere"};

const double host_bench_prices[HOST_BENCH_COUNTS] = {
    [HOST_BENCH_CALLS] = 26,
    [HOST_BENCH_BUILT] = 64,
    [HOST_BENCH_CANDIDATES] = 2.3,
    [HOST_BENCH_EXACT] = 220,
};

const double host_bench_list_share = 0.71;

/* Room for a window of frames in each driver. */
#define WIRE(rate, latency)                                                    \
    {                                                                          \
        .bytes_per_s = (rate), .latency_us = (latency), .room = 16384,         \
        .bytes = 32768                                                         \
    }

const struct host_bench_machine host_bench_ncube = {.name = "nCUBE 2",
                                                    .price = host_bench_prices,
                                                    .work_s = 1670.25,
                                                    .message_us = 150,
                                                    .mflops = 0.7,
                                                    .wire = WIRE(2750000, 5),
                                                    .host_wire =
                                                        WIRE(2750000, 5),
                                                    .gather_us = 600,
                                                    .routers = true};

const struct host_bench_machine host_bench_workstations = {
    .name = "workstations",
    .price = host_bench_prices,
    .work_s = 223.27,
    .message_us = 500,
    .mflops = 15,
    .wire = WIRE(1250000, 1000),
    .host_wire = WIRE(1250000, 1000),
    .gather_us = 1400,
    .shared = true};

const struct host_bench_machine host_bench_here = {.name = "this machine",
                                                   .price = host_bench_prices,
                                                   .scale = 1,
                                                   .message_us = 10,
                                                   .wire = WIRE(1000000000, 20),
                                                   .host_wire =
                                                       WIRE(1000000000, 20),
                                                   .gather_us = 2};

void host_bench_counts(const struct node_finished_message *totals,
                       double counts[HOST_BENCH_COUNTS]) {
    const struct incode_statistics *s = &totals->statistics;
    counts[HOST_BENCH_CALLS] = (double)s->make_tetra_calls;
    counts[HOST_BENCH_BUILT] = (double)s->tetrahedra_built;
    counts[HOST_BENCH_CANDIDATES] = (double)s->candidates;
    counts[HOST_BENCH_EXACT] = (double)s->tally.exact_in_sphere;
}

double host_bench_work_ns(const double price[HOST_BENCH_COUNTS],
                          const double counts[HOST_BENCH_COUNTS]) {
    double ns = 0;
    for (int k = 0; k < HOST_BENCH_COUNTS; k++)
        ns += price[k] * counts[k];
    return ns;
}

double host_bench_node_ns(const struct host_bench_machine *machine,
                          const struct node_finished_message *totals,
                          uint64_t messages) {
    double counts[HOST_BENCH_COUNTS];
    host_bench_counts(totals, counts);
    return machine->scale * host_bench_work_ns(machine->price, counts) +
           1e3 * machine->message_us * (double)messages;
}

double host_bench_io_s(const struct host_bench_machine *machine, uint64_t bytes,
                       unsigned dimension) {
    const struct sim_quality *h = &machine->host_wire, *w = &machine->wire;
    double hop_s =
        1e-6 * w->latency_us + (double)INCODE_PAGE_BYTES / w->bytes_per_s;
    return (double)bytes / h->bytes_per_s + 1e-6 * h->latency_us +
           dimension * hop_s;
}
