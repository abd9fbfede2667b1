/* Wires of UARTs between sockets with paths: what comes at either end goes out
 * at the other at a baud rate, ten bits a byte, and by chance some of it is
 * changed, lost or drowned in noise.  An end that is away is called again, or
 * waited for, while the other stays; what is sent to it meanwhile is lost, as
 * on a wire that leads nowhere.
 *
 * No more is read from a sender than its wire takes, so that it fills its
 * socket as it would its UART.  A receiver that does not read holds its wire
 * up; with `fifo` it overruns, as no real UART holds up the other: it has that
 * many bytes unread, and what is due then is lost.  (Bytes that are due at one
 * look, UART_TICK_US apart or four bytes, are due together.)
 *
 * Chance is drawn for each direction of each wire, from the seed and its place
 * alone: the same bytes suffer the same.
 *
 * Memory: some 80 KB, the caller's. */
#ifndef TESTS_SYSTEM_RELAY_UART_H
#define TESTS_SYSTEM_RELAY_UART_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    UART_WIRES_MAX = 64,
    UART_HELD_BYTES = 512, /* most that go in one look */
    UART_PATH_BYTES = 108,
    UART_TICK_US = 1000,    /* between two looks at what goes, at least */
    UART_CALL_US = 20000,   /* between two calls of an end that is away */
    UART_BURST_MIN = 8,     /* bytes, */
    UART_BURST_SPREAD = 57, /* or up to 56 more */
};

struct uart_settings {
    uint64_t seed;
    uint32_t baud;
    uint32_t fifo; /* bytes; 0: a receiver that does not read is waited for */
    /* On average one of so many bytes has a bit flipped, is dropped, or begins
     * a burst of noise; 0: none. */
    uint32_t flip_bytes, drop_bytes, burst_bytes;
};

struct uart_counts {
    uint64_t bytes; /* that came onto wires */
    uint64_t flips, drops, bursts, burst_bytes;
    uint64_t overruns; /* bytes that a receiver had no room for, */
    uint64_t unheard;  /* or that led to an end that was away */
    uint64_t connections;
};

/* One direction.  Until each fault: how many bytes. */
struct uart_lane {
    uint64_t random, until_flip, until_drop, until_burst;
    unsigned burst;   /* bytes of one that are still to come */
    bool busy;        /* the sender had bytes when it was looked at last; */
    uint64_t free_ns; /* since when the wire could take the next */
    size_t held;      /* bytes that the receiver has no room for */
    uint8_t bytes[UART_HELD_BYTES];
};

struct uart_end {
    char path[UART_PATH_BYTES];
    int listener, fd; /* -1: none */
    uint64_t call_us; /* when it is called next */
};

struct uart_wire {
    struct uart_end end[2];
    struct uart_lane lane[2]; /* lane[i]: from end[i] */
};

struct uart_wires {
    struct uart_settings settings;
    struct uart_counts counts;
    uint64_t byte_ns, tick_us;
    uint64_t unread_unit; /* of what the kernel says that one byte takes */
    unsigned count;
    struct uart_wire wire[UART_WIRES_MAX];
};

/* False: the system does not say how much of a socket is unread. */
bool uart_wires_init(struct uart_wires *wires,
                     const struct uart_settings *settings);

/* A wire as "PATH,PATH": sockets that it calls, or with @ before it, that it
 * makes and is called at.  False, and errno, which is EINVAL for the text. */
bool uart_wires_add(struct uart_wires *wires, const char *text);

/* A wire between connected sockets that do not block. */
bool uart_wires_join(struct uart_wires *wires, int fd0, int fd1);

/* Carries what is due: when the next look is due, or UINT64_MAX, when something
 * comes. */
uint64_t uart_wires_carry(struct uart_wires *wires, uint64_t now_us);

/* Sleeps until then. */
void uart_wires_wait(const struct uart_wires *wires, uint64_t until_us);

void uart_wires_close(struct uart_wires *wires);

#endif
