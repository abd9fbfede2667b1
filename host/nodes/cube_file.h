/* The cube file: which nodes there are, and how they are wired.  README.md has
 * the format, boards/linux/ an example for each kind of wire.  Links between
 * two bare boards go from UART to UART, and may be left out.
 *
 * Memory: about 600 bytes a wire, 160 a reset or boot line. */
#ifndef HOST_CUBE_FILE_H
#define HOST_CUBE_FILE_H

#include <stddef.h>
#include <sys/types.h>

#include "host/base/error.h"
#include "boards.h"
#include "host/service/machine.h"
#include "transport/drivers/serial_port.h"
#include "transport/drivers/tcp_wire.h"

enum {
    HOST_NODE_OPTIONS_MAX = 64,
    HOST_NODE_OPTION_BYTES = 256,
    HOST_PIN_NAME_MAX = 64, /* the kernel's have 31 */
    HOST_SSH_MAX = 128
};

struct config_t; /* of libconfig */

/* From a node to another, or to the host: CUBE_HOST. */
struct host_cube_wire {
    uint16_t node, to;
    unsigned line; /* of the file; 0: no file names it */
    bool serial;   /* else a socket: `node` listens, `to` calls */
    bool insecure; /* over TCP without a key */
    struct tcp_address at, via;
    char device[2][SERIAL_NAME_MAX]; /* at either end */
    uint32_t baud;
    bool rts_cts;
    bool dtr_low, rts_low; /* of the host's port while it is open */
};

enum host_line_kind {
    HOST_LINE_RESET, /* active: the board is held in reset */
    HOST_LINE_BOOT,  /* active at the end of a reset: its loader waits */
    HOST_LINES
};

/* A line to a node's board: one of a GPIO chip, or DTR or RTS of the host's own
 * serial port, active where it is raised. */
struct host_cube_pin {
    uint16_t node;
    enum host_line_kind kind;
    unsigned line; /* of the file */
    int wire;      /* whose port's: the host's 0 or 1; -1: a chip's */
    bool rts;      /* of a port: not DTR */
    char chip[HOST_PIN_NAME_MAX]; /* label, or device */
    char name[HOST_PIN_NAME_MAX]; /* ""; it is known by its offset */
    unsigned offset;
    bool active_low, open_drain;
};

/* A board with Linux that the host logs in to. */
struct host_cube_ssh {
    char to[HOST_SSH_MAX];     /* as ssh takes it; "": there is none */
    char folder[HOST_SSH_MAX]; /* on the board; "": the usual one */
    unsigned line;             /* of the file */
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
    struct host_cube_pin *pin;
    unsigned pins;
    struct host_cube_ssh *ssh;  /* of each node; NULL: of none */
    bool local[HOST_NODES_MAX]; /* the host starts this node itself */
    unsigned dimension_line, memory_line, start_line, links_line;
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
                                     unsigned node) {
    return node < HOST_NODES_MAX && node < file->nodes &&
           file->board_of[node]->bare != NULL;
}

/* NULL: the node has none. */
const struct host_cube_ssh *host_cube_ssh(const struct host_cube_file *file,
                                          unsigned node);

/* What its wires are, as statistics name it. */
const struct host_link *host_cube_link(const struct host_cube_file *file);

/* The node's line of that kind; NULL: it has none. */
const struct host_cube_pin *host_cube_pin(const struct host_cube_file *file,
                                          unsigned node,
                                          enum host_line_kind kind);
const char *host_line_name(enum host_line_kind kind); /* "reset" */

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

/* As it is written, in numbers; a path as it is. */
void host_cube_print_address(const struct tcp_address *address, char *text,
                             size_t size);

/* The wire between two nodes, either way round, and how many there are. */
const struct host_cube_wire *
host_cube_between(const struct host_cube_file *file, unsigned a, unsigned b,
                  unsigned *count);

/* All settings of what libconfig has read: 0, HOST_INPUT, or HOST_CUBE for a
 * name that is not found.  Whether they go together is not looked at. */
int host_cube_read_settings(struct host_cube_file *file,
                            const struct config_t *config,
                            struct host_error *error);

/* `incode key FILE`: makes a cube's key, 64 hexadecimal digits of the kernel's
 * random numbers, in a file for its owner alone. */

/* Mode 0600 whatever the umask, and on the disk when it returns.  0; HOST_INPUT
 * where there is such a file already, which stays as it is, or where it cannot
 * be written: then nothing is left. */
int host_key_make(const char *path, struct host_error *error);

/* The same with a text of the caller's, and any mode. */
int host_key_write(const char *path, const char *text, size_t size, mode_t mode,
                   struct host_error *error);

#endif
