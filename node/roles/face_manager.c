#include "face_manager.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "node/arena.h"

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
    if (!is_sound(setup, fault)) {
        return false;
    }
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
                        &setup->setup, &outside, &counted->pause);
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
                               header.last != 0) != 0) {
        node_outlet_refuse_unspill(&f->outlet, header.brick);
    }
}

bool node_face_manager_message(struct node_face_manager *f,
                               const struct cube_message *message,
                               uint64_t now_us) {
    if (message->type == NODE_JOB) {
        take_job(f, message, now_us);
        return true;
    }
    if (message->type != NODE_UNSPILL && message->type != NODE_CREDIT) {
        return false;
    }
    f->bytes_in += message->size;
    if (message->type == NODE_UNSPILL) {
        take_unspill(f, message);
    } else {
        node_outlet_take_credit(&f->outlet, message->data, message->size);
    }
    return true;
}

/* ---- work ---- */

static bool take_answers(struct node_face_manager *f) {
    struct incode_answers answers;
    size_t size;
    const void *data;
    if (!incode_manager_is_free(&f->manager) ||
        (data = f->carrier.first(f->carrier.context, &size)) == NULL) {
        return false;
    }
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
        !node_outlet_has_room(&f->outlet)) {
        return false;
    }
    bool moved = take_answers(f);
    enum incode_step step = incode_manager_step(&f->manager, units);
    moved = lend(f) || moved;
    if (step == INCODE_BROKEN) {
        node_fault_set(f->fault, incode_manager_fault(&f->manager), 0, 0);
    }
    f->drained = step == INCODE_FINISHED;
    *spent = (uint32_t)(f->manager.spent - before);
    return moved || step == INCODE_WORKED || f->drained;
}

unsigned node_face_manager_work(struct node_face_manager *f,
                                struct node_pace *pace) {
    unsigned worked = node_pace_work(pace, work_on, f);
    if (f->drained) {
        node_outlet_close(&f->outlet);
    }
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
