/* What a node's work costs in virtual time: a sum over what the node has
 * counted, each count with a price, on a machine that takes so many times
 * (`scale`) as long as that where the prices were measured; and message_us for
 * each message that it has written or read, which is not scaled.
 *
 * host_bench_prices are nanoseconds of a Zen 5 core (x86-64, 512-bit vectors,
 * gcc 12), fitted to real runs of `sequential` with one node (calibrate.h); a
 * tetrahedron's price is divided between call and list as a profile of the node
 * divides its instructions: 520 of 2,960 close twins and toggle.  Wires are
 * transport/drivers/sim.h: a message takes, on each of its way, its bytes over
 * the rate and the latency, and is stored and forwarded.
 *
 * nCUBE 2 (the paper, and its vendor): 0.7 Mflop/s a node on Linpack,
 * channels of 2.75 MB/s, the host's too.  Assumed: 5 us of latency a hop, 150
 * us of processor time a message at each end, and links that take, route and
 * hand over messages beside the processor.  Its scale makes the work of
 * `sequential` on Uniform 20,000 the paper's 1670.25 s, whatever the set is.
 *
 * Workstations (IBM R6000/340): 15 Mflop/s, one shared Ethernet of 10 Mbit/s,
 * on which whoever comes first is served first.  Assumed: 1 ms of latency, 500
 * us of processor time a message at each end.  Its scale makes the same work
 * the paper's 223.27 s. */
#ifndef HOST_BENCH_MODEL_H
#define HOST_BENCH_MODEL_H

#include <stdbool.h>
#include <stdint.h>

#include "node/message.h"
#include "transport/drivers/sim.h"

/* The figures of the paper's Tables 1 to 7, as they stand there: P. Cignoni,
 * D. Laforenza, R. Perego, R. Scopigno, C. Montani, "Evaluation of
 * parallelization strategies for an incremental Delaunay triangulator in E3",
 * Concurrency: Practice and Experience 7(1), 1995.  Speed-ups and efficiencies
 * follow from the times, to the digits that the paper prints. */

enum { HOST_PAPER_ROWS = 9 };

/* 0: the paper does not say. */
struct host_paper_row {
    unsigned nodes; /* processing elements, or builders in 6 and 7; 0: the
                       sequential program there */
    double t_min, t_max, t_io, duplication; /* seconds */
};

struct host_paper_series {
    const char *table, *set, *what; /* what: apart from others of the table */
    uint64_t points, tetrahedra;
    double alone_s; /* the time that speed-ups are against */
    struct host_paper_row row[HOST_PAPER_ROWS]; /* up to one without t_max */
};

/* NULL: the paper has none. */
const struct host_paper_series *host_paper_find(const char *table,
                                                const char *set,
                                                uint64_t points,
                                                const char *what);

/* The row of so many nodes; NULL: there is none. */
const struct host_paper_row *
host_paper_row_of(const struct host_paper_series *series, unsigned nodes);

/* Table 1: seconds; 0: not measured there. */
struct host_paper_sequential {
    uint64_t points;
    double naive_s, optimised_s, per_s, per_mflops;
};
enum { HOST_PAPER_SEQUENTIAL = 6 };
extern const struct host_paper_sequential
    host_paper_sequential[HOST_PAPER_SEQUENTIAL];

/* What is counted: fields of struct incode_statistics. */
enum host_bench_count {
    HOST_BENCH_CALLS,      /* make_tetra_calls */
    HOST_BENCH_BUILT,      /* tetrahedra_built: their faces toggled */
    HOST_BENCH_CANDIDATES, /* points whose distance was evaluated */
    HOST_BENCH_EXACT,      /* in_sphere that the filter left open; no fit finds
                              a price for orient3d, mostly exact zeros */
    HOST_BENCH_COUNTS
};

extern const char *const host_bench_count_names[HOST_BENCH_COUNTS];

/* Nanoseconds each, and the part of a call and its tetrahedron that is the
 * list's. */
extern const double host_bench_prices[HOST_BENCH_COUNTS];
extern const double host_bench_list_share;

/* A machine to be modelled. */
struct host_bench_machine {
    const char *name;
    const double *price; /* [HOST_BENCH_COUNTS] */
    double scale;        /* 0: to be set, from work_s */
    double work_s;       /* of `sequential` on Uniform 20,000, as the paper's */
    double message_us;   /* processor time a message and end */
    double mflops;       /* of a node on Linpack; 0: not known */
    struct sim_quality wire, host_wire;
    uint32_t gather_us; /* bytes closer together come at once */
    bool routers;       /* links pass messages on beside the processor */
    bool shared;        /* all wires are one medium */
};

extern const struct host_bench_machine host_bench_ncube,
    host_bench_workstations, host_bench_here;

void host_bench_counts(const struct node_finished_message *totals,
                       double counts[HOST_BENCH_COUNTS]);

double host_bench_work_ns(const double price[HOST_BENCH_COUNTS],
                          const double counts[HOST_BENCH_COUNTS]);

/* All that a node has done, on a machine: nanoseconds. */
double host_bench_node_ns(const struct host_bench_machine *machine,
                          const struct node_finished_message *totals,
                          uint64_t messages);

/* Seconds until so many bytes have crossed the host's wire, and the last of
 * them as many more wires as the cube has dimensions. */
double host_bench_io_s(const struct host_bench_machine *machine, uint64_t bytes,
                       unsigned dimension);

#endif
