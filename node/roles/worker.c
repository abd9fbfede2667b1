#include "worker.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "node/keepers.h"
#include "node/outbox.h"
#include "node/result.h"

enum {
    HEADER_BYTES = sizeof(struct node_result_header),
    BATCH_BYTES = CUBE_PAYLOAD_MAX - HEADER_BYTES,
    /* Tetrahedra that a batch takes however they come, a star each. */
    BATCH_TETRAHEDRA =
        BATCH_BYTES / (NODE_RESULT_STAR_MAX + NODE_RESULT_TETRAHEDRON_MAX),
    /* Batches kept back for commits, and for stars cut by a batch's end. */
    BATCHES_RESERVED = 2
};

struct worker {
    struct node_counted *counted;
    struct node_fault *fault;
    struct incode_triangulator *triangulator;
    uint32_t bricks, holders; /* as in the setup */
    uint32_t epoch;           /* of the job */
    bool working;             /* a job is open */
    bool drained;      /* the triangulator is done, results still leave */
    uint64_t start_us; /* of the job */
    uint64_t wall_us;  /* of the jobs before */
    uint32_t wanted[NODE_WANTED_MAX];
    uint32_t wanted_count, in_flight;
    struct node_outbox results; /* leave under credit */
    uint32_t credit, sent;      /* results allowed, results sent */
    struct node_result_writer writer;
    bool open;                 /* writer fills a slot of results */
    struct node_outbox spills; /* leave as the link takes them */
    uint32_t spill_count;      /* faces in the open message of spills */
    size_t outbox_bytes;
    uint64_t bytes_in, bytes_out;
};

static unsigned worker_send(void *self);
static void send_wanted(struct worker *w);

static bool outside_request(void *context, uint32_t page)
{
    struct worker *w = context;
    if (w->wanted_count == NODE_WANTED_MAX) {
        send_wanted(w);
    }
    if (w->wanted_count == NODE_WANTED_MAX ||
        w->wanted_count + w->in_flight >= NODE_PAGES_IN_FLIGHT_MAX) {
        return false;
    }
    w->wanted[w->wanted_count++] = page;
    return true;
}

static size_t outside_emit_room(void *context)
{
    const struct worker *w = context;
    uint32_t batches = node_outbox_free(&w->results);
    return batches <= BATCHES_RESERVED
               ? 0
               : (size_t)(batches - BATCHES_RESERVED) * BATCH_TETRAHEDRA;
}

static void open_batch(struct worker *w)
{
    uint8_t *data = node_outbox_open(&w->results);
    struct node_result_header header = {w->epoch, 0};
    memcpy(data, &header, sizeof header);
    node_result_begin(&w->writer, data + HEADER_BYTES, BATCH_BYTES);
    w->open = true;
}

static void close_batch(struct worker *w)
{
    if (w->open) {
        node_outbox_close(&w->results, NODE_RESULT,
                          HEADER_BYTES + w->writer.size);
        w->open = false;
    }
}

/* The outbox is full although the triangulator was told how much it takes. */
static bool overrun(struct worker *w)
{
    if (!w->open && node_outbox_free(&w->results) == 0) {
        node_fault_set(w->fault, "more results than # messages hold",
                       w->results.slot_count, 0);
    }
    return node_fault_is_set(w->fault);
}

static void outside_emit(void *context, uint32_t vertex,
                         const uint32_t (*apexes)[3], size_t count)
{
    struct worker *w = context;
    while (count > 0 && !overrun(w)) {
        if (!w->open) {
            open_batch(w);
        }
        size_t written = node_result_star(&w->writer, vertex, apexes, count);
        if (written < count) {
            close_batch(w);
        }
        apexes += written;
        count -= written;
    }
}

static void outside_commit(void *context, uint32_t brick)
{
    struct worker *w = context;
    while (!overrun(w)) {
        if (!w->open) {
            open_batch(w);
        }
        if (node_result_commit(&w->writer, brick)) {
            return;
        }
        close_batch(w);
    }
}

static void close_spill(struct worker *w)
{
    if (w->spill_count > 0) {
        struct node_spill_header header = {w->epoch, 0, w->spill_count, 0, 0};
        memcpy(node_outbox_open(&w->spills), &header, sizeof header);
        node_outbox_close(&w->spills, NODE_SPILL,
                          sizeof header +
                              w->spill_count * sizeof(struct incode_face));
        w->spill_count = 0;
    }
}

/* Faces that the outbox takes now, the open message's included. */
static size_t spill_room(const struct worker *w)
{
    return (size_t)node_outbox_free(&w->spills) * NODE_FACES_A_MESSAGE -
           w->spill_count;
}

/* Faces come in small numbers: they wait in one message until it is full or
 * the link has nothing else to do. */
static bool outside_spill(void *context, const struct incode_face *faces,
                          size_t count)
{
    struct worker *w = context;
    if (spill_room(w) < count) {
        (void)worker_send(w);
    }
    if (spill_room(w) < count) {
        return false;
    }
    for (size_t i = 0; i < count; i++) {
        uint8_t *data = node_outbox_open(&w->spills);
        memcpy(data + sizeof(struct node_spill_header) +
                   w->spill_count * sizeof *faces,
               &faces[i], sizeof *faces);
        if (++w->spill_count == NODE_FACES_A_MESSAGE) {
            close_spill(w);
        }
    }
    return true;
}

static bool outside_unspill(void *context, uint32_t brick)
{
    struct worker *w = context;
    if (node_outbox_free(&w->spills) < 2) {
        return false;
    }
    close_spill(w); /* what was spilled before is part of the list */
    struct node_spill_header header = {w->epoch, brick, 0, 0, 0};
    memcpy(node_outbox_open(&w->spills), &header, sizeof header);
    node_outbox_close(&w->spills, NODE_UNSPILL_REQUEST, sizeof header);
    return true;
}

/* One slot for each 64 KiB of memory, within bounds. */
static uint32_t slots(size_t bytes, uint32_t min, uint32_t max)
{
    size_t count = bytes / 65536;
    return count < min ? min : count > max ? max : (uint32_t)count;
}

static uint32_t result_slots(size_t bytes)
{
    return slots(bytes, NODE_RESULT_SLOTS_MIN, NODE_RESULT_SLOTS_MAX);
}

static uint32_t spill_slots(size_t bytes)
{
    return slots(bytes, NODE_SPILL_SLOTS_MIN, NODE_SPILL_SLOTS_MAX);
}

static size_t outbox_bytes(size_t bytes)
{
    return node_aligned(
        NODE_OUTBOX_BYTES(result_slots(bytes) + spill_slots(bytes)));
}

static size_t worker_arena_min(size_t memory,
                               const struct node_setup_message *setup)
{
    return node_aligned(sizeof(struct worker)) + outbox_bytes(memory) +
           incode_arena_min(&setup->setup);
}

static bool worker_start(void *self, size_t bytes,
                         const struct node_setup_message *setup,
                         struct node_counted *counted, struct node_fault *fault)
{
    struct worker *w = self;
    const struct incode_outside outside = {
        .pages = {w, outside_request},
        .front = {w, outside_emit_room, outside_emit, outside_commit,
                  outside_spill, outside_unspill}};
    uint8_t *memory = self;
    size_t own = node_aligned(sizeof *w), boxes = outbox_bytes(bytes);
    const char *why = NULL;
    if (bytes < own + boxes) {
        node_fault_set(fault, "the node's memory does not hold its outboxes", 0,
                       0);
        return false;
    }
    if (!node_keepers_fit(setup, counted->self, false, fault)) {
        return false;
    }
    memset(w, 0, sizeof *w);
    w->counted = counted;
    w->fault = fault;
    w->bricks = setup->setup.bricks;
    w->holders = setup->holders;
    w->credit = setup->credits;
    w->outbox_bytes = boxes;
    uint32_t results = result_slots(bytes);
    node_outbox_init(&w->results, memory + own, results);
    node_outbox_init(&w->spills, memory + own + NODE_OUTBOX_BYTES(results),
                     spill_slots(bytes));
    w->triangulator =
        incode_triangulator_init(memory + own + boxes, bytes - own - boxes,
                                 &setup->setup, &outside, &why);
    if (w->triangulator == NULL) {
        node_fault_set(fault, why, 0, 0);
    }
    return w->triangulator != NULL;
}

/* Its bricks are the setup's, its box is one of numbers, if it has points. */
static bool job_is_sound(const struct worker *w,
                         const struct node_job_message *job)
{
    const struct incode_job *j = &job->job;
    if (j->first > j->last || j->last > w->bricks) {
        node_fault_set(w->fault, "invalid job: bricks #..#", j->first, j->last);
        return false;
    }
    if (job->epoch == 0) {
        node_fault_set(w->fault, "invalid job: epoch 0", 0, 0);
        return false;
    }
    if (job->reserved != 0) {
        node_fault_set(w->fault, "invalid job: what is reserved is #",
                       job->reserved, 0);
        return false;
    }
    for (int d = 0; d < 3 && j->first < j->last; d++) {
        if (!__builtin_isfinite(j->lo[d]) || !__builtin_isfinite(j->hi[d]) ||
            j->lo[d] > j->hi[d]) {
            node_fault_set(w->fault,
                           "invalid job: the box of bricks #..# is empty or "
                           "infinite",
                           j->first, j->last);
            return false;
        }
    }
    return true;
}

static void take_job(struct worker *w, const struct cube_message *message,
                     uint64_t now_us)
{
    struct node_job_message job;
    if (message->size != sizeof job) {
        node_fault_set(w->fault, "job in # bytes, expected #", message->size,
                       sizeof job);
        return;
    }
    memcpy(&job, message->data, sizeof job);
    if (w->working) {
        node_fault_set(w->fault, "job # before job # is done", job.epoch,
                       w->epoch);
        return;
    }
    if (!job_is_sound(w, &job)) {
        return;
    }
    w->epoch = job.epoch;
    w->working = true;
    w->start_us = now_us;
    /* A region without points has nothing to be worked on. */
    w->drained = job.job.first == job.job.last;
    if (!w->drained) {
        incode_triangulator_start(w->triangulator, &job.job);
    }
}

static void take_page(struct worker *w, const uint8_t *data, size_t size)
{
    uint32_t page;
    if (size < sizeof page) {
        node_fault_set(w->fault, "page in # bytes, expected # at least",
                       (uint32_t)size, sizeof page);
        return;
    }
    memcpy(&page, data, sizeof page);
    if (w->in_flight == 0) {
        node_fault_set(w->fault, "page # was not requested", page, 0);
        return;
    }
    w->in_flight--;
    int status = incode_triangulator_page(
        w->triangulator, page, data + sizeof page, size - sizeof page);
    if (status != 0) {
        node_fault_set(w->fault,
                       status == INCODE_PAGE_UNSOUND
                           ? "content of page # in # bytes is out of its limits"
                           : "page # of # bytes was not requested",
                       page, (uint32_t)(size - sizeof page));
    }
}

static void take_unspill(struct worker *w, const uint8_t *data, size_t size)
{
    struct node_spill_header header;
    struct incode_face faces[NODE_FACES_A_MESSAGE];
    if (size < sizeof header) {
        node_fault_set(w->fault, "spilled faces in # bytes, header takes #",
                       (uint32_t)size, sizeof header);
        return;
    }
    memcpy(&header, data, sizeof header);
    if (header.count > NODE_FACES_A_MESSAGE ||
        size != sizeof header + header.count * sizeof faces[0]) {
        node_fault_set(w->fault, "# spilled faces in # bytes", header.count,
                       (uint32_t)size);
        return;
    }
    if (header.epoch != w->epoch || header.sent != w->counted->received) {
        return;
    }
    memcpy(faces, data + sizeof header, header.count * sizeof faces[0]);
    if (incode_triangulator_unspill(w->triangulator, header.brick, faces,
                                    header.count, header.last != 0) != 0) {
        node_fault_set(w->fault,
                       "spilled faces of brick # not requested, or none of it",
                       header.brick, 0);
    }
}

static void take_credit(struct worker *w, const uint8_t *data, size_t size)
{
    if (size != sizeof w->credit) {
        node_fault_set(w->fault, "credit in # bytes, expected #",
                       (uint32_t)size, sizeof w->credit);
        return;
    }
    uint32_t credit;
    memcpy(&credit, data, sizeof credit);
    if ((int32_t)(credit - w->credit) < 0) {
        node_fault_set(w->fault, "credit # after credit #", credit, w->credit);
        return;
    }
    w->credit = credit;
}

static void worker_message(void *self, const struct cube_message *message,
                           uint64_t now_us)
{
    struct worker *w = self;
    if (message->type == NODE_JOB) {
        take_job(w, message, now_us);
        return;
    }
    w->bytes_in += message->size;
    if (message->type == NODE_PAGE) {
        take_page(w, message->data, message->size);
    } else if (message->type == NODE_UNSPILL) {
        take_unspill(w, message->data, message->size);
    } else if (message->type == NODE_CREDIT) {
        take_credit(w, message->data, message->size);
    } else {
        node_fault_set(w->fault, "message of type # for a worker",
                       message->type, 0);
    }
}

/* One step of at most so many units; false: there is nothing to do. */
static bool work_on(struct worker *w, uint32_t units)
{
    incode_triangulator_allow(w->triangulator, units);
    enum incode_step step = incode_triangulator_step(w->triangulator);
    if (step == INCODE_BROKEN) {
        node_fault_set(w->fault, incode_triangulator_fault(w->triangulator), 0,
                       0);
    }
    w->drained = step == INCODE_FINISHED;
    return step == INCODE_WORKED || step == INCODE_FINISHED;
}

static unsigned worker_work(void *self, struct node_pace *pace)
{
    struct worker *w = self;
    unsigned worked = 0;
    uint32_t units = 0; /* since the last look at the clock */
    bool goes_on = w->working;
    while (goes_on && !w->drained && worked < NODE_STEPS &&
           !node_fault_is_set(w->fault) &&
           node_outbox_free(&w->results) > BATCHES_RESERVED) {
        uint64_t before = incode_triangulator_spent(w->triangulator);
        goes_on = work_on(w, pace->units);
        worked += goes_on;
        units +=
            (uint32_t)(incode_triangulator_spent(w->triangulator) - before);
        if (goes_on && node_pace_is_due(pace, units)) {
            goes_on = node_pace_goes_on(pace, units);
            units = 0;
        }
    }
    if (units > 0) {
        node_pace_end(pace, units);
    }
    if (w->drained) {
        close_batch(w);
    }
    return worked;
}

/* Sends for wanted pages, one message for each node that has some. */
static void send_wanted(struct worker *w)
{
    while (w->wanted_count > 0) {
        uint32_t batch[NODE_PAGES_A_REQUEST];
        uint32_t count = 0, left = 0;
        uint16_t to = node_keeper(w->wanted[0], w->holders);
        if (cube_room(w->counted->cube, to) == 0) {
            return;
        }
        for (uint32_t i = 0; i < w->wanted_count; i++) {
            if (count < NODE_PAGES_A_REQUEST &&
                node_keeper(w->wanted[i], w->holders) == to) {
                batch[count++] = w->wanted[i];
            } else {
                w->wanted[left++] = w->wanted[i];
            }
        }
        w->wanted_count = left;
        w->in_flight += count;
        INCODE_ASSERT(node_counted_write(w->counted, to, NODE_PAGE_REQUEST,
                                         batch, count * sizeof batch[0]) == 0);
        w->bytes_out += count * sizeof batch[0];
    }
}

/* Sends the first message of an outbox; false where the link has no room. */
static bool send_first(struct worker *w, struct node_outbox *box)
{
    struct node_outbox_slot *slot = node_outbox_first(box);
    if (slot == NULL) {
        return false;
    }
    if (slot->type != NODE_SPILL) {
        size_t at = slot->type == NODE_RESULT
                        ? offsetof(struct node_result_header, sent)
                        : offsetof(struct node_spill_header, sent);
        memcpy(slot->data + at, &w->counted->sent, sizeof w->counted->sent);
    }
    if (node_counted_write(w->counted, CUBE_HOST, slot->type, slot->data,
                           slot->size) != 0) {
        return false;
    }
    w->bytes_out += slot->size;
    node_outbox_drop(box);
    return true;
}

static unsigned worker_send(void *self)
{
    struct worker *w = self;
    unsigned sent = w->wanted_count;
    send_wanted(w);
    sent -= w->wanted_count;
    if (w->spills.used == 0) {
        close_spill(w);
    }
    while (send_first(w, &w->spills)) {
        sent++;
    }
    while ((int32_t)(w->credit - w->sent) > 0 && send_first(w, &w->results)) {
        w->sent++;
        sent++;
    }
    return sent;
}

static uint32_t worker_awaited(const void *self)
{
    const struct worker *w = self;
    return incode_triangulator_awaited(w->triangulator);
}

static uint32_t worker_held(const void *self)
{
    const struct worker *w = self;
    return w->open + w->results.used + w->spills.used + w->spill_count +
           w->wanted_count + w->in_flight;
}

static uint32_t worker_done(const void *self)
{
    const struct worker *w = self;
    return w->working && w->drained && worker_held(w) == 0 ? w->epoch : 0;
}

static void worker_end(void *self, uint64_t now_us)
{
    struct worker *w = self;
    INCODE_ASSERT(worker_done(w) != 0);
    w->wall_us += now_us - w->start_us;
    w->working = false;
    w->drained = false;
}

static void worker_totals(const void *self,
                          struct node_finished_message *totals, uint64_t now_us)
{
    const struct worker *w = self;
    totals->wall_us = w->wall_us;
    if (w->working) {
        totals->wall_us += now_us - w->start_us;
    }
    totals->bytes_in = w->bytes_in;
    totals->bytes_out = w->bytes_out;
    incode_triangulator_statistics(w->triangulator, &totals->statistics);
    totals->memory_high_water = node_aligned(sizeof *w) + w->outbox_bytes +
                                totals->statistics.memory_high_water;
}

static void worker_map(const void *self, struct node_map *map)
{
    const struct worker *w = self;
    const struct incode_map *t = incode_triangulator_map(w->triangulator);
    const size_t bytes[][2] = {{node_aligned(sizeof *w) + w->outbox_bytes, 0},
                               {t->control, 0},
                               {t->afl, t->afl_faces},
                               {t->bricks, t->brick_entries},
                               {t->frames, t->frame_count}};
    static_assert(sizeof bytes / sizeof bytes[0] <= NODE_TABLES_MAX,
                  "tables of a worker");
    for (unsigned i = 0; i < sizeof bytes / sizeof bytes[0]; i++) {
        map->tables[i].bytes = (uint32_t)bytes[i][0];
        map->tables[i].count = (uint32_t)bytes[i][1];
    }
    map->pages = (uint32_t)t->frame_count;
}

const struct node_role node_worker_role = {
    .name = "worker",
    .tables = {{"results and spilled faces on their way out", NULL},
               {"triangulator, its local points and tasks", NULL},
               {"active face list", "faces"},
               {"open bricks", "entries"},
               {"page frames", "pages of 1568 bytes"}},
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
    .map = worker_map,
};
