/* Wires of memory between the nodes of a test, which cut what they take, and
 * some of which hold back what they bring, at random; and what a board needs
 * besides.
 *
 * Memory: a ring each way.  Work: a copy of the bytes.
 *
 *     end[0] = (struct ring_end){&wire, 0};
 *     end[1] = (struct ring_end){&wire, 1};
 *     board.pipes[2] = ring_pipe(&end[0]);
 */
#ifndef TESTS_UNIT_RINGS_H
#define TESTS_UNIT_RINGS_H

#include "node/board.h"

enum { RING = 4096 };

struct ring {
    uint8_t data[RING];
    size_t first, used;
};

struct ring_wire {
    struct ring way[2]; /* by the side that writes */
    bool cut;           /* swallows all bytes */
    bool hesitates;     /* brings nothing now and then */
};

struct ring_end {
    struct ring_wire *wire;
    int side;
};

static uint64_t ring_state = 88172645463325252u;

/* The test's own chance too: below `below`. */
static inline uint32_t draw(uint32_t below)
{
    ring_state ^= ring_state << 13;
    ring_state ^= ring_state >> 7;
    ring_state ^= ring_state << 17;
    return (uint32_t)(ring_state >> 32) % below;
}

static inline int ring_send(void *context, const uint8_t *bytes, size_t size)
{
    const struct ring_end *end = context;
    struct ring *ring = &end->wire->way[end->side];
    size_t room = RING - ring->used;
    if (end->wire->cut) {
        return (int)size;
    }
    size = size < room ? size : room;
    size = draw(8) == 0 && size > 1 ? 1 + draw((uint32_t)size) : size;
    for (size_t i = 0; i < size; i++) {
        ring->data[(ring->first + ring->used++) % RING] = bytes[i];
    }
    return (int)size;
}

static inline int ring_receive(void *context, uint8_t *bytes, size_t size)
{
    const struct ring_end *end = context;
    struct ring *ring = &end->wire->way[1 - end->side];
    size = size < ring->used ? size : ring->used;
    size = end->wire->hesitates && draw(8) == 0 ? 0 : size;
    for (size_t i = 0; i < size; i++) {
        bytes[i] = ring->data[ring->first];
        ring->first = (ring->first + 1) % RING;
        ring->used--;
    }
    return (int)size;
}

static inline struct link_pipe ring_pipe(struct ring_end *end)
{
    struct link_pipe pipe = {end, ring_send, ring_receive};
    return pipe;
}

/* A board's functions where the test itself lets time pass. */
static inline void ring_idle(void *context, uint64_t wait_us)
{
    (void)context;
    (void)wait_us;
}

static inline void ring_reset(void *context, int status)
{
    (void)context;
    (void)status;
}

#endif
