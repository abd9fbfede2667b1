#include "builder.h"

#include <string.h>

#include "lists.h"
#include "tetra_builder.h"

struct builder {
    struct node_tetra_builder tetra;
    struct node_lists lists;
    size_t inbox_bytes;
    uint64_t first_us, last_us; /* when lists came */
};

static uint32_t places(const struct node_setup_message *setup) {
    uint32_t lists = setup->jobs_per_worker;
    return lists < 1 ? 1 : lists > INCODE_LISTS_MAX ? INCODE_LISTS_MAX : lists;
}

static size_t builder_arena_min(size_t memory,
                                const struct node_setup_message *setup) {
    (void)memory;
    return node_aligned(sizeof(struct builder)) +
           node_lists_bytes(places(setup)) + node_tetra_builder_min(setup);
}

static bool builder_start(void *self, size_t bytes,
                          const struct node_setup_message *setup,
                          struct node_counted *counted,
                          struct node_fault *fault) {
    struct builder *b = self;
    uint8_t *memory = (uint8_t *)self + node_aligned(sizeof *b);
    size_t inbox = node_lists_bytes(places(setup));
    size_t own = node_aligned(sizeof *b) + inbox;
    if (bytes < own) {
        node_fault_set(fault, "the node's memory does not hold lists", 0, 0);
        return false;
    }
    if (setup->manager >= setup->nodes || setup->manager == counted->self) {
        node_fault_set(fault, "invalid setup: node # builds for face manager #",
                       counted->self, setup->manager);
        return false;
    }
    memset(b, 0, sizeof *b);
    b->inbox_bytes = inbox;
    node_lists_init(&b->lists, memory, places(setup), NODE_ANSWERS,
                    places(setup), counted, fault);
    node_lists_add(&b->lists, setup->manager);
    const struct node_carrier carrier = node_lists_carrier(&b->lists);
    return node_tetra_builder_start(&b->tetra, memory + inbox, bytes - own,
                                    setup, &carrier, counted, fault);
}

static void builder_message(void *self, const struct cube_message *message,
                            uint64_t now_us) {
    struct builder *b = self;
    if (message->type == NODE_LIST) {
        b->first_us = b->first_us == 0 ? now_us : b->first_us;
        b->last_us = now_us;
        node_lists_take(&b->lists, message);
    } else if (message->type == NODE_JOB) {
        node_fault_set(b->tetra.fault, "a job for a node that builds", 0, 0);
    } else if (!node_tetra_builder_message(&b->tetra, message)) {
        node_fault_set(b->tetra.fault, "message of type # for a builder",
                       message->type, 0);
    }
}

static unsigned builder_work(void *self, struct node_pace *pace) {
    struct builder *b = self;
    return node_tetra_builder_work(&b->tetra, pace);
}

static unsigned builder_send(void *self) {
    struct builder *b = self;
    return node_requests_send(&b->tetra.requests);
}

static uint32_t builder_done(const void *self) {
    (void)self;
    return 0; /* there are no jobs */
}

static void builder_end(void *self, uint64_t now_us) {
    (void)self, (void)now_us;
}

static uint32_t builder_awaited(const void *self) {
    const struct builder *b = self;
    return node_tetra_builder_awaited(&b->tetra);
}

static uint32_t builder_held(const void *self) {
    const struct builder *b = self;
    return node_tetra_builder_held(&b->tetra) + node_lists_held(&b->lists);
}

static void builder_totals(const void *self,
                           struct node_finished_message *totals,
                           uint64_t now_us) {
    const struct builder *b = self;
    (void)now_us;
    node_tetra_builder_totals(&b->tetra, totals);
    totals->wall_us = b->last_us - b->first_us;
    totals->bytes_in += b->lists.bytes_in;
    totals->bytes_out += b->lists.bytes_out;
    totals->memory_high_water += node_aligned(sizeof *b) + b->inbox_bytes;
}

static void builder_map(const void *self, struct node_map *map) {
    const struct builder *b = self;
    node_tetra_builder_map(&b->tetra, map);
    map->tables[0].bytes += (uint32_t)node_aligned(sizeof *b);
    map->tables[2].bytes = (uint32_t)b->inbox_bytes;
    map->tables[2].count = b->lists.inbox.slot_count;
}

static void builder_gauge(const void *self, struct incode_gauge *gauge) {
    const struct builder *b = self;
    node_tetra_builder_gauge(&b->tetra, gauge);
}

const struct node_role node_builder_role = {
    .name = "builder",
    .tables = {{"maker, its local points, lists at work", NULL},
               {"page frames", "pages of 1568 bytes"},
               {"lists that wait", "lists"}},
    .arena_min = builder_arena_min,
    .start = builder_start,
    .message = builder_message,
    .work = builder_work,
    .send = builder_send,
    .done = builder_done,
    .end = builder_end,
    .awaited = builder_awaited,
    .held = builder_held,
    .totals = builder_totals,
    .gauge = builder_gauge,
    .map = builder_map,
};
