/* The figures of the paper's Tables 1 to 7, as they stand there: P. Cignoni,
 * D. Laforenza, R. Perego, R. Scopigno, C. Montani, "Evaluation of
 * parallelization strategies for an incremental Delaunay triangulator in E3",
 * Concurrency: Practice and Experience 7(1), 1995.  Speed-ups and efficiencies
 * follow from the times, to the digits that the paper prints.
 *
 * Memory: the figures.  Work: none.
 *
 *     const struct host_paper_series *s = host_paper_find("2", "Uniform",
 *                                                         20000, "");
 *     double speed_up = s->row[0].t_max / s->row[7].t_max;
 */
#ifndef HOST_BENCH_PAPER_FIGURES_H
#define HOST_BENCH_PAPER_FIGURES_H

#include <stdint.h>

enum { HOST_PAPER_ROWS = 9 };

/* 0: the paper does not say. */
struct host_paper_row {
    unsigned nodes; /* processing elements, or builders in 6 and 7; 0: the
                       sequential program there */
    double t_min, t_max, t_io, duplication; /* seconds */
};

struct host_paper_series {
    const char *table, *set, *what; /* what: apart from others of the table */
    uint64_t points, tetrahedra;
    double alone_s; /* the time that speed-ups are against */
    struct host_paper_row row[HOST_PAPER_ROWS]; /* up to one without t_max */
};

/* NULL: the paper has none. */
const struct host_paper_series *host_paper_find(const char *table,
                                                const char *set,
                                                uint64_t points,
                                                const char *what);

/* The row of so many nodes; NULL: there is none. */
const struct host_paper_row *
host_paper_row_of(const struct host_paper_series *series, unsigned nodes);

/* Table 1: seconds; 0: not measured there. */
struct host_paper_sequential {
    uint64_t points;
    double naive_s, optimised_s, per_s, per_mflops;
};
enum { HOST_PAPER_SEQUENTIAL = 6 };
extern const struct host_paper_sequential
    host_paper_sequential[HOST_PAPER_SEQUENTIAL];

#endif
