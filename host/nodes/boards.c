#include "boards.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "cube_file.h"

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
    for (unsigned i = 0; (board = host_board_row(i)) != NULL; i++)
        if (strcmp(name, board->name) == 0)
            break;
    return board;
}

/* Nodes as processes of this machine, of the program of boards/linux. */

static int start(const struct host_board *board,
                 const struct host_cluster_options *options,
                 struct host_started *started, struct host_error *error) {
    static struct host_cluster cluster;
    static char program[4096];
    struct host_cluster_options mine = *options;
    mine.program = program;
    if (host_cluster_program(options->program, board->program, program,
                             sizeof program, error) != 0 ||
        host_cluster_start(&cluster, &mine, error) != 0)
        return error->code;
    started->machine = host_cluster_machine(&cluster);
    started->limited = cluster.limited;
    started->memory_held = cluster.limited
                               ? ", held by the kernel"
                               : " (a sanitizer build: not held by the kernel)";
    (void)tcp_buffers(cluster.port[0].tcp.fd, &started->send_bytes,
                      &started->receive_bytes);
    return 0;
}

const struct host_board host_board_linux = {
    .name = "linux",
    .help = "processes of this machine",
    .program = "incode-node",
    .start = start,
};
