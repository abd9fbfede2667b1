#include "outbox.h"

#include "incode/predicates/check.h"

void node_outbox_init(struct node_outbox *box, void *memory, uint32_t slots) {
    box->slots = memory;
    box->slot_count = slots;
    box->first = 0;
    box->used = 0;
    box->used_max = 0;
}

uint8_t *node_outbox_open(struct node_outbox *box) {
    INCODE_ASSERT(box->used < box->slot_count);
    return box->slots[(box->first + box->used) % box->slot_count].data;
}

void node_outbox_close(struct node_outbox *box, uint8_t type, size_t size) {
    INCODE_ASSERT(box->used < box->slot_count);
    INCODE_ASSERT(size <= CUBE_PAYLOAD_MAX);
    struct node_outbox_slot *slot =
        &box->slots[(box->first + box->used) % box->slot_count];
    slot->type = type;
    slot->size = (uint16_t)size;
    box->used++;
    if (box->used > box->used_max) {
        box->used_max = box->used;
    }
}

struct node_outbox_slot *node_outbox_first(const struct node_outbox *box) {
    return box->used == 0 ? NULL : &box->slots[box->first];
}

void node_outbox_drop(struct node_outbox *box) {
    INCODE_ASSERT(box->used > 0);
    box->first = (box->first + 1) % box->slot_count;
    box->used--;
}
