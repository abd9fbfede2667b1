/* Pipes of bytes over serial wires on Linux: any open terminal, be it a real
 * port, a USB adapter or a pseudo-terminal.  This file has the pipe over an
 * open terminal; serial_port.h finds and opens real ports.
 *
 * The kernel gets at most SERIAL_AHEAD_BYTES, or on a fast wire the bytes of
 * SERIAL_AHEAD_US, ahead of the wire, so that a link measures the wire and not
 * the kernel's queue.  The pipe uses the kernel's count of queued bytes if
 * there is one, and otherwise, with a baud rate, the clock.
 *
 * Work: at most three system calls a function. */
#ifndef TRANSPORT_DRIVERS_SERIAL_H
#define TRANSPORT_DRIVERS_SERIAL_H

#include <stdbool.h>
#include <stdint.h>

#include "transport/link.h"

enum { SERIAL_AHEAD_BYTES = 512, SERIAL_AHEAD_US = 4000 };

struct serial_pipe {
    int fd;        /* open, non-blocking; -1: none */
    uint32_t baud; /* 0: as fast as the kernel takes */
    bool blocked;  /* had no room for all bytes at the last send */
    bool closed;   /* the other end is gone, or the port; it may come back */
    uint64_t ahead_microbytes; /* not sent yet, by the clock */
    uint64_t ahead_us;         /* when that was counted, */
    uint64_t (*now_us)(void);  /* on this clock: the monotonic one */
    bool counts;               /* the kernel says what it has not sent */
    /* Called while the pipe is closed, NULL: no: to open it again. */
    void (*recover)(void *context);
    void *context;
};

/* Sets a terminal to raw bytes: 8 bits, no parity, a stop bit, no echo, no flow
 * control by bytes, modem lines ignored and left as they are on close;
 * non-blocking, closed on exec.  0, or -1 and errno. */
int serial_raw(int fd);

/* Opens a terminal by its path with that, at a rate (0: as it is), with or
 * without RTS/CTS; no library takes part.  The descriptor, or -1 and errno. */
int serial_open(const char *path, uint32_t baud, bool rts_cts);

/* Closes without waiting for bytes that the wire does not take. */
void serial_close(int fd);

/* A pseudo-terminal, both ends raw: fds[0] its master, fds[1] its slave.  0, or
 * -1 and errno. */
int serial_pair(int fds[2]);

/* The pipe uses fd, which stays the caller's. */
void serial_pipe_init(struct serial_pipe *pipe, int fd, uint32_t baud);
struct link_pipe serial_link_pipe(struct serial_pipe *pipe);

/* What to wait for with poll(2), as tcp_events of tcp.h, */
short serial_events(const struct serial_pipe *pipe);

/* and for how long at most: bytes may wait for the wire's time. */
uint64_t serial_wait_us(const struct serial_pipe *pipe);

#endif
