#include "sim_plan.h"

#include "sim_draw.h"
#include "sim_run.h"
#include "sim_stand_ins.h"

enum {
    TRIES_MAX = 50, /* for a kind of fault that is wanted and possible */
    REBOOT_US = 3000,
    REFUSED_US = 1000000,
    SECOND_AGAIN_US = 5000,
    HOST_US_CALM = 200, /* for a look at the clock, at most, in the end */
    ABSENT_S = 30,
    ABSENT_S_MIN = 3,
    FIFO_BYTES = 16, /* of a UART */
    BARE_POINTS_MAX = 300,
    HOST_KEEPS_US = 3000000 /* node 0 to a host that it does not hear */
};

static uint64_t draw(struct host_sim_run *r, uint64_t lo, uint64_t hi) {
    return host_sim_draw(&r->random, lo, hi);
}

/* --- how they are drawn --------------------------------------------------- */

/* A wire breaks or a node dies for good where another way is left.  What else
 * would have links given up that come back, until none is left, does not happen
 * then. */
static void draw_death(struct host_sim_plan *p) {
    uint64_t state = sim_seed(p->seed, 78);
    if (p->nodes < 4 || p->nodes > 64 || host_sim_draw(&state, 1, 5) > 2)
        return;
    bool node = host_sim_draw(&state, 1, 2) == 1;
    p->wanted[HOST_SIM_DEAD_WIRE] = !node || host_sim_draw(&state, 1, 4) == 1;
    p->wanted[HOST_SIM_DEAD_NODE] = node;
    p->patience_us = host_sim_draw(&state, 9000000, 15000000);
    for (int k = HOST_SIM_ONE_WAY; k <= HOST_SIM_CRASH; k++)
        p->wanted[k] = false;
    p->dead_us = (uint32_t)host_sim_draw(&state, 4000000, 8000000);
}

/* Fewer wires than a node has may be missing anywhere: the cube holds together.
 * With dead ones one less, so that node 0 keeps one. */
static void draw_missing(struct host_sim_plan *p) {
    uint64_t state = sim_seed(p->seed, 79);
    unsigned dimension = (unsigned)__builtin_ctz(p->nodes);
    unsigned dead =
        p->wanted[HOST_SIM_DEAD_WIRE] + p->wanted[HOST_SIM_DEAD_NODE];
    if (p->nodes > 64 || dimension < 2 + dead ||
        host_sim_draw(&state, 1, 4) > 1)
        return;
    p->wanted[HOST_SIM_MISSING_WIRE] = true;
    p->missing = (unsigned)host_sim_draw(&state, 1, dimension - 1 - dead);
    p->absent_s = dead == 0 ? ABSENT_S : (uint8_t)(p->dead_us / 1000000);
    p->absent_s = p->absent_s < ABSENT_S_MIN ? ABSENT_S_MIN : p->absent_s;
}

/* A second host is sent away as long as node 0 hears the first: nothing else
 * then keeps it from that for long. */
static void draw_second_host(struct host_sim_plan *p) {
    uint64_t state = sim_seed(p->seed, 80);
    if (p->nodes > 64 || host_sim_draw(&state, 1, 4) > 1)
        return;
    p->wanted[HOST_SIM_SECOND_HOST] = true;
    p->second_us = host_sim_draw_log(&state, 100, 200000);
    p->second_lasts_us = host_sim_draw_log(&state, 10000, 10000000);
    p->events_max = p->events_max < 8 ? p->events_max : 8;
    uint32_t most = HOST_KEEPS_US / 10;
    p->lasts_us_max = p->lasts_us_max < most ? p->lasts_us_max : most;
    most = HOST_KEEPS_US / 30;
    p->weather.stall_us =
        p->weather.stall_us < most ? p->weather.stall_us : most;
}

/* From a state of its own, as what follows. */
static void draw_slow_nodes(struct host_sim_plan *p) {
    uint64_t state = sim_seed(p->seed, 88);
    if (p->nodes > 64 || host_sim_draw(&state, 1, 4) > 1)
        return;
    p->wanted[HOST_SIM_SLOW_NODE] = true;
    p->look_us = (uint32_t)host_sim_draw_log(&state, 20, 1000);
}

static void draw_serial_wire(struct sim_quality *q, uint32_t baud,
                             uint64_t *state) {
    q->bytes_per_s = baud / 10;
    q->latency_us = (uint32_t)host_sim_draw_log(state, 1, 3000);
    q->room = (uint32_t)host_sim_draw_log(state, 16, 1024);
    q->bytes = SIM_BYTES_MIN;
}

/* What is told of the rate may be wrong, as a board knows that of its own UARTs
 * alone.  A UART never closes, and has one host. */
static void draw_bare(struct host_sim_plan *p) {
    static const uint32_t rates[] = {19200, 19200, 115200, 115200, 921600};
    uint64_t state = sim_seed(p->seed, 89);
    if (p->nodes > 16 || p->wanted[HOST_SIM_SECOND_HOST] ||
        p->wanted[HOST_SIM_DEAD_WIRE] || p->wanted[HOST_SIM_MISSING_WIRE] ||
        p->wanted[HOST_SIM_TINY] || host_sim_draw(&state, 1, 3) > 1)
        return;
    p->wanted[HOST_SIM_BARE] = true;
    p->wanted[HOST_SIM_CUT] = p->wanted[HOST_SIM_PARTITION] = false;
    uint32_t baud = rates[host_sim_draw(&state, 0, 4)];
    p->serial_baud = host_sim_draw(&state, 1, 2) == 1 ? 115200 : baud;
    draw_serial_wire(&p->wire, baud, &state);
    draw_serial_wire(&p->host_wire, baud, &state);
    p->gather_us = (uint32_t)(UINT64_C(10000000) * FIFO_BYTES / baud);
    if (p->points > BARE_POINTS_MAX)
        p->points = 30 + p->points % BARE_POINTS_MAX;
}

/* What is left of the cube can do the work without it, once more: that slow
 * nodes with tiny memories take half an hour for.  It lies about what it has to
 * say: where one node computes, others have pages alone. */
static void draw_liar(struct host_sim_plan *p) {
    uint64_t state = sim_seed(p->seed, 91);
    unsigned others = 1u + p->wanted[HOST_SIM_DEAD_NODE] +
                      p->wanted[HOST_SIM_DEAD_WIRE] + p->wanted[HOST_SIM_IDLER];
    bool slow = p->wanted[HOST_SIM_TINY] && p->wanted[HOST_SIM_SLOW_NODE];
    if (p->nodes <= others || p->nodes > 64 || slow ||
        host_sim_draw(&state, 1, 6) > 1)
        return;
    unsigned node = (unsigned)host_sim_draw(&state, 0, p->nodes - 1);
    enum host_lie way = (enum host_lie)host_sim_draw(&state, 0, HOST_LIES - 1);
    bool alone = p->strategy->nodes_default == 1;
    if (!p->strategy->meshes && way == HOST_LIE_LOAN)
        way = HOST_LIE_DROP;
    if (!p->strategy->meshes && way == HOST_LIE_PAGE && !alone)
        way = HOST_LIE_EXCHANGE;
    if (alone)
        node = way == HOST_LIE_PAGE ? node | 1 : 0;
    p->wanted[HOST_SIM_LIAR] = true;
    p->liar.node = node;
    p->liar.way = way;
    p->liar.one_in = (uint32_t)host_sim_draw_log(&state, 1, 100);
}

/* From 640 KiB on: between two looks at what is resident there may be some
 * places that are read in no order, of 64 KiB each. */
static void draw_small_host(struct host_sim_plan *p) {
    uint64_t state = sim_seed(p->seed, 92);
    if (host_sim_draw(&state, 1, 8) > 1)
        return;
    p->wanted[HOST_SIM_SMALL_HOST] = true;
    p->host_memory = host_sim_draw(&state, 640, 768) << 10;
    if (p->nodes <= 8 && p->index == INCODE_KD && !p->wanted[HOST_SIM_TINY] &&
        !p->wanted[HOST_SIM_BARE] && !p->wanted[HOST_SIM_LIAR])
        p->points = host_sim_draw(&state, 6000, 8000); /* more than that */
}

/* --- what they do --------------------------------------------------------- */

static bool one_way(struct host_sim_run *r, const struct host_sim_event *e) {
    host_sim_cube_deaf(&r->world.cube, e->wire, e->side, true);
    return true;
}

static void both_ways(struct host_sim_run *r, const struct host_sim_event *e) {
    host_sim_cube_deaf(&r->world.cube, e->wire, e->side, false);
}

static bool cut(struct host_sim_run *r, const struct host_sim_event *e) {
    host_sim_cube_cut(&r->world.cube, e->wire, true);
    return true;
}

static void mend(struct host_sim_run *r, const struct host_sim_event *e) {
    host_sim_cube_cut(&r->world.cube, e->wire, false);
}

/* All wires of the dimension `link`, or the node's own where link is the cube's
 * dimension. */
static void part(struct host_sim_run *r, const struct host_sim_event *e,
                 bool apart) {
    struct host_sim_cube *cube = &r->world.cube;
    unsigned dimension = cube->options.dimension;
    for (unsigned i = 0; e->link == dimension && i < dimension; i++)
        host_sim_cube_cut(cube, host_sim_cube_wire(cube, e->node, i), apart);
    for (unsigned i = 0; e->link < dimension && i < cube->nodes / 2; i++)
        host_sim_cube_cut(cube, e->link * (cube->nodes / 2) + i, apart);
}

static bool partition(struct host_sim_run *r, const struct host_sim_event *e) {
    if (r->world.cube.options.dimension == 0)
        return false;
    part(r, e, true);
    return true;
}

static void unite(struct host_sim_run *r, const struct host_sim_event *e) {
    part(r, e, false);
}

static bool stand_still(struct host_sim_run *r,
                        const struct host_sim_event *e) {
    host_world_pause(&r->world, e->node, e->lasts_us);
    return true;
}

/* Node 0 forgets which host it keeps to, and is his who comes first: no other
 * may come then but one that has just been refused. */
static bool crash(struct host_sim_run *r, const struct host_sim_event *e) {
    const struct host_second_host *second = &r->second;
    if (e->node == 0 && second->there &&
        (second->refused == 0 ||
         r->world.now_us - second->refused_us >= REFUSED_US))
        return false;
    bool unplugged = draw(r, 0, 1) == 0 && !r->plan->wanted[HOST_SIM_BARE];
    host_world_crash(&r->world, e->node, e->lasts_us, unplugged);
    return true;
}

static bool slow_host(struct host_sim_run *r, const struct host_sim_event *e) {
    r->world.host_pause_us = e->lasts_us;
    return true;
}

static void kill_wire(struct host_sim_run *r) {
    struct host_sim_cube *cube = &r->world.cube;
    unsigned wire = (unsigned)draw(r, 0, cube->host_wire - 1);
    cube->wire[wire].dead = true;
    host_sim_cube_cut(cube, wire, true);
}

static void kill_node(struct host_sim_run *r) {
    host_world_kill(&r->world, (unsigned)draw(r, 1, r->world.nodes - 1));
}

/* --- how they are counted ------------------------------------------------- */

static uint64_t count_chance(const struct host_sim_run *r,
                             enum host_sim_fault kind) {
    return host_sim_cube_struck(&r->world.cube, (enum sim_fault)kind) -
           r->before[kind];
}

/* It is slow all the time, besides. */
static uint64_t count_slow_host(const struct host_sim_run *r,
                                enum host_sim_fault kind) {
    return r->happened[kind] + r->plan->wanted[kind];
}

/* Pages that were dropped and faces that were spilled. */
static uint64_t count_tiny(const struct host_sim_run *r,
                           enum host_sim_fault kind) {
    uint64_t sum = r->service.spill.faces_total;
    for (unsigned i = 0; i < r->plan->nodes; i++)
        sum += r->service.report[i].statistics.statistics.page_evictions;
    return r->plan->wanted[kind] ? sum : 0;
}

static uint64_t count_missing(const struct host_sim_run *r,
                              enum host_sim_fault kind) {
    uint64_t sum = 0;
    (void)kind;
    for (unsigned i = 0; i < r->world.cube.wires; i++)
        sum += r->world.cube.wire[i].missing;
    return sum;
}

/* Looks, of which some were at the links as well. */
static uint64_t count_slow_node(const struct host_sim_run *r,
                                enum host_sim_fault kind) {
    return r->plan->wanted[kind] ? r->world.looks : 0;
}

/* Starts of nodes that others had met before. */
static uint64_t count_bare(const struct host_sim_run *r,
                           enum host_sim_fault kind) {
    (void)kind;
    return r->world.learned;
}

/* Lies that have left the node. */
static uint64_t count_lies(const struct host_sim_run *r,
                           enum host_sim_fault kind) {
    (void)kind;
    return r->liar.told;
}

/* Trims by which pages of arrays left. */
static uint64_t count_small_host(const struct host_sim_run *r,
                                 enum host_sim_fault kind) {
    (void)kind;
    return r->scratch.trims;
}

/* --- the table ------------------------------------------------------------ */

const struct host_sim_kind host_sim_kinds[HOST_SIM_FAULTS] = {
    [SIM_LOSS] = {"loss", .one_in = 3, .count = count_chance},
    [SIM_FLIP] = {"flip", .one_in = 3, .count = count_chance},
    [SIM_DELETE] = {"delete", .one_in = 3, .count = count_chance},
    [SIM_INSERT] = {"insert", .one_in = 3, .count = count_chance},
    [SIM_REPEAT] = {"repeat", .one_in = 3, .count = count_chance},
    [SIM_BURST] = {"burst", .one_in = 3, .count = count_chance},
    [SIM_STALL] = {"stall", .one_in = 3, .count = count_chance},
    [HOST_SIM_ONE_WAY] = {"one-way", .one_in = 3, .happen = one_way,
                          .take_back = both_ways},
    [HOST_SIM_CUT] = {"cut", .one_in = 3, .happen = cut, .take_back = mend},
    [HOST_SIM_PARTITION] = {"partition", .one_in = 3, .happen = partition,
                            .take_back = unite},
    [HOST_SIM_PAUSE] = {"pause", .one_in = 3, .happen = stand_still},
    [HOST_SIM_CRASH] = {"crash", .one_in = 3, .happen = crash},
    [HOST_SIM_SLOW_HOST] = {"slow-host", .one_in = 3, .happen = slow_host,
                            .count = count_slow_host},
    [HOST_SIM_TINY] = {"tiny", .one_in = 3, .count = count_tiny},
    [HOST_SIM_DEAD_WIRE] = {"dead-wire", .draw = draw_death,
                            .break_for_good = kill_wire},
    [HOST_SIM_DEAD_NODE] = {"dead-node", .break_for_good = kill_node},
    [HOST_SIM_MISSING_WIRE] = {"missing-wire", .draw = draw_missing,
                               .count = count_missing},
    [HOST_SIM_SECOND_HOST] = {"second-host", .draw = draw_second_host},
    [HOST_SIM_IDLER] = {"idle-node", .draw = host_sim_draw_idler},
    [HOST_SIM_FOREIGN] = {"generation", .draw = host_sim_draw_teller},
    [HOST_SIM_SLOW_NODE] = {"slow-node", .draw = draw_slow_nodes,
                            .count = count_slow_node},
    [HOST_SIM_BARE] = {"bare", .draw = draw_bare, .count = count_bare},
    [HOST_SIM_LIAR] = {"lie", .draw = draw_liar, .count = count_lies},
    [HOST_SIM_SMALL_HOST] = {"small-host", .draw = draw_small_host,
                             .count = count_small_host},
};

/* --- when ----------------------------------------------------------------- */

static void weather(struct host_sim_run *r, bool bad) {
    for (unsigned i = 0; i < 2 * r->world.cube.wires; i++) {
        bool here = bad && draw(r, 0, 2) > 0;
        sim_direction_faults(
            host_sim_cube_direction(&r->world.cube, i / 2, i % 2),
            here ? &r->plan->weather : NULL);
    }
}

/* Takes back what is over by now, or all. */
static void take_back(struct host_sim_run *r, bool all) {
    unsigned left = 0;
    for (unsigned i = 0; i < r->lasting_count; i++) {
        struct host_sim_event one = r->lasting[i];
        if (all || one.until_us <= r->world.now_us)
            host_sim_kinds[one.kind].take_back(r, &one);
        else
            r->lasting[left++] = one;
    }
    r->lasting_count = left;
}

/* One of the kinds that happen at a time. */
static enum host_sim_fault draw_kind(struct host_sim_run *r) {
    enum host_sim_fault kinds[HOST_SIM_FAULTS];
    unsigned count = 0;
    for (int k = 0; k < HOST_SIM_FAULTS; k++)
        if (host_sim_kinds[k].happen != NULL)
            kinds[count++] = (enum host_sim_fault)k;
    return kinds[draw(r, 0, count - 1)];
}

/* One fault of those that the plan wants; false: none was possible. */
static bool happen(struct host_sim_run *r) {
    const struct host_world *w = &r->world;
    struct host_sim_event e = {.kind = draw_kind(r)};
    const struct host_sim_kind *kind = &host_sim_kinds[e.kind];
    e.lasts_us = host_sim_draw_log(&r->random, 1000, r->plan->lasts_us_max);
    e.until_us = w->now_us + e.lasts_us;
    e.node = (unsigned)draw(r, 0, w->nodes - 1);
    e.wire = (unsigned)draw(r, 0, w->cube.wires - 1);
    e.side = (unsigned)draw(r, 0, 1);
    e.link = (unsigned)draw(r, 0, w->cube.options.dimension);
    bool lasts = kind->take_back != NULL;
    if (!r->plan->wanted[e.kind] ||
        (lasts && r->lasting_count == HOST_SIM_LASTING_MAX) ||
        !kind->happen(r, &e))
        return false;
    if (lasts)
        r->lasting[r->lasting_count++] = e;
    r->happened[e.kind] += r->open;
    return true;
}

static bool any_event_wanted(const struct host_sim_plan *plan) {
    bool any = false;
    for (int k = 0; k < HOST_SIM_FAULTS; k++)
        any = any || (plan->wanted[k] && host_sim_kinds[k].happen != NULL);
    return any;
}

static void break_for_good(struct host_sim_run *r) {
    r->broken = true;
    for (int k = 0; k < HOST_SIM_FAULTS; k++) {
        if (r->plan->wanted[k] && host_sim_kinds[k].break_for_good != NULL) {
            host_sim_kinds[k].break_for_good(r);
            r->happened[k] += r->open;
        }
    }
}

static void event(struct host_sim_run *r) {
    bool more = any_event_wanted(r->plan) && r->events > 0;
    if (!r->broken)
        break_for_good(r);
    for (unsigned tries = 0; more && tries < TRIES_MAX; tries++)
        if (happen(r))
            break;
    r->events -= more;
    r->event_us =
        !more ? UINT64_MAX
              : r->world.now_us + draw(r, 1, 2 * (uint64_t)r->plan->gap_us);
}

/* It comes when the first host knows node 0 as it is now. */
static void second_host(struct host_sim_run *r) {
    struct host_world *w = &r->world;
    const struct host_world_node *node = &w->node[0];
    if (node->state != HOST_WORLD_UP ||
        r->service.node[0].start != node->board.identity.epoch) {
        r->second_us = w->now_us + SECOND_AGAIN_US;
        return;
    }
    r->second_us = UINT64_MAX;
    host_second_host_come(&r->second, w, w->now_us + r->plan->second_lasts_us,
                          w->options.host_us);
    r->happened[HOST_SIM_SECOND_HOST] += r->open;
}

static uint64_t sooner(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

/* What comes in its time, whatever the weather. */
static uint64_t arrivals_us(const struct host_sim_run *r) {
    return sooner(r->second_us, host_sim_stand_ins_us(r));
}

static void calm(struct host_sim_run *r) {
    struct host_world *w = &r->world;
    take_back(r, true);
    weather(r, false);
    w->strike_us = arrivals_us(r);
    if (w->options.host_us > HOST_US_CALM)
        w->options.host_us = HOST_US_CALM;
}

void host_sim_faults_strike(void *run) {
    struct host_sim_run *r = run;
    struct host_world *w = &r->world;
    if (r->crash_due) {
        r->crash_due = false;
        host_world_crash(w, r->plan->restart_node, REBOOT_US, false);
    }
    take_back(r, false);
    if (w->now_us >= r->second_us)
        second_host(r);
    host_sim_stand_ins_strike(r);
    if (w->now_us >= r->calm_us) {
        calm(r);
        return;
    }
    if (w->now_us >= r->event_us)
        event(r);
    w->strike_us = sooner(sooner(r->calm_us, r->event_us), arrivals_us(r));
    for (unsigned i = 0; i < r->lasting_count; i++)
        w->strike_us = sooner(w->strike_us, r->lasting[i].until_us);
}

/* The frame that the plan names meets its fate. */
static enum sim_fate decide(void *context, struct sim_direction *direction) {
    struct host_sim_run *r = context;
    (void)direction;
    if (++r->frames != r->plan->frame)
        return SIM_PASSES;
    r->crash_due = r->plan->restart;
    r->world.strike_us = r->plan->restart ? 0 : r->world.strike_us;
    return r->plan->fate;
}

/* All frames are counted, or those alone that the node to restart sends. */
static void watch_frames(struct host_sim_run *r) {
    struct host_sim_cube *cube = &r->world.cube;
    unsigned node = r->plan->restart_node;
    if (r->plan->frame == 0)
        return;
    for (unsigned i = 0; i < 2 * cube->wires; i++) {
        struct sim_direction *direction =
            host_sim_cube_direction(cube, i / 2, i % 2);
        direction->decide = r->plan->restart ? NULL : decide;
        direction->context = r;
    }
    for (unsigned d = 0; r->plan->restart && d < r->world.node[node].links; d++)
        host_sim_cube_port(cube, node, d)->end->out->decide = decide;
}

void host_sim_faults_prepare(struct host_sim_run *run) {
    const struct host_sim_plan *p = run->plan;
    /* Early weather ends too, while there is patience left to come up. */
    uint64_t patience = p->patience_us != 0 ? p->patience_us : HOST_PATIENCE_US;
    run->calm_us = p->calm_us < patience / 2 ? p->calm_us : patience / 2;
    run->event_us = run->second_us = UINT64_MAX;
    host_sim_stand_ins_prepare(run);
    run->world.strike_us = sooner(run->calm_us, arrivals_us(run));
    weather(run, p->early);
    watch_frames(run);
}

void host_sim_faults_begin(struct host_sim_run *run) {
    struct host_sim_run *r = run;
    uint64_t now_us = r->world.now_us;
    r->open = true;
    r->calm_us = now_us + r->plan->calm_us;
    r->event_us = now_us + draw(r, 1, r->plan->gap_us);
    r->events = r->plan->events_max;
    r->second_us = r->plan->wanted[HOST_SIM_SECOND_HOST]
                       ? now_us + r->plan->second_us
                       : UINT64_MAX;
    for (int k = 0; k < SIM_CHANCES; k++)
        r->before[k] = host_sim_cube_struck(&r->world.cube, (enum sim_fault)k);
    host_sim_stand_ins_begin(r);
    weather(r, true);
    r->world.strike_us = sooner(r->event_us, arrivals_us(r));
}

void host_sim_faults_finish(struct host_sim_run *run) {
    for (int k = 0; k < HOST_SIM_FAULTS; k++) {
        const struct host_sim_kind *kind = &host_sim_kinds[k];
        run->outcome->struck[k] = kind->count != NULL
                                      ? kind->count(run, (enum host_sim_fault)k)
                                      : run->happened[k];
    }
    run->open = false;
    run->second_us = UINT64_MAX;
    host_sim_stand_ins_finish(run);
}
