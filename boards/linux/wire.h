/* The wires of a node on Linux: sockets, or terminals. */
#ifndef BOARDS_LINUX_WIRE_H
#define BOARDS_LINUX_WIRE_H

#include "fault.h"
#include "transport/cube.h"
#include "transport/drivers/serial.h"
#include "transport/drivers/tcp_wire.h"

/* In the environment of a node that begins anew: what a user has to know once
 * was said. */
#define LINUX_AGAIN "INCODE_AGAIN"

enum linux_wire_kind { LINUX_SOCKET, LINUX_TERMINAL, LINUX_NET };

struct linux_wire {
    enum linux_wire_kind kind;
    struct secure_ends ends;   /* who is at them, as far as is known */
    struct tcp_pipe tcp;       /* a socket from the one who started the node */
    struct serial_pipe serial; /* a terminal */
    struct tcp_wire *net;      /* a socket, by calling and listening, */
    const char *text;          /* as it was asked for; */
    bool told;                 /* its trouble was told */
    char device[128];          /* of a terminal that was opened here */
    uint32_t baud;
    bool rts_cts;
    uint64_t look_us; /* when it was last looked for, */
    int reason;       /* errno of that; 0: it was there */
};

/* An open file that the one who started the node gave it. */
void linux_wire_inherit(struct linux_wire *wire, int fd);

/* What a wire of TCP may do: with the key of the cube (NULL: it has none), or
 * without. */
struct linux_guard {
    const uint8_t *key;
    struct secure_source *source; /* of its openings */
    bool insecure;
};

/* "listen:ADDRESS:PORT", "call:ADDRESS:PORT" (addresses in numbers),
 * "unix-listen:PATH", "unix-call:PATH", "serial:DEVICE:BAUD" or
 * "serial:DEVICE:BAUD:rtscts".  False: *fault says what is wrong, and not
 * where. */
bool linux_wire_open(struct linux_wire *wire, const char *text,
                     const struct linux_guard *guard, struct tcp_wire *net,
                     struct linux_fault *fault);

/* Once the node knows who it is: that its links are those of this cube; no
 * longer than CUBE_LINKS_MAX. */
void linux_wires_name(struct linux_wire *wires, unsigned count,
                      const struct cube_config *cube);

/* Removes the files of sockets that were made here, when a signal ends the
 * process.  At most once, with all wires, which stay the caller's. */
void linux_wires_end_with(const struct linux_wire *wires, unsigned count);

struct link_pipe linux_wire_pipe(struct linux_wire *wire);

/* Bit i: nobody is connected by wire i, and who was there last could not prove
 * that it has the key, or has one where this end has none. */
uint32_t linux_wires_refused(const struct linux_wire *wires, unsigned count);

/* Sleeps until bytes have come, or room for them where there was none, but no
 * longer than wait_us; awake_us: as in unix_file.h.  At most CUBE_LINKS_MAX
 * wires.
 */
void linux_wires_idle(struct linux_wire *wires, unsigned count,
                      uint64_t wait_us, uint64_t awake_us);

#endif
