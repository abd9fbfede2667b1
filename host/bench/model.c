#include "model.h"

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
    for (int k = 0; k < HOST_BENCH_COUNTS; k++) {
        ns += price[k] * counts[k];
    }
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
