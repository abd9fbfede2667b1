/* `incode bench scaling`: what a point costs, from 1,000 to 10,000,000 uniform
 * points on one node of 4M, and from 1 to 64 nodes.
 *
 * The first are real runs on this machine: processor time of node and host, the
 * least of a few runs, as other programs only add to it.  Processes on this
 * machine share its processors, so the second are run in virtual time
 * (virtual_run.h), at the prices of host_bench_here (model.h): what the busiest
 * node works, and all of them together; the host's own work is not charged.
 *
 * Memory: that of the largest run.  Work: some minutes; `quick` takes at most
 * 30,000 points and 8 nodes, and some seconds.
 *
 *     struct host_scaling_options options = {.quick = true, .nodes_max = 8};
 *     if (host_bench_scaling(&options, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_SCALING_H
#define HOST_BENCH_SCALING_H

#include <stdbool.h>

#include "host/base/error.h"

struct host_scaling_options {
    bool quick;
    unsigned nodes_max;    /* a power of two */
    const char *csv, *svg; /* files for all rows and the figure, or NULL */
};

/* 0, or what a run ends with; HOST_INPUT where the figure needs gnuplot, or a
 * file cannot be made. */
int host_bench_scaling(const struct host_scaling_options *options,
                       struct host_error *error);

#endif
