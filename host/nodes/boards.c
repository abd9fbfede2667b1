#include "boards.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "cube_file.h"

/* A row a board: host_board_NAME of some file of this room.  Behind them those
 * of bare boards, of which the build makes a list. */
#define BOARDS(ROW) ROW(linux)

#define DECLARE(name) extern const struct host_board host_board_##name;
#define POINT(name) &host_board_##name,
BOARDS(DECLARE)
static const struct host_board *const boards[] = {BOARDS(POINT)};

extern const struct host_board *const host_bare_boards[];
extern const unsigned host_bare_boards_count;

const struct host_board host_board_mixed = {.name = "mixed",
                                            .help = "several boards"};

const struct host_board *host_board_row(unsigned i) {
    const unsigned count = sizeof boards / sizeof boards[0];
    if (i < count)
        return boards[i];
    return i - count < host_bare_boards_count ? host_bare_boards[i - count]
                                              : NULL;
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

const struct host_board *host_bare_named(const char *name) {
    const struct host_board *board = host_board_named(name);
    return board == NULL || board->bare == NULL ? NULL : board;
}

void host_bare_names(char text[HOST_BARE_NAMES]) {
    size_t used = 0;
    text[0] = '\0';
    for (unsigned i = 0; i < host_bare_boards_count && used < HOST_BARE_NAMES;
         i++) {
        used += (size_t)snprintf(text + used, HOST_BARE_NAMES - used, "%s%s",
                                 i == 0 ? "" : ", ", host_bare_boards[i]->name);
    }
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
