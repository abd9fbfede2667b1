#include "face_manager.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "node/common.h"
#include "manager.h"
#include "incode/paper/builder.h"
#include "lists.h"

enum { LENT = 8 /* lists a step, at most */ };

size_t node_face_manager_min(size_t memory) {
    return node_outlet_bytes(memory) + incode_manager_min();
}

/* What the setup asks of a front alone. */
static bool is_sound(const struct node_setup_message *setup,
                     struct node_fault *fault) {
    const char *why = incode_setup_fault(&setup->setup);
    if (why == NULL && setup->setup.face_rule != INCODE_FACE_OWN) {
        why = "invalid setup: the face rule `paper` asks a face manager for "
              "points, which it has not";
    }
    if (why != NULL) {
        node_fault_set(fault, why, 0, 0);
        return false;
    }
    if (setup->faces_per_job < 1 || setup->faces_per_job > INCODE_LIST_MAX) {
        node_fault_set(fault, "invalid setup: # faces a list, allowed are 1..#",
                       setup->faces_per_job, INCODE_LIST_MAX);
        return false;
    }
    return true;
}

bool node_face_manager_start(struct node_face_manager *f, void *memory,
                             size_t bytes,
                             const struct node_setup_message *setup,
                             const struct node_carrier *carrier,
                             struct node_counted *counted,
                             struct node_fault *fault) {
    size_t boxes = node_outlet_bytes(bytes);
    if (!is_sound(setup, fault))
        return false;
    if (bytes < boxes + incode_manager_min()) {
        node_fault_set(fault, "the node's memory does not hold a list of faces",
                       0, 0);
        return false;
    }
    memset(f, 0, sizeof *f);
    f->fault = fault;
    f->carrier = *carrier;
    f->faces_per_job = setup->faces_per_job;
    f->nodes = setup->nodes;
    f->outlet_bytes = boxes;
    node_jobs_init(&f->jobs, setup->setup.bricks, fault);
    node_outlet_init(&f->outlet, memory, bytes, setup, counted, fault);
    const struct incode_front_outside outside = node_outlet_outside(&f->outlet);
    incode_manager_init(&f->manager, (uint8_t *)memory + boxes, bytes - boxes,
                        &setup->setup, &outside, &counted->yield);
    return true;
}

static void take_job(struct node_face_manager *f,
                     const struct cube_message *message, uint64_t now_us) {
    struct incode_job job;
    if (node_jobs_take(&f->jobs, message, now_us, &job)) {
        node_outlet_begin(&f->outlet, f->jobs.epoch);
        incode_manager_start(&f->manager, &job);
    }
}

static void take_unspill(struct node_face_manager *f,
                         const struct cube_message *message) {
    struct node_spill_header header;
    struct incode_face faces[NODE_FACES_A_MESSAGE];
    if (node_outlet_take_unspill(&f->outlet, message->data, message->size,
                                 &header, faces) &&
        incode_manager_unspill(&f->manager, header.brick, faces, header.count,
                               header.last != 0) != 0)
        node_outlet_refuse_unspill(&f->outlet, header.brick);
}

bool node_face_manager_message(struct node_face_manager *f,
                               const struct cube_message *message,
                               uint64_t now_us) {
    if (message->type == NODE_JOB) {
        take_job(f, message, now_us);
        return true;
    }
    if (message->type != NODE_UNSPILL && message->type != NODE_CREDIT)
        return false;
    f->bytes_in += message->size;
    if (message->type == NODE_UNSPILL)
        take_unspill(f, message);
    else
        node_outlet_take_credit(&f->outlet, message->data, message->size);
    return true;
}

/* ---- work ---- */

static bool take_answers(struct node_face_manager *f) {
    struct incode_answers answers;
    size_t size;
    const void *data;
    if (!incode_manager_is_free(&f->manager) ||
        (data = f->carrier.first(f->carrier.context, &size)) == NULL)
        return false;
    bool fits =
        size >= offsetof(struct incode_answers, v) && size <= sizeof answers;
    answers.count = 0;
    memcpy(&answers, data, fits ? size : 0);
    f->carrier.drop(f->carrier.context);
    if (!fits || size != incode_answers_bytes(answers.count)) {
        node_fault_set(f->fault, "# answers in # bytes", answers.count,
                       (uint32_t)size);
        return false;
    }
    if (answers.builder >= f->nodes) {
        node_fault_set(f->fault, "answers of builder #, of # nodes",
                       answers.builder, f->nodes);
        return false;
    }
    /* All that the front emits follows from the answers that it has. */
    node_outlet_found_by(&f->outlet, answers.builder);
    incode_manager_take(&f->manager, &answers);
    return true;
}

static bool lend(struct node_face_manager *f) {
    struct incode_list list;
    unsigned lent = 0;
    while (lent < LENT && f->carrier.has_room(f->carrier.context) &&
           incode_manager_lend(&f->manager, f->faces_per_job, &list) > 0) {
        f->carrier.send(f->carrier.context, &list,
                        incode_list_bytes(list.count));
        lent++;
    }
    return lent > 0;
}

static bool work_on(void *context, uint32_t units, uint32_t *spent) {
    struct node_face_manager *f = context;
    uint64_t before = f->manager.spent;
    if (!f->jobs.working || f->drained || node_fault_is_set(f->fault) ||
        !node_outlet_has_room(&f->outlet))
        return false;
    bool moved = take_answers(f);
    enum incode_step step = incode_manager_step(&f->manager, units);
    moved = lend(f) || moved;
    if (step == INCODE_BROKEN)
        node_fault_set(f->fault, incode_manager_fault(&f->manager), 0, 0);
    f->drained = step == INCODE_FINISHED;
    *spent = (uint32_t)(f->manager.spent - before);
    return moved || step == INCODE_WORKED || f->drained;
}

unsigned node_face_manager_work(struct node_face_manager *f,
                                struct node_pace *pace) {
    unsigned worked = node_pace_work(pace, work_on, f);
    if (f->drained)
        node_outlet_close(&f->outlet);
    return worked;
}

uint32_t node_face_manager_held(const struct node_face_manager *f) {
    return node_outlet_held(&f->outlet) + f->manager.lists +
           !incode_manager_is_free(&f->manager);
}

uint32_t node_face_manager_done(const struct node_face_manager *f) {
    return f->jobs.working && f->drained && node_face_manager_held(f) == 0
               ? f->jobs.epoch
               : 0;
}

void node_face_manager_end(struct node_face_manager *f, uint64_t now_us) {
    INCODE_ASSERT(node_face_manager_done(f) != 0);
    node_jobs_end(&f->jobs, now_us);
    f->drained = false;
}

void node_face_manager_totals(const struct node_face_manager *f,
                              struct node_finished_message *totals,
                              uint64_t now_us) {
    totals->wall_us = node_jobs_wall_us(&f->jobs, now_us);
    totals->bytes_in = f->bytes_in;
    totals->bytes_out = f->outlet.bytes_out;
    incode_manager_statistics(&f->manager, &totals->statistics);
    totals->memory_high_water =
        f->outlet_bytes + totals->statistics.memory_high_water;
}

void node_face_manager_gauge(const struct node_face_manager *f,
                             struct incode_gauge *gauge) {
    gauge->faces = f->manager.front.afl.capacity;
    gauge->open = f->manager.front.afl.count;
}

void node_face_manager_map(const struct node_face_manager *f,
                           struct node_map *map) {
    const struct incode_afl *afl = &f->manager.front.afl;
    const uint32_t touched =
        afl->touched_capacity *
        (uint32_t)(sizeof(struct incode_touched) + sizeof(uint32_t));
    map->tables[0].bytes = (uint32_t)f->outlet_bytes;
    map->tables[1].bytes = (uint32_t)f->manager.bytes - touched;
    map->tables[1].count = afl->capacity;
    map->tables[2].bytes = touched;
    map->tables[2].count = afl->touched_capacity;
}

/* --- manager -------------------------------------------------------------- */

/* Of the arena, for answers that wait. */
enum { INBOX_PART = 8 };

struct manager {
    struct node_face_manager faces;
    struct node_lists lists;
    size_t inbox_bytes;
};

static unsigned count_builders(const struct node_setup_message *setup) {
    unsigned count = 0;
    for (unsigned i = 0; i < NODE_BUILDERS_MAX + 1; i++)
        count += node_is_builder(setup, i);
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
    if (!builders_fit(setup, counted->self, fault))
        return false;
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
    for (unsigned i = 0; i < setup->nodes; i++)
        if (node_is_builder(setup, i))
            node_lists_add(&m->lists, (uint16_t)i);
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
