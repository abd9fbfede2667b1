/* Lines that reset boards, or have them wait in their loader: of a GPIO chip,
 * or DTR and RTS of the host's serial port, as the cube file names them.  Each
 * is inactive but for the time of a reset, and made so again whatever ends
 * that: an error, Ctrl-C, Ctrl-\, Ctrl-Z, SIGTERM and SIGHUP, which are held
 * back for it (guard.h).  Who kills the program with SIGKILL in the midst of a
 * reset leaves the board to the chip's driver; opening the lines again releases
 * it. */
#ifndef HOST_LINES_H
#define HOST_LINES_H

#include <signal.h>
#include <stdbool.h>

#include "host/nodes/remote.h"

enum { HOST_RESET_MS = 100, HOST_BOOT_MS = 300 };

struct host_lines {
    const struct host_cube_file *file;
    struct serial_port *port[HOST_PORTS_MAX]; /* of the host's wires */
    struct serial_port own[HOST_PORTS_MAX];   /* those that are opened here */
    struct host_gpio **gpio;                  /* of each pin of the file */
};

/* Opens those that the file names; none is no error.  remote: has the host's
 * ports open, for as long as the lines are; NULL: nobody has.  HOST_INPUT or
 * HOST_CUBE: a chip or line that is not there, or in use, and by whom. */
int host_lines_open(struct host_lines *lines, const struct host_cube_file *file,
                    struct host_remote *remote, struct host_error *error);

/* Whether the file names such a line; nothing need be open. */
static inline bool host_lines_has(const struct host_cube_file *file,
                                  unsigned node, enum host_line_kind kind) {
    return host_cube_pin(file, node, kind) != NULL;
}

/* Resets the node's board for HOST_RESET_MS; stay: with its boot line, if it
 * has one, active until HOST_BOOT_MS after that.  HOST_CUBE: it has no reset
 * line, or a signal cut it short. */
int host_lines_reset(struct host_lines *lines, unsigned node, bool stay,
                     struct host_error *error);

void host_lines_close(struct host_lines *lines);

/* A stretch of time in which a signal that would end, or stop, the program
 * waits until something is put right: Ctrl-C, Ctrl-\, Ctrl-Z, SIGTERM, SIGHUP.
 * What the program does about signals beside is as it was again afterwards, and
 * happens then.  SIGKILL waits for nobody. */

enum { HOST_GUARD_SIGNALS = 5 };

struct host_guard {
    struct sigaction before[HOST_GUARD_SIGNALS];
    bool taken[HOST_GUARD_SIGNALS]; /* not one that is ignored */
    int ends[2];                    /* of the pipe that a signal writes to */
};

#endif
