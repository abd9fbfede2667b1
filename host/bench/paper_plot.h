/* The paper's figure 11 as an SVG through gnuplot: tetrahedra a second, and a
 * second and Mflop/s, against the number of processing elements.
 *
 * Memory: none.  Work: a second.
 *
 *     if (host_paper_figure_11(bench, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_PAPER_PLOT_H
#define HOST_BENCH_PAPER_PLOT_H

#include "paper_tables.h"

/* Draws it where options->svg says, and prints what it shows.  0, what a run
 * ends with, or HOST_BROKEN where gnuplot does not draw. */
int host_paper_figure_11(struct host_paper_bench *bench,
                         struct host_error *error);

#endif
