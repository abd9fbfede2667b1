/* `incode bench boards`: what a tetrahedron costs an emulated board, in
 * instructions and in bytes on its wires, and where they go.
 *
 * Memory: a table of a board's functions and of its blocks, some 30 MB. */
#ifndef HOST_BENCH_BOARDS_H
#define HOST_BENCH_BOARDS_H

#include <stdint.h>

#include "host/base/error.h"

struct host_bench_boards_options {
    const char *csv, *svg; /* NULL: none */
};

/* Prints a row a board.  0; HOST_CUBE where one cannot be emulated, HOST_USAGE
 * where this is not the top of the source tree, HOST_BROKEN for a wrong
 * result. */
int host_bench_boards(const struct host_bench_boards_options *options,
                      struct host_error *error);

/* Where a board's instructions go: what tests/bench/instructions.c has counted,
 * each block in the room of the function that it begins, as the linker's map
 * tells.  What the compiler has put into a function from another room is that
 * function's.  A loader, which runs below the image, is not counted.
 *
 * Memory: 24 bytes a function, freed before it returns. */

enum host_room {
    HOST_ROOM_PREDICATES,
    HOST_ROOM_DOUBLES, /* arithmetic that the compiler's library does */
    HOST_ROOM_SEARCH,
    HOST_ROOM_COMPLEX,
    HOST_ROOM_POINTS,
    HOST_ROOM_COPYING,
    HOST_ROOM_LINKS,
    HOST_ROOM_NODE,
    HOST_ROOM_BOARD,
    HOST_ROOMS
};

/* One or two words each. */
extern const char *const host_room_names[HOST_ROOMS];

/* Adds the instructions of all files of counts in the folder.  0, or
 * HOST_BROKEN: a file cannot be read, or the map has no function. */
int host_boards_count(const char *map, const char *folder,
                      double counted[HOST_ROOMS], struct host_error *error);

/* The rows of `incode bench boards` as an SVG: a bar a board, as long as a
 * tetrahedron takes it instructions, and parted as they go. */

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

#endif
