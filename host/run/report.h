/* What a run and a bench print for people.
 *
 * Memory: none.  Work: a line a node or a row.
 *
 *     host_report_run(stdout, &options, &result, &alone);
 *     host_bench_paper(&options, 8, &error);
 */
#ifndef HOST_REPORT_H
#define HOST_REPORT_H

#include <stdio.h>

#include "run.h"

/* A summary; with `alone` (the same on one node), the columns of the paper's
 * Table 2 and a line a node. */
void host_report_run(FILE *file, const struct host_run_options *options,
                     const struct host_run_result *result,
                     const struct host_run_result *alone);

/* How the tables of node 0 fill its memory. */
void host_report_map(FILE *file, const struct host_run_result *result);

/* Tables 2 and 4 of the paper on this machine, for 1 to nodes_max nodes. */
int host_bench_paper(const struct host_run_options *options, unsigned nodes_max,
                     struct host_error *error);

#endif
