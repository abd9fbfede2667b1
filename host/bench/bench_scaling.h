/* `incode bench scaling`: what a point costs, from 1,000 to 10,000,000 uniform
 * points on one node of 4M, and from 1 to 64 nodes.
 *
 * The first are real runs on this machine: processor time of node and host, the
 * least of a few runs, as other programs only add to it.  Processes on this
 * machine share its processors, so the second are run in virtual time
 * (virtual_run.h), at the prices of host_bench_here (model.h): what the busiest
 * node works, and all of them together; the host's own work is not charged.
 *
 * Work: some minutes; `quick` takes at most 30,000 points and 8 nodes, and
 * some seconds. */
#ifndef HOST_BENCH_SCALING_H
#define HOST_BENCH_SCALING_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

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

/* The rows of `incode bench scaling`: printed, as CSV, and drawn. */

enum { HOST_SCALING_ROWS = 24, HOST_SCALING_STRATEGIES = 2 };

/* Seconds of one run; the clock's from the points in memory to the last
 * tetrahedron. */
struct host_scaling_point {
    uint64_t points, tetrahedra;
    unsigned runs;
    double node_s, host_s, wall_s;
};

/* Of a strategy in virtual time: the busiest node, and all. */
struct host_scaling_node {
    const char *strategy;
    unsigned nodes;
    uint64_t points, tetrahedra;
    double busiest_s, all_s, wire_bytes;
};

struct host_scaling_rows {
    FILE *csv; /* NULL: none */
    struct host_scaling_point point[HOST_SCALING_ROWS];
    unsigned points;
    struct host_scaling_node node[HOST_SCALING_STRATEGIES * HOST_SCALING_ROWS];
    unsigned nodes;
};

extern const char *const host_scaling_strategies[HOST_SCALING_STRATEGIES];

/* A program that is run to be measured: the time that it says it took, or that
 * it was ended at its limit. */

struct host_trial {
    bool late;  /* it was ended at the limit; nothing else is known then */
    int status; /* that it ended with; 128 and the number of a signal */
    uint64_t tetrahedra, pages_asked, pages;
    double cpu_s; /* processor time: of all nodes, or of a peer */
    /* Of the host: what time_triangulation_s covers, and all, files apart. */
    double host_s, host_all_s;
    double wall_s;
    double whole_s; /* by the clock, from its start to its end */
    double run_s;   /* as it says, without its check */
    uint64_t peak_bytes, scratch_bytes;
    char digest[80]; /* empty: it says none */
    char said[400];  /* the last line on standard error */
};

/* Runs `words`, found as a shell finds them, with nothing as standard input.
 * What is on its standard output, statistics of a run or a peer's, fills the
 * trial; else all of that stays 0.  Its end, whatever it is, is no error. */
int host_trial_run(char *const words[], double limit_s,
                   struct host_trial *trial, struct host_error *error);

#endif
