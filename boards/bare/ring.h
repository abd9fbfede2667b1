/* Bytes from one who puts them to one who takes them, where one of the two is
 * an interrupt's handler: neither waits for the other, and neither needs a
 * lock.
 *
 * Memory: the caller's, a power of two bytes.  Work: constant a byte.
 *
 *     struct bare_ring ring = BARE_RING(ring_room);
 *     (void)bare_ring_put(&ring, 17);   // in the handler
 *     if (bare_ring_take(&ring, &byte))
 *         got(byte);
 */
#ifndef BOARDS_BARE_RING_H
#define BOARDS_BARE_RING_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

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
    if (put - ring->taken > ring->mask) {
        return false;
    }
    ring->bytes[put & ring->mask] = byte;
    atomic_signal_fence(memory_order_release);
    ring->put = put + 1;
    return true;
}

BARE_INLINE bool bare_ring_take(struct bare_ring *ring, uint8_t *byte) {
    uint32_t taken = ring->taken;
    if (ring->put == taken) {
        return false;
    }
    atomic_signal_fence(memory_order_acquire);
    *byte = ring->bytes[taken & ring->mask];
    atomic_signal_fence(memory_order_release);
    ring->taken = taken + 1;
    return true;
}

/* The same of many: as many as there is room for, or are there. */
size_t bare_ring_write(struct bare_ring *ring, const uint8_t *bytes,
                       size_t size);
size_t bare_ring_read(struct bare_ring *ring, uint8_t *bytes, size_t size);

#endif
