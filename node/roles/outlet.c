#include "outlet.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "node/common.h"

enum {
    HEADER_BYTES = sizeof(struct node_result_header),
    BATCH_BYTES = CUBE_PAYLOAD_MAX - HEADER_BYTES,
    /* Tetrahedra that always fit a batch, even with a star and a finder record
     * each. */
    BATCH_TETRAHEDRA =
        BATCH_BYTES / (NODE_RESULT_FINDER_MAX + NODE_RESULT_STAR_MAX +
                       NODE_RESULT_TETRAHEDRON_MAX),
    /* Batches kept back for commits, and for stars cut by a batch's end. */
    BATCHES_RESERVED = 2,
    /* Messages on their way out: one for each 64 KiB of memory, within. */
    RESULT_SLOTS_MIN = 4,
    RESULT_SLOTS_MAX = 32,
    FEW_OF_SLOTS = 4, /* as a part of them: fewer results may wait */
    SPILL_SLOTS_MIN = 9,
    SPILL_SLOTS_MAX = 16
};

/* ---- memory ---- */

/* One slot for each 64 KiB of memory, within bounds. */
static uint32_t slots(size_t bytes, uint32_t min, uint32_t max) {
    size_t count = bytes / 65536;
    return count < min ? min : count > max ? max : (uint32_t)count;
}

static uint32_t result_slots(size_t bytes) {
    return slots(bytes, RESULT_SLOTS_MIN, RESULT_SLOTS_MAX);
}

static uint32_t spill_slots(size_t bytes) {
    return slots(bytes, SPILL_SLOTS_MIN, SPILL_SLOTS_MAX);
}

size_t node_outlet_bytes(size_t bytes) {
    return node_aligned(
        NODE_OUTBOX_BYTES(result_slots(bytes) + spill_slots(bytes)));
}

void node_outlet_init(struct node_outlet *outlet, void *memory, size_t bytes,
                      const struct node_setup_message *setup,
                      struct node_counted *counted, struct node_fault *fault) {
    uint32_t results = result_slots(bytes);
    memset(outlet, 0, sizeof *outlet);
    outlet->counted = counted;
    outlet->fault = fault;
    outlet->credit = setup->credits;
    outlet->finder = counted->self;
    node_outbox_init(&outlet->results, memory, results);
    node_outbox_init(&outlet->spills,
                     (uint8_t *)memory + NODE_OUTBOX_BYTES(results),
                     spill_slots(bytes));
}

void node_outlet_begin(struct node_outlet *outlet, uint32_t epoch) {
    outlet->epoch = epoch;
}

void node_outlet_found_by(struct node_outlet *outlet, uint16_t node) {
    outlet->finder = node;
}

/* ---- what a front gives ---- */

static size_t outside_emit_room(void *context) {
    const struct node_outlet *o = context;
    uint32_t batches = node_outbox_free(&o->results);
    return batches <= BATCHES_RESERVED
               ? 0
               : (size_t)(batches - BATCHES_RESERVED) * BATCH_TETRAHEDRA;
}

static void open_batch(struct node_outlet *o) {
    uint8_t *data = node_outbox_open(&o->results);
    struct node_result_header header = {o->epoch, 0};
    memcpy(data, &header, sizeof header);
    node_result_begin(&o->writer, data + HEADER_BYTES, BATCH_BYTES,
                      o->counted->self);
    o->open = true;
}

static void close_batch(struct node_outlet *o) {
    if (o->open) {
        node_outbox_close(&o->results, NODE_RESULT,
                          HEADER_BYTES + o->writer.size);
        o->open = false;
    }
}

/* The outbox is full although the triangulator was told how much it takes. */
static bool overrun(struct node_outlet *o) {
    if (!o->open && node_outbox_free(&o->results) == 0) {
        node_fault_set(o->fault, "more results than # messages hold",
                       o->results.slot_count, 0);
    }
    return node_fault_is_set(o->fault);
}

static void outside_emit(void *context, uint32_t vertex,
                         const uint32_t (*apexes)[3], size_t count) {
    struct node_outlet *o = context;
    while (count > 0 && !overrun(o)) {
        if (!o->open)
            open_batch(o);
        size_t written = 0;
        if (node_result_finder(&o->writer, o->finder))
            written = node_result_star(&o->writer, vertex, apexes, count);
        if (written < count)
            close_batch(o);
        apexes += written;
        count -= written;
    }
}

static void outside_commit(void *context, uint32_t brick) {
    struct node_outlet *o = context;
    while (!overrun(o)) {
        if (!o->open)
            open_batch(o);
        if (node_result_commit(&o->writer, brick))
            return;
        close_batch(o);
    }
}

static void close_spill(struct node_outlet *o) {
    if (o->spill_count > 0) {
        struct node_spill_header header = {o->epoch, 0, o->spill_count, 0, 0};
        memcpy(node_outbox_open(&o->spills), &header, sizeof header);
        node_outbox_close(&o->spills, NODE_SPILL,
                          sizeof header +
                              o->spill_count * sizeof(struct incode_face));
        o->spill_count = 0;
    }
}

/* Faces that the outbox takes now, the open message's included. */
static size_t spill_room(const struct node_outlet *o) {
    return (size_t)node_outbox_free(&o->spills) * NODE_FACES_A_MESSAGE -
           o->spill_count;
}

/* Faces come in small numbers: they wait in one message until it is full or
 * the link has nothing else to do. */
static bool outside_spill(void *context, const struct incode_face *faces,
                          size_t count) {
    struct node_outlet *o = context;
    if (spill_room(o) < count)
        (void)node_outlet_send(o);
    if (spill_room(o) < count)
        return false;
    for (size_t i = 0; i < count; i++) {
        uint8_t *data = node_outbox_open(&o->spills);
        memcpy(data + sizeof(struct node_spill_header) +
                   o->spill_count * sizeof *faces,
               &faces[i], sizeof *faces);
        if (++o->spill_count == NODE_FACES_A_MESSAGE)
            close_spill(o);
    }
    return true;
}

static bool outside_unspill(void *context, uint32_t brick) {
    struct node_outlet *o = context;
    if (node_outbox_free(&o->spills) < 2)
        return false;
    close_spill(o); /* what was spilled before is part of the list */
    struct node_spill_header header = {o->epoch, brick, 0, 0, 0};
    memcpy(node_outbox_open(&o->spills), &header, sizeof header);
    node_outbox_close(&o->spills, NODE_UNSPILL_REQUEST, sizeof header);
    return true;
}

struct incode_front_outside node_outlet_outside(struct node_outlet *outlet) {
    return (struct incode_front_outside){
        outlet,        outside_emit_room, outside_emit, outside_commit,
        outside_spill, outside_unspill,   NULL};
}

bool node_outlet_has_room(const struct node_outlet *outlet) {
    return node_outbox_free(&outlet->results) > BATCHES_RESERVED;
}

void node_outlet_close(struct node_outlet *outlet) {
    close_batch(outlet);
}

/* ---- what comes back ---- */

bool node_outlet_take_unspill(struct node_outlet *o, const uint8_t *data,
                              size_t size, struct node_spill_header *header,
                              struct incode_face faces[NODE_FACES_A_MESSAGE]) {
    if (size < sizeof *header) {
        node_fault_set(o->fault, "spilled faces in # bytes, header takes #",
                       (uint32_t)size, sizeof *header);
        return false;
    }
    memcpy(header, data, sizeof *header);
    if (header->count > NODE_FACES_A_MESSAGE ||
        size != sizeof *header + header->count * sizeof faces[0]) {
        node_fault_set(o->fault, "# spilled faces in # bytes", header->count,
                       (uint32_t)size);
        return false;
    }
    if (header->epoch != o->epoch || header->sent != o->counted->received)
        return false;
    memcpy(faces, data + sizeof *header, header->count * sizeof faces[0]);
    return true;
}

void node_outlet_refuse_unspill(struct node_outlet *outlet, uint32_t brick) {
    node_fault_set(outlet->fault,
                   "spilled faces of brick # not requested, or none of it",
                   brick, 0);
}

void node_outlet_take_credit(struct node_outlet *o, const uint8_t *data,
                             size_t size) {
    if (size != sizeof o->credit) {
        node_fault_set(o->fault, "credit in # bytes, expected #",
                       (uint32_t)size, sizeof o->credit);
        return;
    }
    uint32_t credit;
    memcpy(&credit, data, sizeof credit);
    if ((int32_t)(credit - o->credit) < 0) {
        node_fault_set(o->fault, "credit # after credit #", credit, o->credit);
        return;
    }
    o->credit = credit;
}

/* ---- on the link ---- */

/* Sends the first message of an outbox; false where the link has no room. */
static bool send_first(struct node_outlet *o, struct node_outbox *box) {
    struct node_outbox_slot *slot = node_outbox_first(box);
    if (slot == NULL)
        return false;
    if (slot->type != NODE_SPILL) {
        size_t at = slot->type == NODE_RESULT
                        ? offsetof(struct node_result_header, sent)
                        : offsetof(struct node_spill_header, sent);
        memcpy(slot->data + at, &o->counted->sent, sizeof o->counted->sent);
    }
    if (node_counted_write(o->counted, CUBE_HOST, slot->type, slot->data,
                           slot->size) != 0)
        return false;
    o->bytes_out += slot->size;
    node_outbox_drop(box);
    return true;
}

bool node_outlet_few(const struct node_outlet *outlet) {
    const struct node_outlet *o = outlet;
    bool last = o->results.used > 0 && !o->open; /* none may come behind it */
    return !last && o->results.used < o->results.slot_count / FEW_OF_SLOTS &&
           o->spills.used == 0 && o->spill_count == 0;
}

unsigned node_outlet_send(struct node_outlet *outlet) {
    struct node_outlet *o = outlet;
    unsigned sent = 0;
    if (o->spills.used == 0)
        close_spill(o);
    while (send_first(o, &o->spills))
        sent++;
    while ((int32_t)(o->credit - o->sent) > 0 && send_first(o, &o->results)) {
        o->sent++;
        sent++;
    }
    return sent;
}

uint32_t node_outlet_held(const struct node_outlet *outlet) {
    return outlet->open + outlet->results.used + outlet->spills.used +
           outlet->spill_count;
}
