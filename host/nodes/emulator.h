/* A bare board that QEMU emulates: a process, whose UARTs are wires, files or
 * paths, and whose flash chip is a file that outlives it.  It stays on one of
 * the processors that are allowed here, so that it and its neighbours do not
 * wait for each other's way between them.
 *
 * Memory: 16 KB, in the child. */
#ifndef HOST_EMULATOR_H
#define HOST_EMULATOR_H

#include <limits.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "host/base/error.h"
#include "cluster.h"

enum {
    HOST_UARTS_MAX = 5,
    HOST_BOARD_MEMORY = 4 << 20, /* data memory of every bare board */
    HOST_FLASH_BYTES = 16 << 20, /* of a chip, as the emulator wants it */
    /* A second, of the host's wire, as `auto` counts: it carries 50 KB/s, to
     * nodes that compute a hundred times slower than those of this machine. */
    HOST_BARE_WIRE_BYTES = 5000000
};

/* What stands for a board's flash: a memory of the machine, in a file; or a
 * card.  A board without flash has no loader, and runs its image at once. */
enum host_flash { HOST_FLASH_NONE, HOST_FLASH_CHIP, HOST_FLASH_CARD };

/* A bare board, and what emulates it.  UART 0 is its console, and the host's
 * wire; the others are the links of dimensions 0, 1 .. */
struct host_bare {
    const char *machine; /* QEMU's name of it */
    const char *program; /* QEMU for its processor, */
    const char *package; /* of the distribution */
    const char *option;  /* QEMU's, for the file that runs first */
    const char *image;   /* its firmware, a file's name, */
    const char *loader;  /* and its loader's, which starts it */
    unsigned uarts;
    enum host_flash flash;
    uint32_t serial_baud;    /* that its firmware takes its wires for */
    int (*pair)(int fds[2]); /* of which a wire between two is made */
};

/* A file or socket of the emulator: one that it inherits, or at a path; fd -1
 * and no path: none. */
struct host_place {
    int fd;
    const char *path;
};

struct host_emulator {
    const struct host_bare *bare;
    char program[PATH_MAX], image[PATH_MAX];
    char first[PATH_MAX]; /* what it runs at first: the loader, or the image */
    struct host_place flash; /* the chip's or card's file: HOST_FLASH_BYTES */
    /* What is at the other end of a UART: a connected socket, or a path at
     * which it listens; and the file that keeps what it sends. */
    struct {
        struct host_place wire, log;
    } uart[HOST_UARTS_MAX];
    struct host_place qmp; /* in the same way: of the monitor */
    int folder; /* that the paths of wires and monitor lead through; -1: none */
    int errors; /* what it says of itself goes there; -1: to standard error */
};

/* The most nodes in a cube of such boards. */
static inline unsigned host_bare_nodes_max(const struct host_bare *bare) {
    return 1u << (bare->uarts - 1);
}

/* Finds program and image, and makes all else nobody's: 0, or HOST_CUBE. */
int host_emulator_find(const struct host_bare *bare,
                       struct host_emulator *emulator,
                       struct host_error *error);

/* The image that `make firmware` has made for a board, by the shortest name
 * that it has from here; false: there is none. */
bool host_firmware_find(const char *board, char path[PATH_MAX]);

/* In the child: becomes the emulator.  turn: of the processors, by which one
 * is taken.  Returns where that fails, with errno. */
void host_emulator_become(const struct host_emulator *emulator, unsigned turn);

/* QEMU's monitor, by which an emulated board is stopped, resumed and reset,
 * over a socket that it has inherited.  It is spoken to in lines of JSON;
 * events and answers to others are passed over.
 *
 * Work: a request waits for its answer, which takes milliseconds on a quiet
 * machine, and never waits longer than wait_us. */

enum { HOST_QMP_US = 10000000, HOST_QMP_LINE = 4096 };

enum host_qmp_request { HOST_QMP_STOP, HOST_QMP_CONT, HOST_QMP_RESET };

struct host_qmp {
    int fd;           /* connected, non-blocking; stays the caller's */
    uint64_t wait_us; /* for an answer; at first HOST_QMP_US */
    bool ready;       /* it has heard the greeting, and been told so */
    size_t used;
    bool skipping; /* to the end of a line that is too long */
    char line[HOST_QMP_LINE];
};

void host_qmp_init(struct host_qmp *qmp, int fd);

/* 0, or HOST_CUBE: no answer in time, or the monitor refuses. */
int host_qmp_ask(struct host_qmp *qmp, enum host_qmp_request request,
                 struct host_error *error);

/* What was said so far was said by a process that is gone. */
void host_qmp_forget(struct host_qmp *qmp);

#endif
