#include "linda_worker.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "share.h"
#include "worker.h"

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
    if (message->type == NODE_TUPLES) {
        node_share_take(&w->share, message);
    } else if (message->type == NODE_OUT) {
        take_out(w, message);
    } else {
        node_worker_role.message(w->worker, message, now_us);
    }
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
                             sizeof job)) {
        return false;
    }
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
                             &message.taken, sizeof message.taken)) {
        return false;
    }
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
    if (w->runs) {
        moved += take_region(w);
    }
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
