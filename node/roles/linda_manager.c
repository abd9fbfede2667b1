#include "linda_manager.h"

#include <string.h>

#include "face_manager.h"
#include "share.h"

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
                         fault)) {
        return false;
    }
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
