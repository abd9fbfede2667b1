#include "linda_builder.h"

#include <string.h>

#include "share.h"
#include "tetra_builder.h"

struct linda_builder {
    struct node_tetra_builder tetra;
    struct node_share share;
    size_t share_bytes;
    bool runs;                  /* eval has started it */
    uint64_t first_us, last_us; /* when messages of the space came */
};

static size_t linda_builder_arena_min(size_t memory,
                                      const struct node_setup_message *setup) {
    (void)memory;
    return node_aligned(sizeof(struct linda_builder)) +
           node_share_bytes(setup) + node_tetra_builder_min(setup);
}

/* Until it has taken the end: all answers have left by then. */
static bool build(void *self, struct tuple *tuple) {
    struct linda_builder *b = self;
    b->runs = !b->share.ended;
    if (b->runs) {
        return false;
    }
    b->share.ended = false;
    tuple->field[1] = TUPLE_UINT32(b->share.taken);
    b->share.taken = 0; /* the next process counts its own */
    return true;
}

static bool linda_builder_start(void *self, size_t bytes,
                                const struct node_setup_message *setup,
                                struct node_counted *counted,
                                struct node_fault *fault) {
    struct linda_builder *b = self;
    uint8_t *memory = (uint8_t *)self + node_aligned(sizeof *b);
    size_t share = node_share_bytes(setup);
    size_t own = node_aligned(sizeof *b) + share;
    if (bytes < own) {
        node_fault_set(fault,
                       "the node's memory does not hold its share of the tuple "
                       "space",
                       0, 0);
        return false;
    }
    memset(b, 0, sizeof *b);
    b->share_bytes = share;
    if (!node_share_init(&b->share, memory, setup, build, b, counted, fault)) {
        return false;
    }
    const struct node_carrier carrier =
        node_share_carrier(&b->share, NODE_SHARE_RESULT, NODE_SHARE_JOB, 1);
    return node_tetra_builder_start(&b->tetra, memory + share, bytes - own,
                                    setup, &carrier, counted, fault);
}

static void linda_builder_message(void *self,
                                  const struct cube_message *message,
                                  uint64_t now_us) {
    struct linda_builder *b = self;
    if (message->type == NODE_TUPLES) {
        b->first_us = b->first_us == 0 ? now_us : b->first_us;
        b->last_us = now_us;
        node_share_take(&b->share, message);
    } else if (message->type == NODE_JOB) {
        node_fault_set(b->tetra.fault, "a job for a node that builds", 0, 0);
    } else if (!node_tetra_builder_message(&b->tetra, message)) {
        node_fault_set(b->tetra.fault, "message of type # for a builder",
                       message->type, 0);
    }
}

static unsigned linda_builder_work(void *self, struct node_pace *pace) {
    struct linda_builder *b = self;
    return b->runs ? node_tetra_builder_work(&b->tetra, pace) : 0;
}

static unsigned linda_builder_send(void *self) {
    struct linda_builder *b = self;
    return node_requests_send(&b->tetra.requests) + tuples_step(b->share.space);
}

static uint32_t linda_builder_done(const void *self) {
    (void)self;
    return 0; /* there are no jobs */
}

static void linda_builder_end(void *self, uint64_t now_us) {
    (void)self, (void)now_us;
}

static uint32_t linda_builder_awaited(const void *self) {
    const struct linda_builder *b = self;
    return node_tetra_builder_awaited(&b->tetra);
}

static uint32_t linda_builder_held(const void *self) {
    const struct linda_builder *b = self;
    return node_tetra_builder_held(&b->tetra) + tuples_held(b->share.space);
}

static void linda_builder_totals(const void *self,
                                 struct node_finished_message *totals,
                                 uint64_t now_us) {
    const struct linda_builder *b = self;
    (void)now_us;
    node_tetra_builder_totals(&b->tetra, totals);
    totals->wall_us = b->last_us - b->first_us;
    totals->bytes_in += b->share.bytes_in;
    totals->bytes_out += b->share.bytes_out;
    totals->memory_high_water += node_aligned(sizeof *b) + b->share_bytes;
}

static void linda_builder_map(const void *self, struct node_map *map) {
    const struct linda_builder *b = self;
    node_tetra_builder_map(&b->tetra, map);
    map->tables[0].bytes += (uint32_t)node_aligned(sizeof *b);
    map->tables[2].bytes = (uint32_t)b->share_bytes;
}

static void linda_builder_gauge(const void *self, struct incode_gauge *gauge) {
    const struct linda_builder *b = self;
    node_tetra_builder_gauge(&b->tetra, gauge);
}

const struct node_role node_linda_builder_role = {
    .name = "linda builder",
    .tables = {{"maker, its local points, lists at work", NULL},
               {"page frames", "pages of 1568 bytes"},
               {"share of the tuple space", NULL}},
    .arena_min = linda_builder_arena_min,
    .start = linda_builder_start,
    .message = linda_builder_message,
    .work = linda_builder_work,
    .send = linda_builder_send,
    .done = linda_builder_done,
    .end = linda_builder_end,
    .awaited = linda_builder_awaited,
    .held = linda_builder_held,
    .totals = linda_builder_totals,
    .gauge = linda_builder_gauge,
    .map = linda_builder_map,
};
