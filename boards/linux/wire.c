#include "wire.h"

#include <poll.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

void linux_wire_inherit(struct linux_wire *wire, int fd)
{
    memset(wire, 0, sizeof *wire);
    wire->serial = isatty(fd) == 1;
    if (wire->serial) {
        serial_pipe_init(&wire->line, fd, 0);
    } else {
        tcp_pipe_init(&wire->tcp, fd);
    }
}

struct link_pipe linux_wire_pipe(struct linux_wire *wire)
{
    return wire->serial ? serial_link_pipe(&wire->line)
                        : tcp_link_pipe(&wire->tcp);
}

void linux_wires_idle(struct linux_wire *wires, unsigned count,
                      uint64_t wait_us)
{
    struct pollfd fds[CUBE_LINKS_MAX];
    nfds_t used = 0;
    for (unsigned i = 0; i < count; i++) {
        const struct linux_wire *wire = &wires[i];
        short events =
            wire->serial ? serial_events(&wire->line) : tcp_events(&wire->tcp);
        if (wire->serial && serial_wait_us(&wire->line) < wait_us) {
            wait_us = serial_wait_us(&wire->line);
        }
        if (events != 0) {
            fds[used].fd = wire->serial ? wire->line.fd : wire->tcp.fd;
            fds[used++].events = events;
        }
    }
    struct timespec wait = {(time_t)(wait_us / 1000000),
                            (long)(wait_us % 1000000) * 1000};
    (void)ppoll(fds, used, &wait, NULL);
}
