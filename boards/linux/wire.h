/* The wires of a node on Linux: connected sockets, or terminals.
 *
 * Memory: struct linux_wire.  Work: as the drivers'.
 *
 *     linux_wire_inherit(&wire[0], fd);
 *     board.pipes[0] = linux_wire_pipe(&wire[0]);
 *     linux_wires_idle(wire, count, wait_us);
 */
#ifndef BOARDS_LINUX_WIRE_H
#define BOARDS_LINUX_WIRE_H

#include "../../transport/cube.h"
#include "../../transport/drivers/serial.h"
#include "../../transport/drivers/tcp.h"

struct linux_wire {
    bool serial; /* else TCP */
    struct tcp_pipe tcp;
    struct serial_pipe line;
};

/* An open file that the one who started the node gave it. */
void linux_wire_inherit(struct linux_wire *wire, int fd);

struct link_pipe linux_wire_pipe(struct linux_wire *wire);

/* Sleeps until bytes have come, or room for them where there was none, but no
 * longer than wait_us.  At most CUBE_LINKS_MAX wires. */
void linux_wires_idle(struct linux_wire *wires, unsigned count,
                      uint64_t wait_us);

#endif
