#include "sim.h"

#include <stdlib.h>
#include <string.h>

#include "host/mesh/gen.h"
#include "host/service/service.h"
#include "sim_reference.h"
#include "second_host.h"
#include "host/check/verify.h"

enum {
    LASTING_MAX = 32, /* faults that are to be taken back */
    TRIES_MAX = 50,   /* for a kind of fault that is wanted and possible */
    REBOOT_US = 3000,
    TOLD_US = 1000000,
    KNOCK_AGAIN_US = 5000,
    HOST_US_CALM = 200,       /* for a look at the clock, at most, in the end */
    TIME_US_MAX = 1800000000, /* half an hour in virtual time, */
    STEPS_MAX = 60000000      /* or so many steps: it hangs */
};

/* A fault to be taken back.  A partition has a node and a link: all wires of
 * that dimension, or the node's own where link is the cube's dimension. */
struct lasting {
    uint64_t until_us;
    enum host_sim_fault kind;
    unsigned wire, side, node, link;
};

struct run {
    const struct host_sim_plan *plan;
    struct host_sim_outcome *outcome;
    struct host_world world;
    struct host_service service;
    struct host_rival rival;
    struct host_points points;
    struct host_order order;
    struct host_tetrahedra tets;
    uint64_t random, calm_us, event_us, knock_us;
    unsigned events;
    bool open, crash_due, broken;
    uint64_t frames;                  /* seen by `decide` */
    uint64_t before[HOST_SIM_FAULTS]; /* strikes before work was open */
    struct lasting lasting[LASTING_MAX];
    unsigned lasting_count;
};

/* --- faults at their times ----------------------------------------------- */

static uint64_t draw(struct run *r, uint64_t lo, uint64_t hi)
{
    return host_world_draw(&r->random, lo, hi);
}

/* Cuts or mends all wires that a partition names. */
static void part(struct run *r, const struct lasting *l, bool cut)
{
    struct host_world *w = &r->world;
    unsigned dimension = w->options.dimension;
    for (unsigned i = 0; l->link == dimension && i < dimension; i++) {
        host_world_cut(w, host_world_wire_of(w, l->node, i), cut);
    }
    for (unsigned i = 0; l->link < dimension && i < w->options.nodes / 2; i++) {
        host_world_cut(w, l->link * (w->options.nodes / 2) + i, cut);
    }
}

static void take_back(struct run *r, const struct lasting *l)
{
    if (l->kind == HOST_SIM_ONE_WAY) {
        host_world_deaf(&r->world, l->wire, l->side, false);
    } else if (l->kind == HOST_SIM_CUT) {
        host_world_cut(&r->world, l->wire, false);
    } else {
        part(r, l, false);
    }
}

/* Takes back what is over by now, or all. */
static void mend(struct run *r, bool all)
{
    unsigned left = 0;
    for (unsigned i = 0; i < r->lasting_count; i++) {
        struct lasting one = r->lasting[i];
        if (all || one.until_us <= r->world.now_us) {
            take_back(r, &one);
        } else {
            r->lasting[left++] = one;
        }
    }
    r->lasting_count = left;
}

static void weather(struct run *r, bool bad)
{
    for (unsigned i = 0; i < r->world.wires; i++) {
        for (unsigned side = 0; side < 2; side++) {
            bool here = bad && draw(r, 0, 2) > 0;
            sim_line_faults(&r->world.wire[i].wire.line[side],
                            here ? &r->plan->weather : NULL);
        }
    }
}

/* Node 0 forgets which host it keeps to, and is his who comes first: no other
 * may come then but one that has just been told. */
static bool may_crash(const struct run *r)
{
    return !r->rival.there ||
           (r->rival.told > 0 && r->world.now_us - r->rival.told_us < TOLD_US);
}

static bool may_knock(const struct run *r)
{
    const struct host_world_node *node = &r->world.node[0];
    return node->state == HOST_WORLD_UP &&
           r->service.node[0].start == node->board.identity.epoch;
}

/* One fault of those that the plan wants; false: none was possible. */
static bool happen(struct run *r)
{
    struct host_world *w = &r->world;
    enum host_sim_fault kind =
        (enum host_sim_fault)draw(r, HOST_SIM_ONE_WAY, HOST_SIM_SLOW_HOST);
    uint64_t us = host_world_draw_log(&r->random, 1000, r->plan->lasts_us_max);
    unsigned node = (unsigned)draw(r, 0, w->options.nodes - 1);
    struct lasting l = {.until_us = w->now_us + us, .kind = kind};
    l.wire = (unsigned)draw(r, 0, w->wires - 1);
    l.side = (unsigned)draw(r, 0, 1);
    l.node = node;
    l.link = (unsigned)draw(r, 0, w->options.dimension);
    if (!r->plan->wanted[kind]) {
        return false;
    }
    if (kind == HOST_SIM_CRASH && node == 0 && !may_crash(r)) {
        return false;
    }
    if (kind == HOST_SIM_PAUSE) {
        host_world_pause(w, node, us);
    } else if (kind == HOST_SIM_CRASH) {
        host_world_crash(w, node, us, draw(r, 0, 1) == 0);
    } else if (kind == HOST_SIM_SLOW_HOST) {
        w->host_pause_us = us;
    } else if (r->lasting_count == LASTING_MAX ||
               (kind == HOST_SIM_PARTITION && w->options.dimension == 0)) {
        return false;
    } else {
        r->lasting[r->lasting_count++] = l;
        if (kind == HOST_SIM_ONE_WAY) {
            host_world_deaf(w, l.wire, l.side, true);
        } else if (kind == HOST_SIM_CUT) {
            host_world_cut(w, l.wire, true);
        } else {
            part(r, &l, true);
        }
    }
    r->outcome->struck[kind] += r->open;
    return true;
}

static bool any_event_wanted(const struct host_sim_plan *plan)
{
    bool any = false;
    for (int k = HOST_SIM_ONE_WAY; k <= HOST_SIM_SLOW_HOST; k++) {
        any = any || plan->wanted[k];
    }
    return any;
}

static void break_for_good(struct run *r)
{
    struct host_world *w = &r->world;
    r->broken = true;
    if (r->plan->wanted[HOST_SIM_DEAD_WIRE]) {
        host_world_cut(w, (unsigned)draw(r, 0, w->host_wire - 1), true);
        r->outcome->struck[HOST_SIM_DEAD_WIRE] += r->open;
    }
    if (r->plan->wanted[HOST_SIM_DEAD_NODE]) {
        host_world_kill(w, (unsigned)draw(r, 1, w->options.nodes - 1));
        r->outcome->struck[HOST_SIM_DEAD_NODE] += r->open;
    }
}

/* The world's clock has come to where something is to be done. */
static void strike(void *context)
{
    struct run *r = context;
    struct host_world *w = &r->world;
    if (r->crash_due) {
        r->crash_due = false;
        host_world_crash(w, r->plan->restart_node, REBOOT_US, false);
    }
    mend(r, false);
    if (w->now_us >= r->knock_us && !may_knock(r)) {
        r->knock_us = w->now_us + KNOCK_AGAIN_US;
    } else if (w->now_us >= r->knock_us) {
        r->knock_us = UINT64_MAX;
        host_rival_come(&r->rival, w, w->now_us + r->plan->knock_lasts_us,
                        w->options.host_us);
        r->outcome->struck[HOST_SIM_SECOND_HOST] += r->open;
    }
    if (w->now_us >= r->calm_us) {
        mend(r, true);
        weather(r, false);
        w->strike_us = r->knock_us;
        if (w->options.host_us > HOST_US_CALM) {
            w->options.host_us = HOST_US_CALM;
        }
        return;
    }
    if (w->now_us >= r->event_us && !r->broken) {
        break_for_good(r);
    }
    if (w->now_us >= r->event_us) {
        bool more = any_event_wanted(r->plan) && r->events > 0;
        for (unsigned tries = 0; more && tries < TRIES_MAX; tries++) {
            if (happen(r)) {
                break;
            }
        }
        r->events -= more;
        r->event_us =
            !more ? UINT64_MAX
                  : w->now_us + draw(r, 1, 2 * (uint64_t)r->plan->gap_us);
    }
    w->strike_us = r->calm_us < r->event_us ? r->calm_us : r->event_us;
    w->strike_us = r->knock_us < w->strike_us ? r->knock_us : w->strike_us;
    for (unsigned i = 0; i < r->lasting_count; i++) {
        uint64_t until = r->lasting[i].until_us;
        w->strike_us = until < w->strike_us ? until : w->strike_us;
    }
}

/* The frame that the plan names meets its fate. */
static enum sim_fate decide(void *context, struct sim_line *line)
{
    struct run *r = context;
    (void)line;
    if (++r->frames != r->plan->frame) {
        return SIM_PASSES;
    }
    r->crash_due = r->plan->restart;
    r->world.strike_us = r->plan->restart ? 0 : r->world.strike_us;
    return r->plan->fate;
}

static void watch_frames(struct run *r)
{
    struct host_world *w = &r->world;
    for (unsigned i = 0; r->plan->frame != 0 && i < w->wires; i++) {
        for (unsigned side = 0; side < 2; side++) {
            struct sim_line *line = &w->wire[i].wire.line[side];
            line->decide = r->plan->restart ? NULL : decide;
            line->context = r;
        }
    }
    struct host_world_node *node = &w->node[r->plan->restart_node];
    for (unsigned d = 0; r->plan->restart && d < node->links; d++) {
        node->port[d].end->out->decide = decide;
    }
}

/* --- the run -------------------------------------------------------------- */

static void sum_strikes(const struct host_world *w, uint64_t *struck)
{
    for (unsigned i = 0; i < w->wires; i++) {
        for (unsigned k = 0; k < 2 * SIM_CHANCES; k++) {
            struck[k / 2] += w->wire[i].wire.line[k % 2].struck[k / 2];
        }
    }
}

/* Bytes that every node needs: node 0 has the most links. */
static uint64_t memory_of(const struct run *r)
{
    const struct host_sim_plan *p = r->plan;
    struct incode_setup setup = {.bricks = r->order.bricks,
                                 .index = (uint8_t)p->index};
    unsigned dimension = (unsigned)__builtin_ctz(p->nodes);
    struct node_identity identity = {.dimension = (uint8_t)dimension,
                                     .window = (uint8_t)p->window,
                                     .epoch = 1};
    memcpy(setup.cells, r->order.cells, sizeof setup.cells);
    uint64_t memory = 0, needed = 1;
    while (needed > memory) {
        memory += 4096;
        needed = node_arena_needed(&identity, memory, &setup) +
                 HOST_WORLD_STACK + HOST_WORLD_STATIC;
    }
    return memory + p->memory_more / 64 * 64;
}

static int open_world(struct run *r, struct host_error *error)
{
    const struct host_sim_plan *p = r->plan;
    struct host_world_options o = {
        .nodes = p->nodes,
        .dimension = (unsigned)__builtin_ctz(p->nodes),
        .memory = memory_of(r),
        .window = (uint8_t)p->window,
        .dead_us = p->dead_us,
        .wire = p->wire,
        .host_wire = p->host_wire,
        .gather_us = p->gather_us,
        .step_us = p->step_us,
        .host_us = p->host_us,
        .seed = p->seed,
        .time_us_max = TIME_US_MAX,
        .steps_max = STEPS_MAX,
        .absent_s = p->absent_s,
        .second_host = p->wanted[HOST_SIM_SECOND_HOST],
        .strike = strike,
        .context = r,
        .guest = host_rival_round,
        .guest_context = &r->rival,
    };
    if (host_world_open(&r->world, &o, error) != 0) {
        return error->code;
    }
    for (unsigned i = 0; i < p->missing; i++) {
        unsigned wire = (unsigned)draw(r, 0, r->world.host_wire - 1);
        if (!r->world.wire[wire].missing) {
            host_world_leave_out(&r->world, wire);
        }
    }
    return 0;
}

static int make_work(struct run *r, struct host_error *error)
{
    const struct host_sim_plan *p = r->plan;
    if (host_gen(p->kind, p->points, p->seed, &r->points, error) != 0) {
        return error->code;
    }
    return host_order_make(&r->order, "points", r->points.xyz, r->points.count,
                           p->partition, p->sequential ? 1 : p->nodes,
                           p->index == INCODE_GRID, error);
}

/* The work is open: from now on faults count. */
static void begin(struct run *r)
{
    struct host_world *w = &r->world;
    r->open = true;
    r->outcome->work_us = w->now_us;
    r->calm_us = w->now_us + r->plan->calm_us;
    r->event_us = w->now_us + draw(r, 1, r->plan->gap_us);
    r->events = r->plan->events_max;
    r->knock_us = r->plan->wanted[HOST_SIM_SECOND_HOST]
                      ? w->now_us + r->plan->knock_us
                      : UINT64_MAX;
    for (unsigned i = 0; i < w->wires; i++) {
        r->outcome->struck[HOST_SIM_MISSING_WIRE] += w->wire[i].missing;
    }
    sum_strikes(w, r->before);
    weather(r, true);
    w->strike_us = r->event_us < r->knock_us ? r->event_us : r->knock_us;
}

/* Pages that were dropped and faces that were spilled. */
static uint64_t shortages(const struct run *r)
{
    uint64_t sum = r->service.spill.faces_total;
    for (unsigned i = 0; i < r->plan->nodes; i++) {
        sum += r->service.report[i].statistics.statistics.page_evictions;
    }
    return sum;
}

static void finish(struct run *r)
{
    struct host_sim_outcome *out = r->outcome;
    uint64_t now[HOST_SIM_FAULTS] = {0};
    sum_strikes(&r->world, now);
    for (int k = 0; k < SIM_CHANCES; k++) {
        out->struck[k] = now[k] - r->before[k];
    }
    r->open = false;
    r->knock_us = UINT64_MAX;
    host_rival_leave(&r->rival);
    out->work_us = r->world.now_us - out->work_us;
    if (r->plan->wanted[HOST_SIM_SLOW_HOST]) {
        out->struck[HOST_SIM_SLOW_HOST]++;
    }
    if (r->plan->wanted[HOST_SIM_TINY]) {
        out->struck[HOST_SIM_TINY] = shortages(r);
    }
}

/* What is left in the queues of host and nodes when all is done. */
static int check_queues(const struct run *r, struct host_error *error)
{
    const struct host_service *s = &r->service;
    uint64_t left = s->over ? 0 : s->spill.faces;
    for (unsigned i = 0; i < r->plan->nodes && !s->over; i++) {
        const struct host_world_node *node = &r->world.node[i];
        left += s->node[i].pages_count + s->node[i].unspills_count;
        /* A node that was cut off for good keeps what it has. */
        bool counts = node->state == HOST_WORLD_UP && !s->node[i].lost;
        left += counts ? node_held(node->node) : 0;
    }
    if (s->ledger.committed != s->ledger.bricks || left > 0) {
        return host_fail(error, HOST_BROKEN,
                         "cube: %u of %u bricks committed and %llu slots of "
                         "queues in use at the end; replay it",
                         s->ledger.committed, s->ledger.bricks,
                         (unsigned long long)left);
    }
    return 0;
}

static int check_rival(const struct run *r, struct host_error *error)
{
    return r->rival.fault[0] == '\0'
               ? 0
               : host_fail(error, HOST_BROKEN, "node 0: %s; replay it",
                           r->rival.fault);
}

/* Every wire that was missing was named, and no other. */
static int check_wires(const struct run *r, struct host_error *error)
{
    const struct host_world *w = &r->world;
    const bool *wanted = r->plan->wanted;
    /* What died or was lost since may be named as dead, or not at all. */
    bool all = !r->service.over && !wanted[HOST_SIM_DEAD_WIRE] &&
               !wanted[HOST_SIM_DEAD_NODE];
    for (unsigned i = 0; i < w->wires; i++) {
        bool missing = w->wire[i].missing, named = w->wire[i].named;
        if (missing ? all && !named : named) {
            return host_fail(error, HOST_BROKEN, "host: wire %u %s; replay it",
                             i,
                             missing ? "is missing and was not named"
                                     : "was named as missing and is there");
        }
    }
    return 0;
}

static int serve(struct run *r, struct host_machine *machine,
                 struct host_error *error)
{
    const struct host_sim_plan *p = r->plan;
    struct host_service *s = &r->service;
    s->machine = machine;
    s->order = &r->order;
    s->tets = &r->tets;
    s->window = p->host_window;
    s->patience_us = p->patience_us;
    s->workers = p->sequential ? 1 : p->nodes;
    s->setup.setup.index = (uint8_t)p->index;
    s->setup.setup.face_rule = (uint8_t)p->face_rule;
    s->setup.setup.shuffle_seed = p->shuffle_seed;
    /* Early weather ends too, while there is patience left to come up. */
    uint64_t patience = p->patience_us != 0 ? p->patience_us : HOST_PATIENCE_US;
    r->calm_us = p->calm_us < patience / 2 ? p->calm_us : patience / 2;
    r->event_us = r->knock_us = UINT64_MAX;
    r->world.strike_us = r->calm_us;
    weather(r, p->early);
    watch_frames(r);
    int status = host_service_start(s, error);
    if (status == 0) {
        begin(r);
        status = host_service_run(s, error);
        finish(r);
    }
    status = status != 0 ? status : check_queues(r, error);
    status = status != 0 ? status : check_rival(r, error);
    status = status != 0 ? status : host_service_wires(s, error);
    status = status != 0 ? status : check_wires(r, error);
    r->calm_us = 0;
    r->world.strike_us = 0;
    host_service_end(s);
    return status;
}

static int compare(struct run *r, struct host_error *error)
{
    static struct host_verify_report report;
    struct host_tetrahedra right = {0};
    struct host_digest digest = {{0}};
    int status = host_reference(&r->points, &right, error);
    if (status == 0) {
        status = host_verify(&r->points, &right, &report, error);
    }
    if (status == 0) {
        host_digest(&right, &digest);
        host_tetrahedra_map(&r->tets, r->order.row);
        host_tetrahedra_sort(&r->tets);
        host_digest(&r->tets, &r->outcome->digest);
        if (strcmp(digest.text, r->outcome->digest.text) != 0) {
            status = host_fail(error, HOST_UNVERIFIED,
                               "host: %llu tetrahedra, digest %.15s; %llu and "
                               "%.15s are right; replay it",
                               (unsigned long long)r->tets.count,
                               r->outcome->digest.text,
                               (unsigned long long)right.count, digest.text);
        }
    }
    host_tetrahedra_free(&right);
    return status;
}

static void tell(struct run *r)
{
    struct host_sim_outcome *out = r->outcome;
    const struct host_world *w = &r->world;
    out->trace = w->trace;
    out->steps = w->steps;
    out->time_us = w->now_us;
    for (unsigned i = 0; i < w->options.nodes; i++) {
        out->restarts += w->node[i].starts - 1;
        for (unsigned d = 0; i < 16 && d < w->node[i].links; d++) {
            out->node_frames[i] += w->node[i].port[d].end->out->frames;
        }
    }
    for (unsigned i = 0; i < w->wires; i++) {
        out->frames +=
            w->wire[i].wire.line[0].frames + w->wire[i].wire.line[1].frames;
    }
}

int host_sim_run(const struct host_sim_plan *plan,
                 struct host_sim_outcome *outcome, struct host_error *error)
{
    struct run *r = calloc(1, sizeof *r);
    memset(outcome, 0, sizeof *outcome);
    if (r == NULL) {
        return host_fail_memory(error, "the simulation");
    }
    r->plan = plan;
    r->outcome = outcome;
    r->random = sim_seed(plan->seed, 2);
    int status = make_work(r, error);
    if (status == 0 && open_world(r, error) == 0) {
        struct host_machine machine = host_world_machine(&r->world);
        status = serve(r, &machine, error);
        tell(r);
        const char *damage = host_world_damage(&r->world);
        if (status == 0 && damage != NULL) {
            status =
                host_fail(error, HOST_BROKEN, "node: %s; replay it", damage);
        }
        host_world_close(&r->world);
        status = status != 0 ? status : compare(r, error);
    }
    host_order_free(&r->order);
    host_points_free(&r->points);
    host_tetrahedra_free(&r->tets);
    free(r);
    return status != 0 ? status : error->code;
}
