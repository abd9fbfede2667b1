#include "boards.h"

#include <stddef.h>
#include <string.h>

/* A row a board: host_board_NAME of some file of this room. */
#define BOARDS(ROW) ROW(linux) ROW(mps2_an500) ROW(mps2_an385) ROW(raspi3b)

#define DECLARE(name) extern const struct host_board host_board_##name;
#define POINT(name) &host_board_##name,
BOARDS(DECLARE)
static const struct host_board *const boards[] = {BOARDS(POINT)};

const struct host_board host_board_mixed = {.name = "mixed",
                                            .help = "several boards"};

const struct host_board *host_board_row(unsigned i) {
    return i < sizeof boards / sizeof boards[0] ? boards[i] : NULL;
}

const char *host_board_name(unsigned i) {
    const struct host_board *board = host_board_row(i);
    return board == NULL ? NULL : board->name;
}

const struct host_board *host_board_named(const char *name) {
    const struct host_board *board;
    for (unsigned i = 0; (board = host_board_row(i)) != NULL; i++) {
        if (strcmp(name, board->name) == 0) {
            break;
        }
    }
    return board;
}
