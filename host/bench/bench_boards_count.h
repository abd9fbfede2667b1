/* Where a board's instructions go: what tests/bench/instructions.c has counted,
 * each block in the room of the function that it begins, as the linker's map
 * tells.  What the compiler has put into a function from another room is that
 * function's.  A loader, which runs below the image, is not counted.
 *
 * Memory: 24 bytes a function, freed before it returns.  Work: a pass over the
 * map, a search a block.
 *
 *     double counted[HOST_ROOMS] = {0};
 *     if (host_boards_count("mps2-an500.map", "folder", counted, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_BOARDS_COUNT_H
#define HOST_BENCH_BOARDS_COUNT_H

#include "host/base/error.h"

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

#endif
