#include "exchange.h"

#include <string.h>

#include "waves.h"
#include "lending.h"
#include "triangulation.h"

void node_waves_init(struct node_waves *waves,
                     const struct node_setup_message *setup,
                     struct node_counted *counted, struct node_fault *fault) {
    memset(waves, 0, sizeof *waves);
    waves->counted = counted;
    waves->fault = fault;
    for (unsigned d = 0; 1u << d < setup->nodes; d++)
        if ((counted->self & ((2u << d) - 1)) == 0)
            waves->children |= (uint16_t)(1u << d);
}

static void begin(struct node_waves *w, uint32_t number, uint8_t command) {
    w->number = number;
    w->command = command;
    w->open = true;
    w->to_tell = w->to_answer = w->children;
    w->begun = w->begun || command != NODE_WAVE_READY;
    memset(&w->sum, 0, sizeof w->sum);
    w->sum.number = number;
}

void node_waves_begin(struct node_waves *waves) {
    begin(waves, 1, NODE_WAVE_READY);
}

static bool take_wave(struct node_waves *w,
                      const struct cube_message *message) {
    struct node_wave_message wave;
    unsigned parent = w->counted->self & (w->counted->self - 1u);
    if (message->size != sizeof wave || message->source != parent ||
        w->counted->self == 0 || w->open) {
        node_fault_set(w->fault, "a wave of # bytes from node #", message->size,
                       message->source);
        return false;
    }
    memcpy(&wave, message->data, sizeof wave);
    if (wave.number != w->number + 1 || wave.command < NODE_WAVE_READY ||
        wave.command > NODE_WAVE_SEED) {
        node_fault_set(w->fault, "wave # after wave #", wave.number, w->number);
        return false;
    }
    begin(w, wave.number, (uint8_t)wave.command);
    return true;
}

static void take_answer(struct node_waves *w,
                        const struct cube_message *message) {
    struct node_wave_answer_message answer = {.number = 0};
    uint32_t bit = message->source ^ w->counted->self;
    if (message->size == sizeof answer)
        memcpy(&answer, message->data, sizeof answer);
    if (message->size != sizeof answer || (bit & (bit - 1)) != 0 ||
        (w->to_answer & bit) == 0 || answer.number != w->number) {
        node_fault_set(w->fault, "an answer to wave # from node #", w->number,
                       message->source);
        return;
    }
    w->to_answer &= (uint16_t)~bit;
    w->sum.sent += answer.sent;
    w->sum.received += answer.received;
    w->sum.left += answer.left;
}

/* NODE_WAVE or its answer.  True: a wave has come, waves->command says what it
 * is for. */
static bool node_waves_take(struct node_waves *waves,
                            const struct cube_message *message) {
    if (message->type == NODE_WAVE)
        return take_wave(waves, message);
    take_answer(waves, message);
    return false;
}

/* At node 0: whether what was sent does not come, however long it is waited
 * for. */
static bool is_missing(struct node_waves *w, bool unchanged) {
    if (!unchanged || w->sum.sent == w->sum.received) {
        w->unchanged = 0;
        w->unchanged_us = w->now_us;
        return false;
    }
    w->unchanged++;
    return w->unchanged >= NODE_WAVES_UNCHANGED &&
           w->now_us - w->unchanged_us >= NODE_WAVES_UNCHANGED_US;
}

/* At node 0: all have answered.  What is next? */
static uint8_t conclude(struct node_waves *w) {
    const struct node_wave_answer_message *now = &w->sum;
    bool unchanged =
        now->sent == w->before.sent && now->received == w->before.received;
    bool same = unchanged && now->sent == now->received;
    uint8_t next = NODE_WAVE_COUNT;
    if (w->command == NODE_WAVE_READY) {
        same = false;
    } else if (now->left == 0) {
        w->over = true;
        return 0;
    }
    if (is_missing(w, unchanged)) {
        node_fault_set(w->fault,
                       "the exchange is stuck: all nodes are quiet, and of # "
                       "sent to others # have come",
                       (uint32_t)now->sent, (uint32_t)now->received);
        return 0;
    }
    if (same && w->command == NODE_WAVE_COUNT && w->before.number != 0) {
        if (w->seeded) {
            node_fault_set(w->fault,
                           "the exchange is stuck: all nodes are quiet, and # "
                           "bricks are not closed",
                           (uint32_t)now->left, 0);
            return 0;
        }
        w->seeded = true;
        next = NODE_WAVE_SEED;
    }
    w->before = *now;
    begin(w, w->number + 1, next);
    return next;
}

static unsigned tell_children(struct node_waves *w) {
    const struct node_wave_message wave = {w->number, w->command};
    unsigned sent = 0;
    for (unsigned d = 0; w->to_tell >> d != 0; d++) {
        uint16_t child = (uint16_t)(w->counted->self | 1u << d);
        if ((w->to_tell >> d & 1) != 0 &&
            node_counted_write(w->counted, child, NODE_WAVE, &wave,
                               sizeof wave) == 0) {
            w->to_tell &= (uint16_t) ~(1u << d);
            sent++;
        }
    }
    return sent;
}

unsigned node_waves_send(struct node_waves *waves,
                         const struct node_waves_state *state,
                         uint8_t *command) {
    struct node_waves *w = waves;
    unsigned sent = tell_children(w);
    bool may_answer =
        w->command == NODE_WAVE_READY ? state->ready : state->quiet;
    *command = 0;
    if (!w->open || w->to_answer != 0 || w->to_tell != 0 || !may_answer)
        return sent;
    struct node_wave_answer_message answer = w->sum;
    answer.sent += state->sent;
    answer.received += state->received;
    answer.left += state->left;
    if (w->counted->self == 0) {
        w->open = false;
        w->sum = answer;
        *command = conclude(w);
        return sent + 1;
    }
    uint16_t parent = w->counted->self & (uint16_t)(w->counted->self - 1);
    if (node_counted_write(w->counted, parent, NODE_WAVE_ANSWER, &answer,
                           sizeof answer) == 0) {
        w->open = false;
        sent++;
    }
    return sent;
}

/* --- exchange ------------------------------------------------------------- */

struct exchange {
    struct node_fault *fault;
    uint16_t self;
    uint16_t nodes;
    struct node_triangulation triangulation;
    struct node_shares shares;
    struct node_lending lending;
    uint64_t received; /* of others */
    bool holds;        /* back what has come of them */
    struct node_waves waves;
    struct node_loans loans;
};

/* ---- memory ---- */

/* Outboxes, requests of others, and who asks for work. */
static size_t table_bytes(uint32_t nodes) {
    return node_shares_bytes(nodes) + node_lending_bytes(nodes) +
           node_loans_bytes(nodes);
}

static size_t own_bytes(const struct node_setup_message *setup) {
    return node_aligned(sizeof(struct exchange)) + table_bytes(setup->nodes);
}

static size_t exchange_arena_min(size_t memory,
                                 const struct node_setup_message *setup) {
    return own_bytes(setup) + node_triangulation_min(memory, setup);
}

static bool exchange_start(void *self, size_t bytes,
                           const struct node_setup_message *setup,
                           struct node_counted *counted,
                           struct node_fault *fault) {
    struct exchange *e = self;
    if (bytes < own_bytes(setup)) {
        node_fault_set(fault, "the node's memory does not hold its outboxes", 0,
                       0);
        return false;
    }
    if (setup->setup.build != INCODE_BUILD_FACES) {
        node_fault_set(fault, "invalid setup: an exchange that builds by way #",
                       setup->setup.build, 0);
        return false;
    }
    if (setup->setup.face_rule != INCODE_FACE_OWN ||
        setup->setup.owner_rule != INCODE_OWNER_LOWEST) {
        node_fault_set(fault,
                       "invalid setup: an exchange of face rule # and owner "
                       "rule #",
                       setup->setup.face_rule, setup->setup.owner_rule);
        return false;
    }
    memset(e, 0, sizeof *e);
    e->fault = fault;
    e->self = counted->self;
    e->nodes = setup->nodes;
    uint8_t *memory = (uint8_t *)self + node_aligned(sizeof(struct exchange));
    node_shares_init(&e->shares, memory, setup, counted);
    memory += node_shares_bytes(setup->nodes);
    node_lending_init(&e->lending, memory, setup, &e->shares, counted, fault);
    memory += node_lending_bytes(setup->nodes);
    node_loans_init(&e->loans, memory, setup, counted, fault);
    node_waves_init(&e->waves, setup, counted, fault);
    const struct incode_front_peers peers = node_shares_peers(&e->shares);
    return node_triangulation_start(&e->triangulation, self, bytes,
                                    own_bytes(setup), setup, &peers,
                                    &e->lending, counted, fault);
}

/* ---- messages ---- */

static void take_shares(struct exchange *e,
                        const struct cube_message *message) {
    struct incode_triangulator *t = e->triangulation.triangulator;
    struct node_shared share;
    for (size_t at = 0; at + sizeof share <= message->size;
         at += sizeof share) {
        memcpy(&share, message->data + at, sizeof share);
        if (incode_triangulator_take(t, share.v) != 0) {
            node_fault_set(e->fault, "vertex # of node #, of no tetrahedron",
                           share.v[0], message->source);
        }
        e->received++;
    }
    e->triangulation.bytes_in += message->size;
    if (message->size % sizeof share != 0) {
        node_fault_set(e->fault, "tetrahedra in # bytes from node #",
                       message->size, message->source);
    }
}

static void take_regions(struct exchange *e,
                         const struct cube_message *message) {
    struct node_regions_message regions;
    if (!node_shares_regions(&e->shares, message->data, message->size)) {
        node_fault_set(e->fault, "regions in # bytes, after # of them",
                       message->size, e->shares.known);
        return;
    }
    memcpy(&regions, message->data, sizeof regions);
    node_lending_to_all(&e->lending, regions.to_all);
}

static void take_to_all(struct exchange *e,
                        const struct cube_message *message) {
    struct node_triangulation *t = &e->triangulation;
    uint32_t page = node_lending_take_to_all(&e->lending, &t->requests.check,
                                             t->triangulator, message);
    if (page != INCODE_NONE &&
        incode_triangulator_awaits(t->triangulator, page))
        node_requests_again(&t->requests, page, false);
    t->bytes_in += message->size;
}

/* What node 0 asks all nodes for. */
static void follow(struct exchange *e, uint8_t command) {
    if (command == NODE_WAVE_SEED)
        incode_triangulator_seed(e->triangulation.triangulator);
}

/* Tetrahedra wait until what they may spill has room on its way to the host. */
static bool exchange_may_take(void *self, const struct cube_message *message) {
    struct exchange *e = self;
    uint32_t count = message->size / sizeof(struct node_shared);
    if (message->type != NODE_SHARE)
        return true;
    e->holds =
        !incode_triangulator_may_take(e->triangulation.triangulator, count);
    return !e->holds;
}

static void exchange_message(void *self, const struct cube_message *message,
                             uint64_t now_us) {
    struct exchange *e = self;
    switch (message->type) {
    case NODE_SHARE:
        take_shares(e, message);
        break;
    case NODE_WAVE:
    case NODE_WAVE_ANSWER:
        if (node_waves_take(&e->waves, message))
            follow(e, e->waves.command);
        break;
    case NODE_LOAN_ASK:
    case NODE_LOAN:
    case NODE_LOAN_FOUND:
        node_loans_take(&e->loans, message);
        break;
    case NODE_REGIONS:
        take_regions(e, message);
        break;
    case NODE_PAGE_REQUEST:
        node_lending_take(&e->lending, message);
        break;
    case NODE_PAGE_TO_ALL:
        take_to_all(e, message);
        break;
    default:
        if (!node_triangulation_message(&e->triangulation, message, now_us)) {
            node_fault_set(e->fault, "message of type # for an exchange",
                           message->type, 0);
        }
    }
}

/* ---- work ---- */

/* Tetrahedra that other nodes have found at stars that they borrowed. */
static bool use_found(struct exchange *e, uint32_t units) {
    struct node_outlet *outlet = &e->triangulation.outlet;
    node_outlet_found_by(outlet, node_loans_finder(&e->loans));
    bool used = node_loans_use(&e->loans, e->triangulation.triangulator, units);
    node_outlet_found_by(outlet, e->self);
    return used;
}

/* What came back first, as it may let others go on; what is borrowed last. */
static bool work_on(void *context, uint32_t units, uint32_t *spent) {
    struct exchange *e = context;
    struct incode_triangulator *t = e->triangulation.triangulator;
    uint64_t before = incode_triangulator_spent(t);
    if (node_fault_is_set(e->fault))
        return false;
    bool worked = use_found(e, units) ||
                  node_triangulation_step(&e->triangulation, units, spent) ||
                  node_loans_help(&e->loans, t, units);
    *spent = (uint32_t)(incode_triangulator_spent(t) - before);
    return worked;
}

static unsigned exchange_work(void *self, struct node_pace *pace) {
    struct exchange *e = self;
    e->waves.now_us = pace->begun_us;
    /* Not before all others can receive. */
    if (!e->waves.begun)
        return 0;
    unsigned worked = node_pace_work(pace, work_on, e);
    node_triangulation_close(&e->triangulation);
    return worked;
}

static bool is_quiet(const struct exchange *e) {
    return e->shares.used == 0 && !e->holds &&
           incode_triangulator_is_quiet(e->triangulation.triangulator);
}

static unsigned exchange_send(void *self) {
    struct exchange *e = self;
    const struct node_triangulation *t = &e->triangulation;
    uint8_t command;
    unsigned sent = node_shares_send(&e->shares) +
                    node_lending_send(&e->lending, t->triangulator) +
                    node_triangulation_send(&e->triangulation);
    if (e->waves.begun && !node_fault_is_set(e->fault))
        sent += node_loans_send(&e->loans, t->triangulator);
    const struct node_waves_state state = {
        .ready = t->jobs.epoch != 0 && node_shares_ready(&e->shares),
        .quiet = is_quiet(e),
        .sent = e->shares.sent,
        .received = e->received,
        .left = incode_triangulator_left(t->triangulator)};
    /* Jobs are given out when all nodes have their role. */
    if (e->self == 0 && t->jobs.epoch != 0 && e->waves.number == 0)
        node_waves_begin(&e->waves);
    sent += node_waves_send(&e->waves, &state, &command);
    follow(e, command);
    return sent;
}

static uint32_t exchange_awaited(const void *self) {
    const struct exchange *e = self;
    const struct node_triangulation *t = &e->triangulation;
    bool waits = t->jobs.working && (!e->waves.begun || is_quiet(e));
    return waits && !t->drained ? NODE_AWAITS_OTHERS
                                : incode_triangulator_awaited(t->triangulator);
}

/* The node that is to send a page, or what it has found at a star. */
static uint32_t exchange_owing(const void *self) {
    const struct exchange *e = self;
    uint32_t page = incode_triangulator_awaited(e->triangulation.triangulator);
    uint16_t keeper = page == INCODE_NONE
                          ? node_loans_owing(&e->loans)
                          : node_lending_keeper(&e->lending, page);
    return keeper == NODE_LENDING_COMES ? CUBE_HOST : keeper;
}

static uint32_t exchange_held(const void *self) {
    const struct exchange *e = self;
    return node_triangulation_held(&e->triangulation) + e->shares.used +
           e->lending.queued;
}

static uint32_t exchange_done(const void *self) {
    const struct exchange *e = self;
    return e->shares.used == 0 ? node_triangulation_done(&e->triangulation) : 0;
}

static void exchange_end(void *self, uint64_t now_us) {
    struct exchange *e = self;
    node_triangulation_end(&e->triangulation, now_us);
}

static void exchange_totals(const void *self,
                            struct node_finished_message *totals,
                            uint64_t now_us) {
    const struct exchange *e = self;
    node_triangulation_totals(&e->triangulation, totals, now_us);
    totals->bytes_in += e->loans.bytes_in;
    totals->bytes_out +=
        e->shares.bytes_out + e->lending.bytes_out + e->loans.bytes_out;
    totals->pages_held = e->lending.sent;
    totals->pages_forwarded = e->lending.passed;
    totals->statistics.stars_borrowed = e->loans.stars;
}

static void exchange_map(const void *self, struct node_map *map) {
    const struct exchange *e = self;
    size_t shares = node_shares_bytes(e->nodes);
    size_t lending = node_lending_bytes(e->nodes);
    size_t loans = node_loans_bytes(e->nodes);
    node_triangulation_map(&e->triangulation, map, 2);
    map->tables[0].bytes = (uint32_t)(shares + loans);
    map->tables[0].count = NODE_SHARE_BATCHES;
    map->tables[1].bytes = (uint32_t)lending;
    map->tables[1].count = e->lending.queue_max;
    map->tables[2].bytes -= (uint32_t)(shares + lending + loans);
}

static void exchange_gauge(const void *self, struct incode_gauge *gauge) {
    const struct exchange *e = self;
    incode_triangulator_gauge(e->triangulation.triangulator, gauge);
}

const struct node_role node_exchange_role = {
    .name = "exchange",
    .tables = {{"tetrahedra on their way to other nodes", "batches"},
               {"pages that other nodes ask for", "requests"},
               NODE_TRIANGULATION_NAMES},
    .arena_min = exchange_arena_min,
    .start = exchange_start,
    .message = exchange_message,
    .may_take = exchange_may_take,
    .work = exchange_work,
    .send = exchange_send,
    .done = exchange_done,
    .end = exchange_end,
    .awaited = exchange_awaited,
    .owing = exchange_owing,
    .held = exchange_held,
    .totals = exchange_totals,
    .gauge = exchange_gauge,
    .map = exchange_map,
};
