/* The tables of `incode bench paper` that are run in virtual time.
 *
 * Memory: struct host_paper_bench.  Work: that of the runs.
 *
 *     struct host_paper_bench *bench = calloc(1, sizeof *bench);
 *     if (host_paper_runs_begin(&bench->runs, &error) == 0 &&
 *         host_paper_table_2(bench, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_PAPER_TABLES_H
#define HOST_BENCH_PAPER_TABLES_H

#include "bench_paper.h"
#include "paper_print.h"

struct host_paper_bench {
    const struct host_paper_options *options;
    struct host_paper_runs runs;
    struct host_paper_print print;
};

/* Whether there is that strategy, and it is asked for; says where it is not
 * there yet. */
bool host_paper_has(const struct host_paper_bench *bench, const char *strategy);

/* 0, or what a run ends with. */
int host_paper_table_2(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_table_3(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_table_4(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_table_5(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_table_6(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_table_7(struct host_paper_bench *bench,
                       struct host_error *error);

#endif
