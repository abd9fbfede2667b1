#include "triangulation.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "node/common.h"
#include "worker.h"

void node_jobs_init(struct node_jobs *jobs, uint32_t bricks,
                    struct node_fault *fault) {
    memset(jobs, 0, sizeof *jobs);
    jobs->bricks = bricks;
    jobs->fault = fault;
}

/* Its bricks are the setup's, its box is one of numbers, if it has points. */
static bool job_is_sound(const struct node_jobs *jobs,
                         const struct node_job_message *job) {
    const struct incode_job *j = &job->job;
    if (j->first > j->last || j->last > jobs->bricks) {
        node_fault_set(jobs->fault, "invalid job: bricks #..#", j->first,
                       j->last);
        return false;
    }
    if (job->epoch == 0) {
        node_fault_set(jobs->fault, "invalid job: epoch 0", 0, 0);
        return false;
    }
    if (job->reserved != 0) {
        node_fault_set(jobs->fault, "invalid job: what is reserved is #",
                       job->reserved, 0);
        return false;
    }
    for (int d = 0; d < 3 && j->first < j->last; d++) {
        if (!__builtin_isfinite(j->lo[d]) || !__builtin_isfinite(j->hi[d]) ||
            j->lo[d] > j->hi[d]) {
            node_fault_set(jobs->fault,
                           "invalid job: the box of bricks #..# is empty or "
                           "infinite",
                           j->first, j->last);
            return false;
        }
    }
    return true;
}

bool node_jobs_take(struct node_jobs *jobs, const struct cube_message *message,
                    uint64_t now_us, struct incode_job *job) {
    struct node_job_message given;
    if (message->size != sizeof given) {
        node_fault_set(jobs->fault, "job in # bytes, expected #", message->size,
                       sizeof given);
        return false;
    }
    memcpy(&given, message->data, sizeof given);
    if (jobs->working) {
        node_fault_set(jobs->fault, "job # before job # is done", given.epoch,
                       jobs->epoch);
        return false;
    }
    if (!job_is_sound(jobs, &given))
        return false;
    jobs->epoch = given.epoch;
    jobs->working = true;
    jobs->start_us = now_us;
    *job = given.job;
    return true;
}

void node_jobs_end(struct node_jobs *jobs, uint64_t now_us) {
    jobs->wall_us += now_us - jobs->start_us;
    jobs->working = false;
}

uint64_t node_jobs_wall_us(const struct node_jobs *jobs, uint64_t now_us) {
    return jobs->wall_us + (jobs->working ? now_us - jobs->start_us : 0);
}

/* --- triangulation -------------------------------------------------------- */

enum { HOLD_US = NODE_PACE_US }; /* that messages wait for others, at most */

size_t node_triangulation_min(size_t memory,
                              const struct node_setup_message *setup) {
    return node_outlet_bytes(memory) + incode_arena_min(&setup->setup);
}

bool node_triangulation_start(struct node_triangulation *t, void *arena,
                              size_t bytes, size_t own,
                              const struct node_setup_message *setup,
                              const struct incode_front_peers *peers,
                              struct node_lending *lending,
                              struct node_counted *counted,
                              struct node_fault *fault) {
    uint8_t *memory = arena;
    size_t before = own + node_outlet_bytes(bytes);
    const char *why = NULL;
    if (bytes < before) {
        node_fault_set(fault, "the node's memory does not hold its outboxes", 0,
                       0);
        return false;
    }
    if (!node_keepers_fit(setup, counted->self, false, fault))
        return false;
    memset(t, 0, sizeof *t);
    t->fault = fault;
    t->before = before;
    t->exchanges = peers->share != NULL;
    node_jobs_init(&t->jobs, setup->setup.bricks, fault);
    node_requests_init(&t->requests, setup, lending, counted, fault);
    node_outlet_init(&t->outlet, memory + own, bytes, setup, counted, fault);
    const struct incode_outside outside = {
        .pages = node_requests_source(&t->requests),
        .front = node_outlet_outside(&t->outlet),
        .peers = *peers,
        .yield = counted->yield};
    t->triangulator = incode_triangulator_init(memory + before, bytes - before,
                                               &setup->setup, &outside, &why);
    if (t->triangulator == NULL)
        node_fault_set(fault, why, 0, 0);
    return t->triangulator != NULL;
}

static void take_job(struct node_triangulation *t,
                     const struct cube_message *message, uint64_t now_us) {
    struct incode_job job;
    if (!node_jobs_take(&t->jobs, message, now_us, &job))
        return;
    node_outlet_begin(&t->outlet, t->jobs.epoch);
    /* A region without points has nothing to be worked on. */
    t->drained = job.first == job.last;
    if (!t->drained)
        incode_triangulator_start(t->triangulator, &job);
}

static void take_page(struct node_triangulation *t,
                      const struct cube_message *message) {
    struct node_page page;
    if (node_requests_take(&t->requests, message, &page)) {
        int status = incode_triangulator_page(t->triangulator, page.number,
                                              page.bytes, page.size);
        if (status == 0)
            *incode_triangulator_label(t->triangulator, page.number) = page.tag;
        node_requests_judge(&t->requests, status, &page);
    } else if (page.number != INCODE_NONE &&
               incode_triangulator_awaits(t->triangulator, page.number)) {
        node_requests_again(&t->requests, page.number, true);
    }
}

static void take_unspill(struct node_triangulation *t, const uint8_t *data,
                         size_t size) {
    struct node_spill_header header;
    struct incode_face faces[NODE_FACES_A_MESSAGE];
    if (node_outlet_take_unspill(&t->outlet, data, size, &header, faces) &&
        incode_triangulator_unspill(t->triangulator, header.brick, faces,
                                    header.count, header.last != 0) != 0)
        node_outlet_refuse_unspill(&t->outlet, header.brick);
}

bool node_triangulation_message(struct node_triangulation *t,
                                const struct cube_message *message,
                                uint64_t now_us) {
    switch (message->type) {
    case NODE_JOB:
        take_job(t, message, now_us);
        return true;
    case NODE_PAGE:
        take_page(t, message);
        break;
    case NODE_UNSPILL:
        take_unspill(t, message->data, message->size);
        break;
    case NODE_CREDIT:
        node_outlet_take_credit(&t->outlet, message->data, message->size);
        break;
    default:
        return false;
    }
    t->bytes_in += message->size;
    return true;
}

bool node_triangulation_step(void *context, uint32_t units, uint32_t *spent) {
    struct node_triangulation *t = context;
    if (!t->jobs.working || t->drained || node_fault_is_set(t->fault) ||
        (!t->exchanges && !node_outlet_has_room(&t->outlet)))
        return false;
    uint64_t before = incode_triangulator_spent(t->triangulator);
    incode_triangulator_allow(t->triangulator, units);
    enum incode_step step = incode_triangulator_step(t->triangulator);
    if (step == INCODE_BROKEN) {
        node_fault_set(t->fault, incode_triangulator_fault(t->triangulator), 0,
                       0);
    }
    t->drained = step == INCODE_FINISHED;
    *spent = (uint32_t)(incode_triangulator_spent(t->triangulator) - before);
    return step == INCODE_WORKED || step == INCODE_FINISHED;
}

void node_triangulation_close(struct node_triangulation *t) {
    if (t->drained)
        node_outlet_close(&t->outlet);
}

static unsigned node_triangulation_work(struct node_triangulation *t,
                                        struct node_pace *pace) {
    unsigned worked = node_pace_work(pace, node_triangulation_step, t);
    node_triangulation_close(t);
    t->worked = worked > 0;
    t->now_us = pace->looked_us;
    return worked;
}

/* Whether what there is to be sent is little, and not all: while the role works
 * on, it waits for more, as each message by itself wakes the host. */
static bool may_wait(struct node_triangulation *t) {
    if (!t->worked || !node_requests_few(&t->requests) ||
        !node_outlet_few(&t->outlet))
        return false;
    if (!t->holds) {
        t->holds = true;
        t->held_us = t->now_us;
    }
    return t->now_us - t->held_us < HOLD_US;
}

unsigned node_triangulation_send(struct node_triangulation *t) {
    if (may_wait(t))
        return 0;
    t->holds = false;
    return node_requests_send(&t->requests) + node_outlet_send(&t->outlet);
}

uint32_t node_triangulation_held(const struct node_triangulation *t) {
    return node_outlet_held(&t->outlet) + node_requests_held(&t->requests);
}

uint32_t node_triangulation_done(const struct node_triangulation *t) {
    return t->jobs.working && t->drained && node_triangulation_held(t) == 0
               ? t->jobs.epoch
               : 0;
}

void node_triangulation_end(struct node_triangulation *t, uint64_t now_us) {
    INCODE_ASSERT(node_triangulation_done(t) != 0);
    node_jobs_end(&t->jobs, now_us);
    t->drained = false;
}

void node_triangulation_totals(const struct node_triangulation *t,
                               struct node_finished_message *totals,
                               uint64_t now_us) {
    totals->wall_us = node_jobs_wall_us(&t->jobs, now_us);
    totals->bytes_in = t->bytes_in;
    totals->bytes_out = t->requests.bytes_out + t->outlet.bytes_out;
    incode_triangulator_statistics(t->triangulator, &totals->statistics);
    totals->memory_high_water =
        t->before + totals->statistics.memory_high_water;
}

void node_triangulation_map(const struct node_triangulation *t,
                            struct node_map *map, unsigned table) {
    const struct incode_map *m = incode_triangulator_map(t->triangulator);
    const size_t bytes[NODE_TRIANGULATION_TABLES][2] = {
        {t->before, 0},
        {m->control, 0},
        {m->afl, m->afl_faces},
        {m->bricks, m->brick_entries},
        {m->frames, m->frame_count}};
    for (unsigned i = 0; i < NODE_TRIANGULATION_TABLES; i++) {
        map->tables[table + i].bytes = (uint32_t)bytes[i][0];
        map->tables[table + i].count = (uint32_t)bytes[i][1];
    }
    map->pages = (uint32_t)m->frame_count;
}

/* --- worker --------------------------------------------------------------- */

struct worker {
    struct node_fault *fault;
    struct node_triangulation triangulation;
};

static size_t worker_arena_min(size_t memory,
                               const struct node_setup_message *setup) {
    return node_aligned(sizeof(struct worker)) +
           node_triangulation_min(memory, setup);
}

static bool worker_start(void *self, size_t bytes,
                         const struct node_setup_message *setup,
                         struct node_counted *counted,
                         struct node_fault *fault) {
    struct worker *w = self;
    const struct incode_front_peers none = {NULL, NULL, NULL};
    if (bytes < sizeof *w) {
        node_fault_set(fault, "the node's memory does not hold its role", 0, 0);
        return false;
    }
    memset(w, 0, sizeof *w);
    w->fault = fault;
    return node_triangulation_start(&w->triangulation, self, bytes,
                                    node_aligned(sizeof *w), setup, &none, NULL,
                                    counted, fault);
}

static void worker_message(void *self, const struct cube_message *message,
                           uint64_t now_us) {
    struct worker *w = self;
    if (!node_triangulation_message(&w->triangulation, message, now_us)) {
        node_fault_set(w->fault, "message of type # for a worker",
                       message->type, 0);
    }
}

static unsigned worker_work(void *self, struct node_pace *pace) {
    struct worker *w = self;
    return node_triangulation_work(&w->triangulation, pace);
}

static unsigned worker_send(void *self) {
    struct worker *w = self;
    return node_triangulation_send(&w->triangulation);
}

static uint32_t worker_awaited(const void *self) {
    const struct worker *w = self;
    return incode_triangulator_awaited(w->triangulation.triangulator);
}

static uint32_t worker_held(const void *self) {
    const struct worker *w = self;
    return node_triangulation_held(&w->triangulation);
}

static uint32_t worker_done(const void *self) {
    const struct worker *w = self;
    return node_triangulation_done(&w->triangulation);
}

static void worker_end(void *self, uint64_t now_us) {
    struct worker *w = self;
    node_triangulation_end(&w->triangulation, now_us);
}

static void worker_totals(const void *self,
                          struct node_finished_message *totals,
                          uint64_t now_us) {
    const struct worker *w = self;
    node_triangulation_totals(&w->triangulation, totals, now_us);
}

static void worker_map(const void *self, struct node_map *map) {
    const struct worker *w = self;
    node_triangulation_map(&w->triangulation, map, 0);
}

static void worker_gauge(const void *self, struct incode_gauge *gauge) {
    const struct worker *w = self;
    incode_triangulator_gauge(w->triangulation.triangulator, gauge);
}

const struct node_role node_worker_role = {
    .name = "worker",
    .tables = {NODE_TRIANGULATION_NAMES},
    .arena_min = worker_arena_min,
    .start = worker_start,
    .message = worker_message,
    .work = worker_work,
    .send = worker_send,
    .done = worker_done,
    .end = worker_end,
    .awaited = worker_awaited,
    .held = worker_held,
    .totals = worker_totals,
    .gauge = worker_gauge,
    .map = worker_map,
};
