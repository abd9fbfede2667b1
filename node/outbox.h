/* Messages of a node that wait for credit or for room on their link: a ring of
 * message buffers that are filled in place and leave in order.
 *
 * Memory: NODE_OUTBOX_BYTES(slots), from the node's arena.  Work: constant a
 * call.
 *
 *     uint8_t *room = node_outbox_open(&box);
 *     memcpy(room, data, size);
 *     node_outbox_close(&box, NODE_SPILL, size);
 *     while ((slot = node_outbox_first(&box)) != NULL && sent(slot))
 *         node_outbox_drop(&box);
 */
#ifndef NODE_OUTBOX_H
#define NODE_OUTBOX_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "message.h"

struct node_outbox_slot {
    uint16_t size;
    uint8_t type;
    uint8_t reserved;
    uint8_t data[CUBE_PAYLOAD_MAX + 4]; /* 4: slack of result.h's writer */
};

struct node_outbox {
    struct node_outbox_slot *slots;
    uint32_t slot_count, first, used; /* closed slots, in order from first */
    uint32_t used_max;
};

#define NODE_OUTBOX_BYTES(slots) ((slots) * sizeof(struct node_outbox_slot))

void node_outbox_init(struct node_outbox *box, void *memory, uint32_t slots);

/* Slots that are neither closed nor waiting. */
static inline uint32_t node_outbox_free(const struct node_outbox *box) {
    return box->slot_count - box->used;
}

/* The buffer of the next message; there must be a free slot.  The same one
 * until it is closed. */
uint8_t *node_outbox_open(struct node_outbox *box);
void node_outbox_close(struct node_outbox *box, uint8_t type, size_t size);

/* The oldest closed message, or NULL. */
struct node_outbox_slot *node_outbox_first(const struct node_outbox *box);
void node_outbox_drop(struct node_outbox *box);

#endif
