#include "ring.h"

#include <string.h>

/* Bytes from `at` on that lie in one piece, of `size`. */
static size_t piece(const struct bare_ring *ring, uint32_t at, size_t size) {
    size_t to_end = ring->mask + 1 - (at & ring->mask);
    return size < to_end ? size : to_end;
}

size_t bare_ring_write(struct bare_ring *ring, const uint8_t *bytes,
                       size_t size) {
    uint32_t put = ring->put, room = bare_ring_room(ring);
    size_t all = size < room ? size : room;
    size_t first = piece(ring, put, all);
    memcpy(ring->bytes + (put & ring->mask), bytes, first);
    memcpy(ring->bytes, bytes + first, all - first);
    atomic_signal_fence(memory_order_release);
    ring->put = put + (uint32_t)all;
    return all;
}

size_t bare_ring_read(struct bare_ring *ring, uint8_t *bytes, size_t size) {
    uint32_t taken = ring->taken, held = bare_ring_held(ring);
    size_t all = size < held ? size : held;
    size_t first = piece(ring, taken, all);
    atomic_signal_fence(memory_order_acquire);
    memcpy(bytes, ring->bytes + (taken & ring->mask), first);
    memcpy(bytes + first, ring->bytes, all - first);
    atomic_signal_fence(memory_order_release);
    ring->taken = taken + (uint32_t)all;
    return all;
}
