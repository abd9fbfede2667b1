#include "worker.h"

#include <string.h>

#include "incode/predicates/check.h"

enum {
    HEADER_BYTES = sizeof(struct node_result_header),
    BATCH_BYTES = CUBE_PAYLOAD_MAX - HEADER_BYTES,
    /* Tetrahedra that a batch takes however they come, a star each. */
    BATCH_TETRAHEDRA =
        BATCH_BYTES / (NODE_RESULT_STAR_MAX + NODE_RESULT_TETRAHEDRON_MAX),
    /* Batches kept back for commits, and for stars cut by a batch's end. */
    BATCHES_RESERVED = 2
};

static void send_wanted(struct node_worker *w);

static bool port_request(void *context, uint32_t page)
{
    struct node_worker *w = context;
    if (w->wanted_count == NODE_WANTED_MAX) {
        send_wanted(w);
    }
    if (w->wanted_count == NODE_WANTED_MAX ||
        w->wanted_count + w->in_flight >= NODE_IN_FLIGHT_MAX) {
        return false;
    }
    w->wanted[w->wanted_count++] = page;
    return true;
}

static size_t port_emit_room(void *context)
{
    const struct node_worker *w = context;
    uint32_t batches = node_outbox_free(&w->results);
    return batches <= BATCHES_RESERVED
               ? 0
               : (size_t)(batches - BATCHES_RESERVED) * BATCH_TETRAHEDRA;
}

static void open_batch(struct node_worker *w)
{
    uint8_t *data = node_outbox_open(&w->results);
    struct node_result_header header = {w->epoch, 0};
    memcpy(data, &header, sizeof header);
    node_result_begin(&w->writer, data + HEADER_BYTES, BATCH_BYTES);
    w->open = true;
}

static void close_batch(struct node_worker *w)
{
    if (w->open) {
        node_outbox_close(&w->results, NODE_RESULT,
                          HEADER_BYTES + w->writer.size);
        w->open = false;
    }
}

/* The outbox is full although the triangulator was told how much it takes. */
static bool overrun(struct node_worker *w)
{
    if (!w->open && node_outbox_free(&w->results) == 0) {
        w->fault = "more results than were agreed";
    }
    return w->fault != NULL;
}

static void port_emit(void *context, uint32_t vertex,
                      const uint32_t (*apexes)[3], size_t count)
{
    struct node_worker *w = context;
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

static void port_commit(void *context, uint32_t brick)
{
    struct node_worker *w = context;
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

static void close_spill(struct node_worker *w)
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
static size_t spill_room(const struct node_worker *w)
{
    return (size_t)node_outbox_free(&w->spills) * NODE_FACES_A_MESSAGE -
           w->spill_count;
}

/* Faces come in small numbers: they gather in one message until it is full or
 * the link has nothing else to do. */
static bool port_spill(void *context, const struct incode_face *faces,
                       size_t count)
{
    struct node_worker *w = context;
    if (spill_room(w) < count) {
        (void)node_worker_send(w);
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

static bool port_unspill(void *context, uint32_t brick)
{
    struct node_worker *w = context;
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

size_t node_worker_outbox_bytes(size_t memory)
{
    uint32_t results =
        slots(memory, NODE_RESULT_SLOTS_MIN, NODE_RESULT_SLOTS_MAX);
    uint32_t spills = slots(memory, NODE_SPILL_SLOTS_MIN, NODE_SPILL_SLOTS_MAX);
    return (NODE_OUTBOX_BYTES(results + spills) + 63) / 64 * 64;
}

int node_worker_start(struct node_worker *worker, void *arena, size_t bytes,
                      struct node_counted *counted,
                      const struct node_setup_message *setup, const char **why)
{
    const struct incode_outside outside = {
        worker,      port_request, port_emit_room, port_emit,
        port_commit, port_spill,   port_unspill};
    uint32_t results =
        slots(bytes, NODE_RESULT_SLOTS_MIN, NODE_RESULT_SLOTS_MAX);
    uint32_t spills = slots(bytes, NODE_SPILL_SLOTS_MIN, NODE_SPILL_SLOTS_MAX);
    size_t boxes = (NODE_OUTBOX_BYTES(results + spills) + 63) / 64 * 64;
    uint8_t *memory = arena;
    memset(worker, 0, sizeof *worker);
    if (bytes < boxes) {
        *why = "the node's memory does not hold its outboxes";
        return -1;
    }
    worker->counted = counted;
    worker->setup = *setup;
    worker->credit = setup->credits;
    worker->outbox_bytes = (uint32_t)boxes;
    node_outbox_init(&worker->results, memory, results);
    node_outbox_init(&worker->spills, memory + NODE_OUTBOX_BYTES(results),
                     spills);
    worker->triangulator = incode_triangulator_init(
        memory + boxes, bytes - boxes, &setup->setup, &outside, why);
    return worker->triangulator == NULL ? -1 : 0;
}

void node_worker_job(struct node_worker *worker,
                     const struct node_job_message *job, uint64_t now_us)
{
    if (worker->working) {
        worker->fault = "a second job before the first was done";
        return;
    }
    worker->epoch = job->epoch;
    worker->working = true;
    worker->start_us = now_us;
    /* A region without points has nothing to be worked on. */
    worker->drained = job->job.first >= job->job.last;
    if (!worker->drained) {
        incode_triangulator_start(worker->triangulator, &job->job);
    }
}

static void take_page(struct node_worker *w, const uint8_t *data, size_t size)
{
    uint32_t page;
    if (size < sizeof page || w->in_flight == 0) {
        w->fault = "a page that was not asked for";
        return;
    }
    memcpy(&page, data, sizeof page);
    w->in_flight--;
    if (incode_triangulator_page(w->triangulator, page, data + sizeof page,
                                 size - sizeof page) != 0) {
        w->fault = "a page that was not asked for, or of a wrong size";
    }
}

static void take_unspill(struct node_worker *w, const uint8_t *data,
                         size_t size)
{
    struct node_spill_header header;
    struct incode_face faces[NODE_FACES_A_MESSAGE];
    if (size < sizeof header) {
        w->fault = "a spilled list without a header";
        return;
    }
    memcpy(&header, data, sizeof header);
    if (header.count > NODE_FACES_A_MESSAGE ||
        size != sizeof header + header.count * sizeof faces[0]) {
        w->fault = "a spilled list of a wrong size";
        return;
    }
    if (header.epoch != w->epoch || header.sent != w->counted->received) {
        return;
    }
    memcpy(faces, data + sizeof header, header.count * sizeof faces[0]);
    if (incode_triangulator_unspill(w->triangulator, header.brick, faces,
                                    header.count, header.last != 0) != 0) {
        w->fault = "a spilled list that was not asked for";
    }
}

void node_worker_message(struct node_worker *worker,
                         const struct cube_message *message)
{
    worker->bytes_in += message->size;
    if (message->type == NODE_PAGE) {
        take_page(worker, message->data, message->size);
    } else if (message->type == NODE_UNSPILL) {
        take_unspill(worker, message->data, message->size);
    } else if (message->type == NODE_CREDIT &&
               message->size == sizeof worker->credit) {
        memcpy(&worker->credit, message->data, sizeof worker->credit);
    }
}

unsigned node_worker_work(struct node_worker *worker)
{
    unsigned worked = 0;
    while (worker->working && !worker->drained && worked < NODE_STEPS &&
           worker->fault == NULL &&
           node_outbox_free(&worker->results) > BATCHES_RESERVED) {
        enum incode_step step = incode_triangulator_step(worker->triangulator);
        if (step == INCODE_BROKEN) {
            worker->fault = incode_triangulator_fault(worker->triangulator);
            break;
        }
        worker->drained = step == INCODE_FINISHED;
        if (step == INCODE_WAITING) {
            break;
        }
        worked++;
    }
    if (worker->drained) {
        close_batch(worker);
    }
    return worked;
}

/* Who has the page. */
static uint16_t keeper(const struct node_worker *w, uint32_t page)
{
    if (w->setup.holders == 0) {
        return CUBE_HOST;
    }
    return (uint16_t)(1 + page % w->setup.holders);
}

/* Sends for wanted pages, one message for each node that has some. */
static void send_wanted(struct node_worker *w)
{
    while (w->wanted_count > 0) {
        uint32_t batch[NODE_PAGES_A_REQUEST];
        uint32_t count = 0, left = 0;
        uint16_t to = keeper(w, w->wanted[0]);
        if (cube_room(w->counted->cube, to) == 0) {
            return;
        }
        for (uint32_t i = 0; i < w->wanted_count; i++) {
            if (count < NODE_PAGES_A_REQUEST && keeper(w, w->wanted[i]) == to) {
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
static bool send_first(struct node_worker *w, struct node_outbox *box)
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

unsigned node_worker_send(struct node_worker *worker)
{
    unsigned sent = worker->wanted_count;
    send_wanted(worker);
    sent -= worker->wanted_count;
    if (worker->spills.used == 0) {
        close_spill(worker);
    }
    while (send_first(worker, &worker->spills)) {
        sent++;
    }
    while (worker->sent != worker->credit &&
           send_first(worker, &worker->results)) {
        worker->sent++;
        sent++;
    }
    return sent;
}

uint32_t node_worker_held(const struct node_worker *worker)
{
    return worker->open + worker->results.used + worker->spills.used +
           worker->spill_count + worker->wanted_count + worker->in_flight;
}

bool node_worker_done(const struct node_worker *worker)
{
    return worker->working && worker->drained && node_worker_held(worker) == 0;
}

void node_worker_end(struct node_worker *worker, uint64_t now_us)
{
    worker->wall_us += now_us - worker->start_us;
    worker->working = false;
    worker->drained = false;
}

void node_worker_totals(const struct node_worker *worker,
                        struct node_finished_message *totals, uint64_t now_us)
{
    totals->wall_us = worker->wall_us;
    if (worker->working) {
        totals->wall_us += now_us - worker->start_us;
    }
    totals->bytes_in = worker->bytes_in;
    totals->bytes_out = worker->bytes_out;
    totals->statistics = *incode_triangulator_statistics(worker->triangulator);
}
