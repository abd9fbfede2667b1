#include "manager.h"

#include <string.h>

#include "face_manager.h"
#include "incode/paper/builder.h"
#include "lists.h"

/* Of the arena, for answers that wait. */
enum { INBOX_PART = 8 };

struct manager {
    struct node_face_manager faces;
    struct node_lists lists;
    size_t inbox_bytes;
};

static unsigned count_builders(const struct node_setup_message *setup) {
    unsigned count = 0;
    for (unsigned i = 0; i < NODE_BUILDERS_MAX + 1; i++) {
        count += node_is_builder(setup, i);
    }
    return count;
}

/* A place for each list that builders may have, within the part. */
static uint32_t places(size_t bytes, const struct node_setup_message *setup) {
    uint32_t wanted = count_builders(setup) * setup->jobs_per_worker;
    size_t most = bytes / INBOX_PART / NODE_OUTBOX_BYTES(1);
    uint32_t some = wanted < most ? wanted : (uint32_t)most;
    return some < 2 ? 2 : some;
}

static size_t manager_arena_min(size_t memory,
                                const struct node_setup_message *setup) {
    return node_aligned(sizeof(struct manager)) +
           node_lists_bytes(places(memory, setup)) +
           node_face_manager_min(memory);
}

/* Its builders are other nodes of the cube. */
static bool builders_fit(const struct node_setup_message *setup, unsigned self,
                         struct node_fault *fault) {
    for (unsigned i = 0; i < NODE_BUILDERS_MAX + 1; i++) {
        if (node_is_builder(setup, i) && (i >= setup->nodes || i == self)) {
            node_fault_set(fault,
                           "invalid setup: node # builds for face manager #", i,
                           self);
            return false;
        }
    }
    if (count_builders(setup) == 0) {
        node_fault_set(fault, "invalid setup: face manager # has no builders",
                       self, 0);
        return false;
    }
    if (setup->jobs_per_worker < 1 ||
        setup->jobs_per_worker > INCODE_LISTS_MAX) {
        node_fault_set(fault,
                       "invalid setup: # lists a builder, allowed are 1..#",
                       setup->jobs_per_worker, INCODE_LISTS_MAX);
        return false;
    }
    return true;
}

static bool manager_start(void *self, size_t bytes,
                          const struct node_setup_message *setup,
                          struct node_counted *counted,
                          struct node_fault *fault) {
    struct manager *m = self;
    uint8_t *memory = (uint8_t *)self + node_aligned(sizeof *m);
    if (!builders_fit(setup, counted->self, fault)) {
        return false;
    }
    uint32_t inbox = places(bytes, setup);
    size_t own = node_aligned(sizeof *m) + node_lists_bytes(inbox);
    if (bytes < own) {
        node_fault_set(fault, "the node's memory does not hold answers", 0, 0);
        return false;
    }
    memset(m, 0, sizeof *m);
    m->inbox_bytes = node_lists_bytes(inbox);
    node_lists_init(&m->lists, memory, inbox, NODE_LIST, setup->jobs_per_worker,
                    counted, fault);
    for (unsigned i = 0; i < setup->nodes; i++) {
        if (node_is_builder(setup, i)) {
            node_lists_add(&m->lists, (uint16_t)i);
        }
    }
    const struct node_carrier carrier = node_lists_carrier(&m->lists);
    return node_face_manager_start(&m->faces, memory + m->inbox_bytes,
                                   bytes - own, setup, &carrier, counted,
                                   fault);
}

static void manager_message(void *self, const struct cube_message *message,
                            uint64_t now_us) {
    struct manager *m = self;
    if (message->type == NODE_ANSWERS) {
        node_lists_take(&m->lists, message);
    } else if (!node_face_manager_message(&m->faces, message, now_us)) {
        node_fault_set(m->faces.fault, "message of type # for a face manager",
                       message->type, 0);
    }
}

static unsigned manager_work(void *self, struct node_pace *pace) {
    struct manager *m = self;
    return node_face_manager_work(&m->faces, pace);
}

static unsigned manager_send(void *self) {
    struct manager *m = self;
    return node_outlet_send(&m->faces.outlet);
}

static uint32_t manager_done(const void *self) {
    const struct manager *m = self;
    return node_face_manager_done(&m->faces);
}

static void manager_end(void *self, uint64_t now_us) {
    struct manager *m = self;
    node_face_manager_end(&m->faces, now_us);
}

static uint32_t manager_awaited(const void *self) {
    (void)self;
    return INCODE_NONE; /* it has no pages */
}

static uint32_t manager_owing(const void *self) {
    const struct manager *m = self;
    return node_lists_owing(&m->lists);
}

static uint32_t manager_held(const void *self) {
    const struct manager *m = self;
    return node_face_manager_held(&m->faces) + node_lists_held(&m->lists);
}

static void manager_totals(const void *self,
                           struct node_finished_message *totals,
                           uint64_t now_us) {
    const struct manager *m = self;
    node_face_manager_totals(&m->faces, totals, now_us);
    totals->bytes_in += m->lists.bytes_in;
    totals->bytes_out += m->lists.bytes_out;
    totals->memory_high_water += node_aligned(sizeof *m) + m->inbox_bytes;
}

static void manager_map(const void *self, struct node_map *map) {
    const struct manager *m = self;
    node_face_manager_map(&m->faces, map);
    map->tables[0].bytes += (uint32_t)node_aligned(sizeof *m);
    map->tables[3].bytes = (uint32_t)m->inbox_bytes;
    map->tables[3].count = m->lists.inbox.slot_count;
}

static void manager_gauge(const void *self, struct incode_gauge *gauge) {
    const struct manager *m = self;
    node_face_manager_gauge(&m->faces, gauge);
}

const struct node_role node_manager_role = {
    .name = "manager",
    .tables = {{"results and spilled faces on their way out", NULL},
               {"active face list", "faces"},
               {"open bricks", "entries"},
               {"answers that wait", "lists"}},
    .arena_min = manager_arena_min,
    .start = manager_start,
    .message = manager_message,
    .work = manager_work,
    .send = manager_send,
    .done = manager_done,
    .end = manager_end,
    .awaited = manager_awaited,
    .owing = manager_owing,
    .held = manager_held,
    .totals = manager_totals,
    .gauge = manager_gauge,
    .map = manager_map,
};
