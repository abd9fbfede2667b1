/* The rows of `incode bench boards` as an SVG: a bar a board, as long as a
 * tetrahedron takes it instructions, and parted as they go.
 *
 * Memory: none.  Work: a line a part.
 *
 *     struct host_boards_row rows[HOST_BOARDS_ROWS];
 *     if (host_boards_plot("boards.svg", rows, 3, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_BOARDS_PLOT_H
#define HOST_BENCH_BOARDS_PLOT_H

#include <stdint.h>

#include "bench_boards_count.h"

enum { HOST_BOARDS_ROWS = 16 };

struct host_boards_row {
    const char *board;
    unsigned nodes;
    uint64_t points, tetrahedra;
    double instructions; /* a tetrahedron */
    double counted[HOST_ROOMS];
    double bytes_in, bytes_out; /* a tetrahedron */
};

/* Percent of all that were counted. */
double host_boards_share(const struct host_boards_row *row, unsigned room);

/* 0, or HOST_BROKEN. */
int host_boards_plot(const char *path, const struct host_boards_row *rows,
                     unsigned count, struct host_error *error);

#endif
