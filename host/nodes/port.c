#include "port.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <unistd.h>

#include "host/base/clock.h"
#include "transport/drivers/wait.h"

void host_port_socket(struct host_port *port, int fd) {
    memset(port, 0, sizeof *port);
    port->kind = fd < 0 ? HOST_PORT_NONE : HOST_PORT_SOCKET;
    tcp_pipe_init(&port->tcp, fd);
}

int host_port_serial(struct host_port *port,
                     const struct serial_port_settings *settings,
                     struct host_error *error) {
    memset(port, 0, sizeof *port);
    if (serial_port_open(&port->serial, settings) != 0) {
        return host_fail(error, HOST_CUBE, "%s", port->serial.fault);
    }
    port->kind = HOST_PORT_SERIAL;
    return 0;
}

int host_port_net(struct host_port *port, const struct tcp_wire_config *config,
                  struct host_error *error) {
    memset(port, 0, sizeof *port);
    if (tcp_wire_open(&port->net, config) != 0) {
        return host_fail(error, HOST_CUBE,
                         "the host's wire: %s; see incode cube FILE",
                         strerror(errno));
    }
    port->kind = HOST_PORT_NET;
    return 0;
}

struct link_pipe host_port_pipe(struct host_port *port) {
    return port->kind == HOST_PORT_SERIAL ? serial_link_pipe(&port->serial.pipe)
           : port->kind == HOST_PORT_NET  ? tcp_wire_pipe(&port->net)
                                          : tcp_link_pipe(&port->tcp);
}

static void unplug(struct host_port *port) {
    uint64_t now_us = host_now_us();
    if (port->unplugged_us == 0 || port->serial.pipe.fd < 0) {
        port->unplugged_us = now_us;
    }
    if (now_us - port->unplugged_us >= port->unplug_us) {
        port->unplugged_us = now_us;
        serial_close(port->serial.pipe.fd);
        port->serial.pipe.fd = -1;
        port->serial.pipe.closed = true;
        port->serial.look_us = now_us;
    }
}

/* Adds what to wait for: the number of entries. */
static unsigned add_events(const struct host_port *port, struct pollfd *fds) {
    switch (port->kind) {
    case HOST_PORT_NET:
        return tcp_wire_events(&port->net, fds);
    case HOST_PORT_SERIAL:
        fds->fd = port->serial.pipe.fd;
        fds->events = serial_events(&port->serial.pipe);
        return fds->events != 0 ? 1 : 0;
    case HOST_PORT_SOCKET:
        fds->fd = port->tcp.fd;
        fds->events = tcp_events(&port->tcp);
        return fds->events != 0 ? 1 : 0;
    default:
        return 0;
    }
}

void host_port_idle(struct host_port *ports, unsigned count, uint64_t wait_us) {
    struct pollfd fds[CUBE_HOST_PORTS_MAX * TCP_WIRE_FDS_MAX];
    nfds_t used = 0;
    for (unsigned i = 0; i < count; i++) {
        struct host_port *port = &ports[i];
        struct serial_pipe *pipe = &port->serial.pipe;
        bool serial = port->kind == HOST_PORT_SERIAL;
        if (serial && serial_wait_us(pipe) < wait_us) {
            wait_us = serial_wait_us(pipe);
        }
        used += add_events(port, fds + used);
        if (serial && port->unplug_us != 0) {
            unplug(port);
        }
    }
    wait_files(fds, used, wait_us, 0);
}

void host_port_rest(struct host_port *port, uint64_t rest_us) {
    if (port->kind == HOST_PORT_NET) {
        tcp_wire_rest(&port->net, rest_us);
    }
}

int host_port_fault(const struct host_port *port) {
    return port->kind == HOST_PORT_NET && port->net.tcp.fd < 0 ? port->net.fault
                                                               : 0;
}

struct tcp_wire_doubt host_port_doubt(const struct host_port *port) {
    return port->kind == HOST_PORT_NET ? tcp_wire_doubt(&port->net)
                                       : (struct tcp_wire_doubt){NULL, NULL};
}

void host_port_close(struct host_port *port) {
    if (port->kind == HOST_PORT_SERIAL) {
        serial_port_close(&port->serial);
    } else if (port->kind == HOST_PORT_SOCKET) {
        close(port->tcp.fd);
        port->tcp.closed = true;
    } else if (port->kind == HOST_PORT_NET) {
        tcp_wire_close(&port->net);
    }
    port->kind = HOST_PORT_NONE;
}
