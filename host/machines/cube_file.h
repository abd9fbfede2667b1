/* The cube file: which nodes there are, and how they are wired.  README.md has
 * the format, boards/linux/ an example for each kind of wire.  Links between
 * two bare boards go from UART to UART, and may be left out.
 *
 * Memory: about 600 bytes a wire.  Work: one pass over the file, and a look-up
 * for each host name.
 *
 *     if (host_cube_file_read(&file, "lab.cube", &error) != 0)
 *         return error.code;
 *     unsigned count = host_cube_node_options(&file, 3, options);
 *     host_cube_file_free(&file);
 */
#ifndef HOST_CUBE_FILE_H
#define HOST_CUBE_FILE_H

#include "host/base/error.h"
#include "host/machines/boards.h"
#include "host/service/machine.h"
#include "transport/drivers/serial_port.h"
#include "transport/drivers/tcp_wire.h"

enum { HOST_NODE_OPTIONS_MAX = 64, HOST_NODE_OPTION_BYTES = 256 };

/* From a node to another, or to the host: CUBE_HOST. */
struct host_cube_wire {
    uint16_t node, to;
    unsigned line; /* of the file */
    bool serial;   /* else a socket: `node` listens, `to` calls */
    bool insecure; /* over TCP without a key */
    struct tcp_address at, via;
    char device[2][SERIAL_NAME_MAX]; /* at either end */
    uint32_t baud;
    bool rts_cts;
};

struct host_cube_file {
    const char *path;
    unsigned nodes, dimension;
    const struct host_board *board; /* of all nodes, or "mixed" */
    const struct host_board *board_of[HOST_NODES_MAX];
    uint64_t memory;
    unsigned window;
    unsigned dead_s; /* a link silent so long is given up; 0: never */
    char key_path[HOST_NODE_OPTION_BYTES];
    bool has_key;
    uint8_t key[SECURE_KEY_BYTES];
    uint32_t serial_baud; /* of the slowest serial wire or UART; 0: none */
    struct host_cube_wire *wire;
    unsigned wires;
    bool local[HOST_NODES_MAX]; /* the host starts this node itself */
};

/* 0, or HOST_INPUT with file and line, or HOST_CUBE for a name that is not
 * found. */
int host_cube_file_read(struct host_cube_file *file, const char *path,
                        struct host_error *error);
/* The same of a text; `path` names it. */
int host_cube_file_parse(struct host_cube_file *file, const char *path,
                         const char *text, struct host_error *error);
void host_cube_file_free(struct host_cube_file *file);

/* Whether the node has no system. */
static inline bool host_cube_is_bare(const struct host_cube_file *file,
                                     unsigned node)
{
    return node < HOST_NODES_MAX && node < file->nodes &&
           file->board_of[node]->bare != NULL;
}

/* What its wires are, as statistics name it. */
const struct host_link *host_cube_link(const struct host_cube_file *file);

/* "FILE:LINE: the wire between node 0 and the host" */
void host_cube_name_wire(const struct host_cube_file *file,
                         const struct host_cube_wire *wire, char text[160]);

/* The k-th wire of the host, 0 or 1; NULL: none. */
const struct host_cube_wire *
host_cube_host_wire(const struct host_cube_file *file, unsigned k);

/* The arguments of a node's program, without its name: how many. */
unsigned host_cube_node_options(
    const struct host_cube_file *file, unsigned node,
    char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES]);

/* The line for a shell that starts a node; NULL: it does not fit, or the node
 * has no system that would. */
const char *host_cube_start_line(const struct host_cube_file *file,
                                 unsigned node, char *line, size_t size);

/* How the host reaches the node of a wire of its own: an address, or a device.
 */
const char *host_cube_wire_name(const struct host_cube_wire *wire, char *name,
                                size_t size);

/* `incode cube FILE`: prints how each node is started. */
int host_cube_print(const char *path, struct host_error *error);

#endif
