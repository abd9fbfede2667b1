/* A wire over TCP between machines: one end listens, the other calls, and calls
 * again when the connection breaks, with growing pauses, while the wire's pipe
 * never waits.  With a key both ends prove that they know it before a byte
 * passes, and every record is authenticated (secure.h); without, an end
 * listens on and calls loopback addresses only.
 *
 * Strangers: at most TCP_CANDIDATES_MAX connections are being proven at a time,
 * the oldest giving way, each for TCP_PROVE_US at most; the peer's own new
 * connection, once proven, takes the place of the old one.
 *
 * Memory: struct tcp_wire and in the kernel two buffers of TCP_BUFFER_BYTES a
 * connection.  Work: tcp_wire's pipe accepts at most TCP_ACCEPTS_MAX
 * connections a call, and looks at each candidate once.
 *
 *     tcp_address_parse(&config.address, "[2001:db8::7]:7000");
 *     if (tcp_wire_open(&wire, &config) != 0) perror("wire");
 *     pipe = tcp_wire_pipe(&wire);
 *     count = tcp_wire_events(&wire, fds);
 *     poll(fds, count, 100);
 *     tcp_wire_heard(&wire, fds, count);
 */
#ifndef TRANSPORT_DRIVERS_TCP_WIRE_H
#define TRANSPORT_DRIVERS_TCP_WIRE_H

#include <poll.h>
#include <sys/socket.h>

#include "../secure.h"
#include "tcp.h"

enum {
    TCP_CANDIDATES_MAX = 8,
    TCP_ACCEPTS_MAX = 4,
    TCP_WIRE_FDS_MAX = TCP_CANDIDATES_MAX + 2,
    TCP_PROVE_US = 3000000,
    TCP_SILENT_MS = 5000,       /* with bytes that are not acknowledged */
    TCP_CALL_US = 3000000,      /* for a connection to be made */
    TCP_PAUSE_MIN_US = 20000,   /* before the next call, doubled each time */
    TCP_PAUSE_MAX_US = 1000000, /* up to this */
};

struct tcp_address {
    union {
        struct sockaddr any;
        struct sockaddr_storage storage;
    } to;
    socklen_t size;
};

/* "127.0.0.1:7000", "[::1]:7000": numbers alone, no names.  0, or -1. */
int tcp_address_parse(struct tcp_address *address, const char *text);

/* Of this machine only: 127.0.0.0/8 or ::1. */
bool tcp_address_is_loopback(const struct tcp_address *address);

/* Makes a loopback address of it, with the same port. */
void tcp_address_to_loopback(struct tcp_address *address);

struct tcp_wire_config {
    struct tcp_address address;
    bool listens;                     /* there; else calls it */
    const struct secure_suite *suite; /* NULL: no key */
    const uint8_t *key;               /* SECURE_KEY_BYTES, stay the caller's */
};

struct tcp_candidate {
    int fd;         /* -1: none */
    bool connected; /* a call has been answered */
    uint64_t since_us;
    struct tcp_pipe pipe;
    struct secure_shake shake;
};

struct tcp_wire {
    struct tcp_wire_config config;
    int listener;        /* -1: none */
    struct tcp_pipe tcp; /* the connection; fd -1: none */
    bool replaced;       /* by a newer one: the link hears of a break */
    bool quiet;          /* nobody called when it was last waited for */
    uint64_t call_us, pause_us;
    struct tcp_candidate candidate[TCP_CANDIDATES_MAX];
    struct secure_channel channel;
    uint64_t connections, strangers; /* taken; sent away */
    int fault;                       /* errno of the last call, 0: none */
};

/* 0, or -1 and errno: EACCES for an address that a wire without a key must not
 * use, or why it cannot listen.  A peer that is not there yet is no fault. */
int tcp_wire_open(struct tcp_wire *wire, const struct tcp_wire_config *config);
void tcp_wire_close(struct tcp_wire *wire);

/* At the end that calls: leaves the connection, and calls again after rest_us,
 * as whoever has the other end needs it for another. */
void tcp_wire_rest(struct tcp_wire *wire, uint64_t rest_us);

struct link_pipe tcp_wire_pipe(struct tcp_wire *wire);

/* What to wait for with poll(2): fills fds[TCP_WIRE_FDS_MAX], returns how
 * many. */
unsigned tcp_wire_events(const struct tcp_wire *wire, struct pollfd *fds);

/* What poll(2) has found of it, as tcp_heard. */
void tcp_wire_heard(struct tcp_wire *wire, const struct pollfd *fds,
                    unsigned count);

#endif
