/* What `incode bench paper` measures on this machine: Table 1, the sequential
 * program naive and optimised; and the model's prices, held against real runs
 * on one node and two.
 *
 * Memory: a run of 20,000 points.  Work: half a minute, most of it naive.
 *
 *     if (host_paper_table_1(bench, &error) != 0 ||
 *         host_paper_check(bench, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_PAPER_SEQUENTIAL_H
#define HOST_BENCH_PAPER_SEQUENTIAL_H

#include "paper_tables.h"

/* 0, or what a run ends with. */
int host_paper_table_1(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_check(struct host_paper_bench *bench, struct host_error *error);

#endif
