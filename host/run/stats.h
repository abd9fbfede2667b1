/* The statistics of a run as one JSON object.
 *
 * Memory: about 1 KiB a node while it is written.  Work: O(nodes).
 *
 *     if (host_stats_write("run.json", &result, &error) == 0)
 *         return host_output_commit(&error);
 */
#ifndef HOST_STATS_H
#define HOST_STATS_H

#include "run.h"

/* "-" is standard output.  The file has its name when host_output_commit gives
 * it.  0, or HOST_INPUT where the file cannot be made. */
int host_stats_write(const char *path, const struct host_run_result *result,
                     struct host_error *error);

/* Mean, and the upper end of the 99th percentile's class, of the candidates
 * that a call of MakeTetra looked at. */
double host_candidates_mean(const struct host_run_result *result);
double host_candidates_p99(const struct host_run_result *result);

#endif
