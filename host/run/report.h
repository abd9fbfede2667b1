/* What a run prints for people, and the paper's table of which benches are made
 * too. */
#ifndef HOST_REPORT_H
#define HOST_REPORT_H

#include "run.h"

/* A summary, on standard error if standard output takes data; with `alone` (the
 * same on one node), the columns of the paper's Table 2 and a line a node.
 * HOST_INPUT: standard output does not take it. */
int host_report(const struct host_run_options *options,
                const struct host_run_result *result,
                const struct host_run_result *alone, struct host_error *error);

/* The statistics of a run as one JSON object.
 *
 * Memory: about 1 KiB a node while it is written.  Work: O(nodes). */

/* "-" is standard output.  The file has its name when host_output_commit gives
 * it.  0, or HOST_INPUT where the file cannot be made. */
int host_stats_write(const char *path, const struct host_run_result *result,
                     struct host_error *error);

/* Mean, and the upper end of the 99th percentile's class, of the candidates
 * that a call of MakeTetra looked at. */
double host_candidates_mean(const struct host_run_result *result);
double host_candidates_p99(const struct host_run_result *result);

#endif
