/* What a run prints for people, and the paper's table of which benches are made
 * too.
 *
 * Memory: none.  Work: a line a node or a row.
 *
 *     host_report_run(stdout, &options, &result, NULL);
 *     host_report_map(stdout, &result);
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

/* Of a node's memory: what its board tells, or what processes have. */
uint64_t host_node_stack_bytes(const struct host_node_report *report);

/* How the tables of node 0 fill its memory. */
void host_report_map(FILE *file, const struct host_run_result *result);

/* The columns of the paper's Table 2: their head, under a title; a row, with
 * the speed-up against `alone`; and what the columns are. */
void host_report_head(FILE *file, const char *title);
void host_report_row(FILE *file, const struct host_run_result *result,
                     const struct host_run_result *alone);
void host_report_notes(FILE *file);

#endif
