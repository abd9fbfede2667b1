/* What `incode bench paper` prints: the rows of its tables beside the paper's,
 * on standard output and as CSV.
 *
 * Memory: the struct.  Work: a line a row.
 *
 *     host_paper_table(&print, "2", "Table 2: spatial decomposition");
 *     host_paper_head("nodes", "%s %d", "Uniform", 20000);
 *     host_paper_line(&print, result, alone_s, machine, NULL, NULL);
 *     host_paper_note("master-slaves: not there yet");
 */
#ifndef HOST_BENCH_PAPER_PRINT_H
#define HOST_BENCH_PAPER_PRINT_H

#include <stdio.h>

#include "paper_figures.h"
#include "paper_runs.h"

struct host_paper_print {
    FILE *csv; /* NULL: none */
    const char *table;
};

/* One row of the CSV, and of a table: measured or modelled, and the paper's
 * beside it.  0 or NULL: not known. */
struct host_paper_csv {
    const char *set, *machine, *how, *strategy, *partition, *face_rule, *index;
    uint64_t points, tetrahedra;
    unsigned nodes, builders;
    double t_min, t_max, t_io, speed_up, duplication, mflops;
    double paper_t_min, paper_t_max, paper_t_io, paper_duplication;
};

int host_paper_print_begin(struct host_paper_print *print, const char *csv,
                           struct host_error *error);
int host_paper_print_end(struct host_paper_print *print, const char *csv,
                         struct host_error *error);

/* A table, "2", and a part of it, with the head of its columns. */
void host_paper_table(struct host_paper_print *print, const char *table,
                      const char *title);
void host_paper_head(const char *first, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void host_paper_note(const char *format, ...)
    __attribute__((format(printf, 1, 2)));

/* A row; alone_s: what its speed-up is against; the paper's series and row
 * beside it, or NULL. */
void host_paper_line(struct host_paper_print *print,
                     const struct host_paper_result *result, double alone_s,
                     const struct host_bench_machine *machine,
                     const struct host_paper_series *series,
                     const struct host_paper_row *row);

void host_paper_csv_row(struct host_paper_print *print,
                        const struct host_paper_csv *row);

#endif
