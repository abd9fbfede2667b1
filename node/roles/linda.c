#include <string.h>

#include "linda_builder.h"
#include "share.h"
#include "tetra_builder.h"
#include "linda_manager.h"
#include "face_manager.h"
#include "linda_worker.h"
#include "incode/predicates/check.h"
#include "worker.h"

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
    if (b->runs)
        return false;
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
    if (!node_share_init(&b->share, memory, setup, build, b, counted, fault))
        return false;
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

/* --- linda manager -------------------------------------------------------- */

enum { RESULTS = 6 /* that it asks for at a time */ };

struct linda_manager {
    struct node_face_manager faces;
    struct node_share share;
    size_t share_bytes;
    uint32_t workers;
    uint32_t begun, told, back; /* of them, in this job */
    int worker;                 /* the operation that takes one back, or -1 */
};

static size_t linda_manager_arena_min(size_t memory,
                                      const struct node_setup_message *setup) {
    return node_aligned(sizeof(struct linda_manager)) +
           node_share_bytes(setup) + node_face_manager_min(memory);
}

/* Nobody calls it: eval goes to other places where there are any. */
static bool no_process(void *context, struct tuple *tuple) {
    (void)context, (void)tuple;
    return true;
}

static bool linda_manager_start(void *self, size_t bytes,
                                const struct node_setup_message *setup,
                                struct node_counted *counted,
                                struct node_fault *fault) {
    struct linda_manager *m = self;
    uint8_t *memory = (uint8_t *)self + node_aligned(sizeof *m);
    size_t share = node_share_bytes(setup);
    size_t own = node_aligned(sizeof *m) + share;
    if (bytes < own) {
        node_fault_set(fault,
                       "the node's memory does not hold its share of the tuple "
                       "space",
                       0, 0);
        return false;
    }
    memset(m, 0, sizeof *m);
    m->share_bytes = share;
    m->worker = -1;
    if (!node_share_init(&m->share, memory, setup, no_process, m, counted,
                         fault))
        return false;
    m->workers = m->share.places - 1u;
    if (setup->manager != counted->self || m->workers == 0) {
        node_fault_set(fault, "invalid setup: face manager # has # builders",
                       counted->self, m->workers);
        return false;
    }
    const struct node_carrier carrier = node_share_carrier(
        &m->share, NODE_SHARE_JOB, NODE_SHARE_RESULT, RESULTS);
    return node_face_manager_start(&m->faces, memory + share, bytes - own,
                                   setup, &carrier, counted, fault);
}

static void linda_manager_message(void *self,
                                  const struct cube_message *message,
                                  uint64_t now_us) {
    struct linda_manager *m = self;
    if (message->type == NODE_TUPLES) {
        node_share_take(&m->share, message);
    } else if (!node_face_manager_message(&m->faces, message, now_us)) {
        node_fault_set(m->faces.fault, "message of type # for a face manager",
                       message->type, 0);
    }
}

static unsigned linda_manager_work(void *self, struct node_pace *pace) {
    struct linda_manager *m = self;
    bool moved =
        m->faces.jobs.working && node_share_eval_all(&m->share, &m->begun, 1);
    unsigned worked = node_face_manager_work(&m->faces, pace);
    if (node_face_manager_done(&m->faces) != 0) {
        node_share_stop(&m->share);
        moved = node_share_end_all(&m->share, &m->told, 1) || moved;
        if (m->back < m->workers &&
            node_share_in_worker(&m->share, &m->worker)) {
            m->back++;
            moved = true;
        }
    }
    return worked + moved;
}

static unsigned linda_manager_send(void *self) {
    struct linda_manager *m = self;
    return node_outlet_send(&m->faces.outlet) + tuples_step(m->share.space);
}

static uint32_t linda_manager_held(const void *self) {
    const struct linda_manager *m = self;
    return node_face_manager_held(&m->faces) + tuples_held(m->share.space);
}

static uint32_t linda_manager_done(const void *self) {
    const struct linda_manager *m = self;
    return m->back == m->workers && tuples_held(m->share.space) == 0
               ? node_face_manager_done(&m->faces)
               : 0;
}

static void linda_manager_end(void *self, uint64_t now_us) {
    struct linda_manager *m = self;
    node_face_manager_end(&m->faces, now_us);
    m->begun = m->told = m->back = 0;
}

static uint32_t linda_manager_awaited(const void *self) {
    (void)self;
    return INCODE_NONE; /* it has no pages */
}

static uint32_t linda_manager_owing(const void *self) {
    const struct linda_manager *m = self;
    return node_share_owing(&m->share);
}

static void linda_manager_totals(const void *self,
                                 struct node_finished_message *totals,
                                 uint64_t now_us) {
    const struct linda_manager *m = self;
    node_face_manager_totals(&m->faces, totals, now_us);
    totals->bytes_in += m->share.bytes_in;
    totals->bytes_out += m->share.bytes_out;
    totals->memory_high_water += node_aligned(sizeof *m) + m->share_bytes;
}

static void linda_manager_map(const void *self, struct node_map *map) {
    const struct linda_manager *m = self;
    node_face_manager_map(&m->faces, map);
    map->tables[0].bytes += (uint32_t)node_aligned(sizeof *m);
    map->tables[3].bytes = (uint32_t)m->share_bytes;
}

static void linda_manager_gauge(const void *self, struct incode_gauge *gauge) {
    const struct linda_manager *m = self;
    node_face_manager_gauge(&m->faces, gauge);
}

const struct node_role node_linda_manager_role = {
    .name = "linda manager",
    .tables = {{"results and spilled faces on their way out", NULL},
               {"active face list", "faces"},
               {"open bricks", "entries"},
               {"share of the tuple space", NULL}},
    .arena_min = linda_manager_arena_min,
    .start = linda_manager_start,
    .message = linda_manager_message,
    .work = linda_manager_work,
    .send = linda_manager_send,
    .done = linda_manager_done,
    .end = linda_manager_end,
    .awaited = linda_manager_awaited,
    .owing = linda_manager_owing,
    .held = linda_manager_held,
    .totals = linda_manager_totals,
    .gauge = linda_manager_gauge,
    .map = linda_manager_map,
};

/* --- linda worker --------------------------------------------------------- */

/* Operations that others than eval and out are left: two ins, an out, and what
 * owes a word yet. */
enum { KEPT = 6 };

struct linda_worker {
    struct node_share share;
    struct node_counted *counted;
    struct node_fault *fault;
    size_t share_bytes;
    bool keeps; /* it puts the regions */
    bool runs;  /* eval has started it, or it has started the others */
    bool busy;  /* has a region, or its job */
    int region; /* the operation that takes one, or -1 */
    int taken;  /* and who has taken which, where it keeps them */
    uint32_t begun;
    struct incode_job put[NODE_OUT_MAX]; /* to be put yet */
    uint32_t put_count;
    void *worker; /* whose state follows */
};

static size_t own_bytes(const struct node_setup_message *setup) {
    return node_aligned(sizeof(struct linda_worker)) + node_share_bytes(setup);
}

static size_t linda_worker_arena_min(size_t memory,
                                     const struct node_setup_message *setup) {
    return own_bytes(setup) + node_worker_role.arena_min(memory, setup);
}

/* For as long as the generation lasts. */
static bool go_on(void *self, struct tuple *tuple) {
    struct linda_worker *w = self;
    (void)tuple;
    w->runs = true;
    return false;
}

static bool linda_worker_start(void *self, size_t bytes,
                               const struct node_setup_message *setup,
                               struct node_counted *counted,
                               struct node_fault *fault) {
    struct linda_worker *w = self;
    uint8_t *memory = self;
    size_t own = own_bytes(setup);
    if (bytes < own) {
        node_fault_set(fault,
                       "the node's memory does not hold its share of the tuple "
                       "space",
                       0, 0);
        return false;
    }
    memset(w, 0, sizeof *w);
    w->counted = counted;
    w->fault = fault;
    w->share_bytes = node_share_bytes(setup);
    w->keeps = setup->manager == counted->self;
    w->region = w->taken = -1;
    w->worker = memory + own;
    return node_share_init(&w->share, memory + node_aligned(sizeof *w), setup,
                           go_on, w, counted, fault) &&
           node_worker_role.start(w->worker, bytes - own, setup, counted,
                                  fault);
}

static void take_out(struct linda_worker *w,
                     const struct cube_message *message) {
    if (!w->keeps || message->size != sizeof w->put[0] ||
        w->put_count == NODE_OUT_MAX) {
        node_fault_set(w->fault, "a region of # bytes, and # are put already",
                       message->size, w->put_count);
        return;
    }
    memcpy(&w->put[w->put_count++], message->data, message->size);
    w->runs = true;
}

static void linda_worker_message(void *self, const struct cube_message *message,
                                 uint64_t now_us) {
    struct linda_worker *w = self;
    if (message->type == NODE_TUPLES)
        node_share_take(&w->share, message);
    else if (message->type == NODE_OUT)
        take_out(w, message);
    else
        node_worker_role.message(w->worker, message, now_us);
}

static bool put_regions(struct linda_worker *w) {
    bool moved = false;
    while (w->put_count > 0 && tuples_room(w->share.space) > KEPT) {
        moved = node_share_out_bytes(&w->share, NODE_SHARE_REGION,
                                     &w->put[--w->put_count], sizeof w->put[0]);
    }
    return moved;
}

/* Takes a region, and says so in the space. */
static bool take_region(struct linda_worker *w) {
    struct incode_job job;
    if (w->busy || tuples_room(w->share.space) < 2 ||
        !node_share_in_bytes(&w->share, NODE_SHARE_REGION, &w->region, &job,
                             sizeof job))
        return false;
    const struct node_taken taken = {w->counted->self, job.first, job.last};
    w->busy = true;
    bool put =
        node_share_out_bytes(&w->share, NODE_SHARE_TAKEN, &taken, sizeof taken);
    INCODE_ASSERT(put);
    return true;
}

/* Tells the host of one who has taken a region. */
static bool tell(struct linda_worker *w) {
    struct node_taken_message message;
    if (cube_room(w->counted->cube, CUBE_HOST) == 0 ||
        !node_share_in_bytes(&w->share, NODE_SHARE_TAKEN, &w->taken,
                             &message.taken, sizeof message.taken))
        return false;
    message.header.epoch = 0;
    message.header.sent = w->counted->sent;
    return node_counted_write(w->counted, CUBE_HOST, NODE_TAKEN, &message,
                              sizeof message) == 0;
}

static unsigned linda_worker_work(void *self, struct node_pace *pace) {
    struct linda_worker *w = self;
    unsigned moved = 0;
    if (w->runs && w->keeps) {
        moved += node_share_eval_all(&w->share, &w->begun, KEPT);
        moved += put_regions(w);
        moved += tell(w);
    }
    if (w->runs)
        moved += take_region(w);
    return moved + node_worker_role.work(w->worker, pace);
}

static unsigned linda_worker_send(void *self) {
    struct linda_worker *w = self;
    return node_worker_role.send(w->worker) + tuples_step(w->share.space);
}

static uint32_t linda_worker_done(const void *self) {
    const struct linda_worker *w = self;
    return node_worker_role.done(w->worker);
}

static void linda_worker_end(void *self, uint64_t now_us) {
    struct linda_worker *w = self;
    node_worker_role.end(w->worker, now_us);
    w->busy = false;
}

static uint32_t linda_worker_awaited(const void *self) {
    const struct linda_worker *w = self;
    return node_worker_role.awaited(w->worker);
}

static uint32_t linda_worker_owing(const void *self) {
    const struct linda_worker *w = self;
    return w->keeps ? node_share_owing(&w->share) : CUBE_HOST;
}

static uint32_t linda_worker_held(const void *self) {
    const struct linda_worker *w = self;
    return node_worker_role.held(w->worker);
}

static void linda_worker_totals(const void *self,
                                struct node_finished_message *totals,
                                uint64_t now_us) {
    const struct linda_worker *w = self;
    node_worker_role.totals(w->worker, totals, now_us);
    totals->bytes_in += w->share.bytes_in;
    totals->bytes_out += w->share.bytes_out;
    totals->memory_high_water += node_aligned(sizeof *w) + w->share_bytes;
}

enum { SHARE_TABLE = 5 };

static void linda_worker_map(const void *self, struct node_map *map) {
    const struct linda_worker *w = self;
    node_worker_role.map(w->worker, map);
    map->tables[SHARE_TABLE].bytes =
        (uint32_t)(node_aligned(sizeof *w) + w->share_bytes);
}

static void linda_worker_gauge(const void *self, struct incode_gauge *gauge) {
    const struct linda_worker *w = self;
    node_worker_role.gauge(w->worker, gauge);
}

const struct node_role node_linda_worker_role = {
    .name = "linda worker",
    .tables = {{"results and spilled faces on their way out", NULL},
               {"triangulator, its local points and tasks", NULL},
               {"active face list", "faces"},
               {"open bricks", "entries"},
               {"page frames", "pages of 1568 bytes"},
               {"share of the tuple space", NULL}},
    .arena_min = linda_worker_arena_min,
    .start = linda_worker_start,
    .message = linda_worker_message,
    .work = linda_worker_work,
    .send = linda_worker_send,
    .done = linda_worker_done,
    .end = linda_worker_end,
    .awaited = linda_worker_awaited,
    .owing = linda_worker_owing,
    .held = linda_worker_held,
    .totals = linda_worker_totals,
    .gauge = linda_worker_gauge,
    .map = linda_worker_map,
};
