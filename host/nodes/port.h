/* The host's end of a wire, whatever its kind: a connected socket, a serial
 * port that may vanish and come back, or a call over TCP that is made again
 * when it breaks.
 *
 * Memory: struct host_port.  Work: as the drivers'.
 *
 *     host_port_socket(&port, fd);
 *     machine.pipe = host_port_pipe(&port);
 *     host_port_idle(&port, 1, wait_us);
 *     host_port_close(&port);
 */
#ifndef HOST_PORT_H
#define HOST_PORT_H

#include "host/base/error.h"
#include "transport/cube.h"
#include "transport/drivers/serial_port.h"
#include "transport/drivers/tcp_wire.h"

enum host_port_kind {
    HOST_PORT_NONE,
    HOST_PORT_SOCKET,
    HOST_PORT_SERIAL,
    HOST_PORT_NET
};

enum { HOST_PORTS_MAX = 2 /* of the host to a cube of a cube file */ };

struct host_port {
    enum host_port_kind kind;
    struct tcp_pipe tcp; /* its socket is the port's */
    struct serial_port serial;
    struct tcp_wire net;
    /* For tests: the port is closed after it was open so long, and opened when
     * it is next looked for. */
    uint64_t unplug_us, unplugged_us;
};

/* Takes a connected socket; -1: none. */
void host_port_socket(struct host_port *port, int fd);

/* Opens a serial port: 0, or HOST_CUBE. */
int host_port_serial(struct host_port *port,
                     const struct serial_port_settings *settings,
                     struct host_error *error);

/* Calls a node: 0, or HOST_CUBE.  The node may come later. */
int host_port_net(struct host_port *port, const struct tcp_wire_config *config,
                  struct host_error *error);

struct link_pipe host_port_pipe(struct host_port *port);

/* Sleeps until one of the ports has bytes, or room for them where there was
 * none, but no longer than wait_us.  At most CUBE_HOST_PORTS_MAX ports. */
void host_port_idle(struct host_port *ports, unsigned count, uint64_t wait_us);

/* Where the other end is in use: leaves it alone for a time, if it can be
 * called again then. */
void host_port_rest(struct host_port *port, uint64_t rest_us);

/* Why nobody is reached by it now, as errno has it; 0: that is not known. */
int host_port_fault(const struct host_port *port);

/* Why what was last reached by it is not the node, as tcp_wire_doubt. */
struct tcp_wire_doubt host_port_doubt(const struct host_port *port);

void host_port_close(struct host_port *port);

#endif
