/* `incode bench boards`: what a tetrahedron costs an emulated board, in
 * instructions and in bytes on its wires, and where they go.
 *
 * Memory: a table of a board's functions and of its blocks, some 30 MB.  Work:
 * a minute a board.
 *
 *     struct host_bench_boards_options options = {.csv = "boards.csv"};
 *     if (host_bench_boards(&options, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_BOARDS_H
#define HOST_BENCH_BOARDS_H

#include "host/base/error.h"

struct host_bench_boards_options {
    const char *csv, *svg; /* NULL: none */
};

/* Prints a row a board.  0; HOST_CUBE where one cannot be emulated, HOST_USAGE
 * where this is not the top of the source tree, HOST_BROKEN for a wrong
 * result. */
int host_bench_boards(const struct host_bench_boards_options *options,
                      struct host_error *error);

#endif
