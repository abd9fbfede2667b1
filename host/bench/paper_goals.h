/* What follows from the tables: relation (1) of the paper's section 4.3, its
 * estimate of the hybrid, and the project's goals, each said to be reached or
 * missed with its figure.
 *
 * Memory: none of its own.  Work: that of runs that no table has made.
 *
 *     if (host_paper_relation(bench, &error) != 0 ||
 *         host_paper_goals(bench, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_PAPER_GOALS_H
#define HOST_BENCH_PAPER_GOALS_H

#include "paper_tables.h"

/* A hybrid of clusters of four pays where S_spatial(4N) / S_spatial(N) <
 * S_master-slaves(4), for N of 16 and more; and whether the estimate of Table 5
 * comes true.  0, or what a run ends with. */
int host_paper_relation(struct host_paper_bench *bench,
                        struct host_error *error);

/* 0, or what a run ends with, be the goals reached or not. */
int host_paper_goals(struct host_paper_bench *bench, struct host_error *error);

#endif
