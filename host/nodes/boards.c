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

/* What the nodes of a cube file run on. */

static const struct host_board *take_board(const struct host_cube_file *file,
                                           const config_setting_t *where,
                                           struct host_error *error) {
    const char *name = config_setting_get_string(where);
    const struct host_board *board =
        name == NULL ? NULL : host_board_named(name);
    char text[160] = "board: not one that there is; give ";
    for (unsigned i = 0; board == NULL && host_board_name(i) != NULL; i++) {
        size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, "%s\"%s\"",
                 i == 0 ? "" : " or ", host_board_name(i));
    }
    if (board == NULL)
        host_cube_wrong(file, where, error, text);
    return board;
}

/* An entry of `nodes`. */
static int read_node(struct host_cube_file *file, const config_setting_t *group,
                     bool named[HOST_NODES_MAX], struct host_error *error) {
    static const char *const names[] = {"node", "board",  "reset", "boot",
                                        "ssh",  "folder", NULL};
    int node = -1;
    if (!config_setting_is_group(group)) {
        return host_cube_wrong(file, group, error,
                               "nodes: not a list of groups in braces; write "
                               "nodes = ( { node = 0; .. }, .. );");
    }
    const config_setting_t *board = config_setting_get_member(group, "board");
    if (host_cube_check_names(file, group, names, error) != 0)
        return error->code;
    if (!host_cube_take_number(group, "node", 0, (int)file->nodes - 1, &node) ||
        node < 0 || config_setting_length(group) < 2) {
        return host_cube_wrong(file, group, error,
                               "nodes: an entry without a node of this cube, "
                               "or with nothing of it; write { node = 1; board "
                               "= \"mps2-an500\"; }");
    }
    if (named[node]) {
        return host_cube_wrong(file, group, error,
                               "nodes: a node twice; name each once");
    }
    named[node] = true;
    if (board != NULL)
        file->board_of[node] = take_board(file, board, error);
    return error->code != 0 ? error->code
           : host_cube_read_ssh(file, group, (unsigned)node, error) != 0
               ? error->code
               : host_cube_read_pins(file, group, (unsigned)node, error);
}

int host_cube_read_boards(struct host_cube_file *file,
                          const config_setting_t *root,
                          struct host_error *error) {
    static bool named[HOST_NODES_MAX];
    const config_setting_t *all = config_setting_get_member(root, "board");
    const config_setting_t *list = config_setting_get_member(root, "nodes");
    memset(named, 0, sizeof named);
    file->board =
        all == NULL ? host_board_row(0) : take_board(file, all, error);
    for (unsigned i = 0; i < file->nodes; i++)
        file->board_of[i] = file->board;
    if (list != NULL && !config_setting_is_list(list)) {
        return host_cube_wrong(file, list, error,
                               "nodes: no list; write nodes = ( { node = 1; "
                               "board = \"mps2-an500\"; }, .. );");
    }
    int entries = list == NULL ? 0 : config_setting_length(list);
    (void)host_cube_make_pins(file, (unsigned)entries, error);
    for (int i = 0; error->code == 0 && i < entries; i++) {
        (void)read_node(file, config_setting_get_elem(list, (unsigned)i), named,
                        error);
    }
    for (unsigned i = 0; error->code == 0 && i < file->nodes; i++) {
        bool same = file->board_of[i] == file->board_of[0];
        file->board = i == 0 ? file->board_of[0]
                      : same ? file->board
                             : &host_board_mixed;
    }
    return error->code;
}

/* --- bare ones ------------------------------------------------------------ */

static int check_node(const struct host_cube_file *file,
                      const config_setting_t *root, unsigned node,
                      struct host_error *error) {
    const struct host_board *board = file->board_of[node];
    char text[160];
    if (1u << file->dimension > host_bare_nodes_max(board->bare)) {
        snprintf(text, sizeof text,
                 "dimension: node %u (%s) has UARTs for dimension %u; give "
                 "no more",
                 node, board->name, board->bare->uarts - 1);
        return host_cube_wrong(
            file, config_setting_get_member(root, "dimension"), error, text);
    }
    if (file->local[node]) {
        snprintf(text, sizeof text,
                 "start: node %u (%s) is no program of this machine; take it "
                 "out, and start it with: incode emulate",
                 node, board->name);
        return host_cube_wrong(file, config_setting_get_member(root, "start"),
                               error, text);
    }
    if (file->memory != HOST_BOARD_MEMORY) {
        snprintf(text, sizeof text, "memory: node %u (%s) has 4M; leave it out",
                 node, board->name);
        return host_cube_wrong(file, config_setting_get_member(root, "memory"),
                               error, text);
    }
    return 0;
}

static int check_wire(const struct host_cube_file *file,
                      const struct host_cube_wire *wire, unsigned node,
                      struct host_error *error) {
    const struct host_board *board = file->board_of[node];
    const char *what = NULL;
    char text[80];
    if (!wire->serial && tcp_address_path(&wire->at) == NULL) {
        what = "has no TCP; give unix or serial";
    } else if (wire->serial && wire->baud != board->bare->serial_baud) {
        snprintf(text, sizeof text, "has UARTs of baud = %u; give that",
                 board->bare->serial_baud);
        what = text;
    } else if (!wire->serial && wire->node != node) {
        what = "cannot call; give it as `node`, and the other as `to`";
    }
    return what == NULL
               ? 0
               : host_fail(error, HOST_INPUT, "%s:%u: node %u (%s) %s",
                           file->path, wire->line, node, board->name, what);
}

int host_cube_check_boards(struct host_cube_file *file,
                           const config_setting_t *root,
                           struct host_error *error) {
    for (unsigned i = 0; i < file->nodes && error->code == 0; i++) {
        if (host_cube_is_bare(file, i) &&
            check_node(file, root, i, error) == 0) {
            uint32_t baud = file->board_of[i]->bare->serial_baud;
            bool slower = file->serial_baud == 0 || baud < file->serial_baud;
            file->serial_baud = slower ? baud : file->serial_baud;
        }
    }
    for (unsigned i = 0; i < file->wires && error->code == 0; i++) {
        const struct host_cube_wire *wire = &file->wire[i];
        const unsigned ends[] = {wire->node, wire->to};
        for (int k = 0; k < 2; k++)
            if (host_cube_is_bare(file, ends[k]))
                (void)check_wire(file, wire, ends[k], error);
    }
    return error->code;
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
