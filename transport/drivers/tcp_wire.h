/* A wire over TCP between machines, or over a socket with a path on one machine
 * (unix_file.h).  One end listens.  The other calls, and calls again with
 * growing pauses when the connection breaks.  The wire's pipe never waits.
 * With a key both ends prove that they know it before a byte passes, and every
 * record is authenticated (secure.h).  Without a key the wire works only if
 * `insecure` is set: anybody who reaches the address can take it over.  At a
 * path the kernel identifies the caller, and no key is needed.
 *
 * Strangers: at most TCP_CANDIDATES_MAX connections are being proven at a time,
 * each for at most TCP_PROVE_US.  A new connection replaces the oldest one that
 * has not begun like the peer.  If most of them have, only TCP_TURNS_MAX
 * connections are accepted every TCP_CROWD_US, so that the peer has time for
 * its proof, and other callers wait in the kernel.  A new connection that is
 * proven replaces the old one.  A connection that has the key but is meant for
 * another wire is taken only if there is none, because the link then reports
 * its peer.  Without a key the proof is a link's HELLO.  If there is no such
 * connection, one that sends nothing, or begins as an end with a key, is taken;
 * the latter learns the fault from the link's HELLO.  While a connection is in
 * use, others are polled every TCP_LOOK_US.
 *
 * Memory: struct tcp_wire and in the kernel two buffers of TCP_BUFFER_BYTES a
 * connection.  Work: tcp_wire's pipe accepts at most TCP_ACCEPTS_MAX
 * connections a call, and polls each candidate once. */
#ifndef TRANSPORT_DRIVERS_TCP_WIRE_H
#define TRANSPORT_DRIVERS_TCP_WIRE_H

#include <poll.h>

#include "transport/secure.h"
#include "tcp.h"

enum {
    TCP_CANDIDATES_MAX = 16,
    TCP_ACCEPTS_MAX = 16,
    TCP_TURNS_MAX = 4,  /* of those, that replace one that began well */
    TCP_QUEUE_MAX = 64, /* that wait to be let in */
    TCP_WIRE_FDS_MAX = TCP_CANDIDATES_MAX + 2,
    TCP_FIRST_BYTES = 256, /* within which a greeting must be */
    TCP_PROVE_US = 3000000,
    TCP_PROVE_MIN_US = 250000, /* at the end that calls, at first */
    TCP_CALL_MIN_US = 50000,   /* for a call to be answered, at first */
    TCP_QUIET_US = 100000,     /* without a key: says nothing for so long */
    TCP_LOOK_US = 10000,
    TCP_CROWD_US = 1000,
    TCP_SILENT_MS = 5000,       /* with bytes that are not acknowledged */
    TCP_PAUSE_MIN_US = 20000,   /* before the next call, doubled each time */
    TCP_PAUSE_AWAY_US = 40000,  /* up to this if it got no slot, */
    TCP_PAUSE_MAX_US = 1000000, /* else up to this */
    TCP_OTHER_KEY_US = 5000000  /* nobody with another key, or with a key where
                                   this end has none: it is gone */
};

struct tcp_wire_config {
    struct tcp_address address;
    bool listens;                     /* there; else calls it */
    bool insecure;                    /* over TCP without a key */
    const struct secure_suite *suite; /* NULL: no key */
    const uint8_t *key;               /* SECURE_KEY_BYTES, stay the caller's */
    /* Which nodes and ports are at its ends, as far as is known when a
     * connection is made; stays the caller's.  NULL: not at all. */
    const struct secure_ends *ends;
    /* What its openings are drawn from; stays the caller's.  NULL: the system's
     * random bytes. */
    struct secure_source *source;
};

/* The system's random bytes, as secure_source asks for them; context: none. */
bool tcp_random(void *context, uint8_t *bytes, size_t size);

/* What an end without a key has said before it was taken. */
struct tcp_first {
    size_t begin, end;
    uint8_t bytes[TCP_FIRST_BYTES];
};

struct tcp_candidate {
    int fd;         /* -1: none */
    bool connected; /* a call has been answered */
    uint64_t since_us;
    struct tcp_pipe pipe;
    union {
        struct secure_shake shake; /* with a key */
        struct tcp_first first;    /* without, where it listens */
    } heard;
};

struct tcp_wire {
    struct tcp_wire_config config;
    int listener;                /* -1: none */
    struct tcp_pipe tcp;         /* the connection; fd -1: none */
    bool proven;                 /* the peer is proven */
    bool replaced;               /* by a newer one: the link hears of a break */
    bool quiet;                  /* no call came during the last wait */
    bool other_key;              /* the last one met has another key, */
    bool lone_key;               /* or only one of both has a key; */
    uint64_t other_key_us;       /* when that was met last */
    bool other_user;             /* or it is run by another user */
    struct secure_source source; /* of what makes each opening another */
    uint64_t call_us, pause_us;
    uint64_t answer_us, prove_us; /* patience with the peer's answer, and with
                                     its proof, of the caller */
    uint64_t look_us;  /* when candidates are looked at again; 0: at once */
    uint64_t admit_us; /* when others are let in; 0: at once */
    struct tcp_first first;
    struct tcp_candidate candidate[TCP_CANDIDATES_MAX];
    struct secure_records records;
    uint64_t connections, strangers; /* taken; sent away */
    int fault;                       /* errno of the last call, 0: none */
};

/* 0, or -1 and errno: EACCES without a key over TCP, if that is not meant, or
 * why it cannot listen.  A peer that is not there yet is no fault. */
int tcp_wire_open(struct tcp_wire *wire, const struct tcp_wire_config *config);
void tcp_wire_close(struct tcp_wire *wire);

/* At the end that calls: closes the connection, and calls again after rest_us,
 * because the other end needs the wire for another host. */
void tcp_wire_rest(struct tcp_wire *wire, uint64_t rest_us);

/* Why the last connection was not from the peer, and what to do, as texts for
 * the user; NULL: no reason is known. */
struct tcp_wire_doubt {
    const char *what, *next;
};
struct tcp_wire_doubt tcp_wire_doubt(const struct tcp_wire *wire);

struct link_pipe tcp_wire_pipe(struct tcp_wire *wire);

/* What to wait for with poll(2): fills fds[TCP_WIRE_FDS_MAX], returns how
 * many. */
unsigned tcp_wire_events(const struct tcp_wire *wire, struct pollfd *fds);

/* The pipe must be used again within so many microseconds, even if no byte
 * comes. */
uint64_t tcp_wire_wait_us(const struct tcp_wire *wire);

/* What poll(2) has found of it, as tcp_heard. */
void tcp_wire_heard(struct tcp_wire *wire, const struct pollfd *fds,
                    unsigned count);

#endif
