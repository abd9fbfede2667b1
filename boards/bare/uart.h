/* A UART between its interrupts and a link: two rings.  The handler of a board
 * puts what comes and takes what goes; a link's pipe does the other half.  A
 * byte that finds no room is dropped and counted, as one that the UART itself
 * lost: the link repairs it. */
#ifndef BOARDS_BARE_UART_H
#define BOARDS_BARE_UART_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "transport/link.h"

/* Bytes from one who puts them to one who takes them, where one of the two is
 * an interrupt's handler: neither waits for the other, and neither needs a
 * lock. */

/* In handlers, which call nobody. */
#define BARE_INLINE static inline __attribute__((always_inline))

struct bare_ring {
    uint8_t *bytes;
    uint32_t mask;
    /* Counts of bytes, modulo 2^32; each is written by one side only. */
    volatile uint32_t put, taken;
};

/* In an array whose size is a power of two. */
#define BARE_RING(array)                                                       \
    { array, sizeof(array) - 1, 0, 0 }

static inline uint32_t bare_ring_held(const struct bare_ring *ring) {
    return ring->put - ring->taken;
}

static inline uint32_t bare_ring_room(const struct bare_ring *ring) {
    return ring->mask + 1 - bare_ring_held(ring);
}

/* A byte is there before the count says so: handler and program are of one
 * processor, so that it is the compiler alone that must keep the order. */
BARE_INLINE bool bare_ring_put(struct bare_ring *ring, uint8_t byte) {
    uint32_t put = ring->put;
    if (__builtin_expect(put - ring->taken > ring->mask, 0))
        return false;
    ring->bytes[put & (uintptr_t)ring->mask] = byte;
    atomic_signal_fence(memory_order_release);
    ring->put = put + 1;
    return true;
}

BARE_INLINE bool bare_ring_take(struct bare_ring *ring, uint8_t *byte) {
    uint32_t taken = ring->taken;
    if (ring->put == taken)
        return false;
    atomic_signal_fence(memory_order_acquire);
    *byte = ring->bytes[taken & (uintptr_t)ring->mask];
    atomic_signal_fence(memory_order_release);
    ring->taken = taken + 1;
    return true;
}

/* The same of many: as many as there is room for, or are there. */
size_t bare_ring_write(struct bare_ring *ring, const uint8_t *bytes,
                       size_t size);
size_t bare_ring_read(struct bare_ring *ring, uint8_t *bytes, size_t size);

enum {
    BARE_UARTS_MAX = 5,
    /* 355 ms of a wire at 115,200 baud, 44 ms at 921,600. */
    BARE_RECEIVE_BYTES = 4096,
    BARE_SEND_BYTES = 512,
    /* That a call of a handler moves, at most: what comes meanwhile, or can go,
     * calls it again, so that it is never long away from what it has
     * interrupted. */
    BARE_BYTES_A_CALL = 4
};

struct bare_uart {
    struct bare_ring receive, send;
    volatile uint32_t overruns; /* bytes that were lost, or times some were */
    volatile uint32_t ends;     /* zeros that came: each ends a frame */
    uint32_t ends_taken;        /* of those, before the link looked */
    bool starved; /* a link had more to send than there was room */
    bool unused;  /* no link reads it: noise on it wakes nobody */
    uint8_t received[BARE_RECEIVE_BYTES], sent[BARE_SEND_BYTES];
};

extern struct bare_uart bare_uart[BARE_UARTS_MAX];

void bare_uarts_init(void);

/* For a board's handlers. */
BARE_INLINE void bare_uart_put(struct bare_uart *uart, uint8_t byte) {
    if (!bare_ring_put(&uart->receive, byte))
        uart->overruns++;
    uart->ends += byte == 0;
}

static inline bool bare_uart_heard(const struct bare_uart *uart) {
    return bare_ring_held(&uart->receive) > 0;
}

/* Whether its link has something to do: a frame may be whole, so many bytes
 * came that they want room, or those that went have made some. */
bool bare_uart_ready(const struct bare_uart *uart);

struct link_pipe bare_uart_pipe(unsigned uart);

/* It has no link any more: what comes by it is nobody's, and not counted. */
void bare_uart_leave(unsigned uart);

/* Sum of the overruns of all that have a link. */
uint32_t bare_uarts_overruns(void);

/* Waits until all has left that links have put, at most limit_us. */
void bare_uarts_flush(uint64_t limit_us);

#endif
