/* `incode bench links`: what a link does over each driver, between two
 * processes. */
#ifndef HOST_BENCH_LINKS_H
#define HOST_BENCH_LINKS_H

#include "host/base/error.h"
#include "bench.h"
#include "host/run/run.h"
#include "model.h"

/* Measures all drivers and prints a line for each.  0, or HOST_CUBE where one
 * of them does not work here. */
int host_bench_links(struct host_error *error);

/* What a link does over a simulated serial line, both ends in this process and
 * in virtual time. */

enum { HOST_BENCH_SIM_BYTES = 300000 }; /* a second, of the line */

/* A run in virtual time: the host's service and the nodes as they are, in one
 * process on the simulator's world (host/sim/sim_world.h), without faults.
 * Each node's work is charged as the machine's model has it (model.h), each
 * message by the wires; the host's own work is not charged.  The same on every
 * machine that does the same arithmetic, however many processors it has. */

struct host_virtual_run {
    const struct host_bench_machine *machine;
    /* Strategy, nodes (1 .. HOST_NODES_MAX), memory and how to triangulate. */
    const struct host_run_options *options;
    double slow; /* node 0 takes so many times as long; 0: as the others */
    /* What came of it, in virtual seconds: the nodes' reports and their sums;
     * time_triangulation_s from the setup to the last tetrahedron at the host;
     * time_io_s as in host_bench_io_s, of all pages that the host has sent. */
    struct host_run_result result;
    double work_ns; /* of all nodes together, by the prices, not scaled */
};

/* 0, or what a run ends with. */
int host_virtual_run(struct host_virtual_run *run,
                     const struct host_points *points,
                     struct host_error *error);

#endif
