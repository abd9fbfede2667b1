#include "wire.h"

#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "../../transport/drivers/secure_sodium.h"

enum { LOOK_US = 500000 };

void linux_wire_inherit(struct linux_wire *wire, int fd)
{
    memset(wire, 0, sizeof *wire);
    wire->kind = isatty(fd) == 1 ? LINUX_TERMINAL : LINUX_SOCKET;
    if (wire->kind == LINUX_TERMINAL) {
        serial_pipe_init(&wire->line, fd, 0);
    } else {
        tcp_pipe_init(&wire->tcp, fd);
    }
}

/* --- wires that the node opens itself ------------------------------------- */

static const char *open_net(struct linux_wire *wire, const char *address,
                            bool listens, const uint8_t *key, const char **told)
{
    struct tcp_wire_config config = {.listens = listens, .key = key};
    if (tcp_address_parse(&config.address, address) != 0) {
        return "--wire: not an address in numbers with a port, as in "
               "10.0.0.7:7001 or [2001:db8::7]:7001";
    }
    config.suite = key == NULL ? NULL : &secure_sodium;
    if (key == NULL && !tcp_address_is_loopback(&config.address)) {
        if (!listens) {
            return "--wire: calls another machine without a key; give --key";
        }
        *told = "no --key: listens for this machine's own programs only";
        tcp_address_to_loopback(&config.address);
    }
    wire->kind = LINUX_NET;
    if (tcp_wire_open(wire->net, &config) != 0) {
        return "--wire: cannot listen there; is the port taken, or the "
               "address another machine's?";
    }
    return NULL;
}

/* A port that is not there, or vanished, is looked for from time to time. */
static void recover(void *context)
{
    struct linux_wire *wire = context;
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    uint64_t now_us =
        (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
    serial_close(wire->line.fd);
    wire->line.fd = -1;
    if (now_us - wire->look_us < LOOK_US) {
        return;
    }
    wire->look_us = now_us;
    int fd = serial_open(wire->device, wire->baud, wire->rts_cts);
    if (fd >= 0) {
        serial_pipe_init(&wire->line, fd, wire->baud);
        wire->line.recover = recover;
        wire->line.context = wire;
    }
}

static const char *open_line(struct linux_wire *wire, const char *text)
{
    const char *baud = strchr(text, ':');
    const char *flow = baud == NULL ? NULL : strchr(baud + 1, ':');
    if (baud == NULL || (size_t)(baud - text) >= sizeof wire->device ||
        (flow != NULL && strcmp(flow, ":rtscts") != 0)) {
        return "--wire: not as in serial:/dev/ttyS0:115200 or "
               "serial:/dev/ttyS0:115200:rtscts";
    }
    memcpy(wire->device, text, (size_t)(baud - text));
    wire->kind = LINUX_TERMINAL;
    wire->baud = (uint32_t)strtoul(baud + 1, NULL, 10);
    wire->rts_cts = flow != NULL;
    serial_pipe_init(&wire->line, -1, wire->baud);
    wire->line.recover = recover;
    wire->line.context = wire;
    recover(wire);
    return wire->line.fd >= 0 || access(wire->device, F_OK) != 0
               ? NULL
               : "--wire: the port does not open so; is it in use, and the "
                 "rate one that it knows?";
}

const char *linux_wire_open(struct linux_wire *wire, const char *text,
                            const uint8_t *key, struct tcp_wire *net,
                            const char **told)
{
    memset(wire, 0, sizeof *wire);
    wire->net = net;
    if (strncmp(text, "listen:", 7) == 0) {
        return open_net(wire, text + 7, true, key, told);
    }
    if (strncmp(text, "call:", 5) == 0) {
        return open_net(wire, text + 5, false, key, told);
    }
    if (strncmp(text, "serial:", 7) == 0) {
        return open_line(wire, text + 7);
    }
    return "--wire: not one of listen:, call: and serial:";
}

/* --- all kinds ------------------------------------------------------------ */

struct link_pipe linux_wire_pipe(struct linux_wire *wire)
{
    return wire->kind == LINUX_TERMINAL ? serial_link_pipe(&wire->line)
           : wire->kind == LINUX_NET    ? tcp_wire_pipe(wire->net)
                                        : tcp_link_pipe(&wire->tcp);
}

/* Adds what to wait for: the number of entries. */
static unsigned add_events(const struct linux_wire *wire, struct pollfd *fds)
{
    if (wire->kind == LINUX_NET) {
        return tcp_wire_events(wire->net, fds);
    }
    bool line = wire->kind == LINUX_TERMINAL;
    fds->fd = line ? wire->line.fd : wire->tcp.fd;
    fds->events = line ? serial_events(&wire->line) : tcp_events(&wire->tcp);
    return fds->events != 0 ? 1 : 0;
}

void linux_wires_idle(struct linux_wire *wires, unsigned count,
                      uint64_t wait_us)
{
    struct pollfd fds[CUBE_LINKS_MAX * TCP_WIRE_FDS_MAX];
    nfds_t used = 0;
    for (unsigned i = 0; i < count; i++) {
        const struct linux_wire *wire = &wires[i];
        if (wire->kind == LINUX_TERMINAL &&
            serial_wait_us(&wire->line) < wait_us) {
            wait_us = serial_wait_us(&wire->line);
        }
        used += add_events(wire, fds + used);
    }
    struct timespec wait = {(time_t)(wait_us / 1000000),
                            (long)(wait_us % 1000000) * 1000};
    (void)ppoll(fds, used, &wait, NULL);
}
