#include "sim_plan.h"

#include <string.h>

#include "host/mesh/points.h"
#include "host/service/strategies/strategies.h"
#include "sim_draw.h"

/* A slow wire does not wake its node for every byte. */
enum {
    FIFO_BYTES = 64,
    SPHERE_MAX = 150 /* points of that kind on a large cube */
};

/* Numbers of nodes, by weight. */
static const struct {
    unsigned dimension, weight;
} cubes[] = {{0, 60}, {1, 130}, {2, 260}, {3, 275}, {4, 173}, {5, 80},
             {6, 16}, {7, 3},   {8, 1},   {9, 1},   {10, 1}};

static uint64_t draw(uint64_t *state, uint64_t lo, uint64_t hi) {
    return host_sim_draw(state, lo, hi);
}

static bool one_in(uint64_t *state, unsigned n) {
    return draw(state, 1, n) == 1;
}

static unsigned draw_nodes(uint64_t *state) {
    uint64_t at = draw(state, 0, 999);
    unsigned i = 0;
    while (at >= cubes[i].weight)
        at -= cubes[i++].weight;
    return 1u << cubes[i].dimension;
}

static bool is_refused(const struct host_strategy *row, unsigned nodes,
                       const struct host_sharing *sharing,
                       enum incode_face_rule rule) {
    struct host_error error = {0};
    return host_strategy_check(row, nodes, sharing, rule, INCODE_BUILD_AUTO,
                               &error) != 0;
}

/* Of the strategies that keep to one node, or of the others, one at random that
 * goes with so many; NULL: there is none. */
static const struct host_strategy *draw_row(uint64_t *state, unsigned nodes,
                                            bool one_node) {
    static const struct host_sharing usual;
    const struct host_strategy *row, *drawn = NULL;
    unsigned rows = 0;
    for (unsigned i = 0; (row = host_strategy_row(i)) != NULL; i++) {
        rows += (row->nodes_default == 1) == one_node &&
                !is_refused(row, nodes, &usual, INCODE_FACE_OWN);
    }
    uint64_t left = rows == 0 ? 0 : draw(state, 1, rows);
    for (unsigned i = 0; left > 0; i++) {
        drawn = host_strategy_row(i);
        left -= (drawn->nodes_default == 1) == one_node &&
                !is_refused(drawn, nodes, &usual, INCODE_FACE_OWN);
    }
    return drawn;
}

/* One that keeps to one node is drawn seldom: most of a cube idles under it. */
static const struct host_strategy *draw_strategy(const struct host_sim_plan *p,
                                                 bool one_node) {
    uint64_t state = sim_seed(p->seed, 81);
    const struct host_strategy *row = draw_row(&state, p->nodes, one_node);
    return row != NULL ? row : draw_row(&state, p->nodes, !one_node);
}

/* What the strategy heeds and does not refuse; from a state of its own. */
static void draw_sharing(struct host_sim_plan *p) {
    uint64_t state = sim_seed(p->seed, 87);
    struct host_sharing s = {0};
    unsigned heeds = p->strategy->sharing;
    if ((heeds & HOST_SHARING_CLUSTER) != 0 && one_in(&state, 2))
        s.cluster = 1u << draw(&state, 1, 5);
    if ((heeds & HOST_SHARING_BUILDERS) != 0 && one_in(&state, 3))
        s.builders = (unsigned)draw(&state, 1, p->nodes);
    if ((heeds & HOST_SHARING_LISTS) != 0 && one_in(&state, 2)) {
        s.faces_per_job = (unsigned)host_sim_draw_log(&state, 1, 96);
        s.jobs_per_worker = (unsigned)draw(&state, 1, 4);
    }
    if (is_refused(p->strategy, p->nodes, &s, INCODE_FACE_OWN))
        s.cluster = s.builders = 0;
    if (is_refused(p->strategy, p->nodes, &s, p->face_rule))
        p->face_rule = INCODE_FACE_OWN;
    p->sharing = s;
}

/* From a state of its own: what else a seed stands for does not change. */
static enum incode_build draw_build(const struct host_sim_plan *p) {
    uint64_t state = sim_seed(p->seed, 85);
    return (enum incode_build)draw(&state, INCODE_BUILD_AUTO,
                                   INCODE_BUILD_POINTS);
}

static void draw_work(struct host_sim_plan *p, uint64_t *state) {
    static const char *const kinds[] = {"uniform", "bubbles", "bluntfin",
                                        "sphere",  "grid",    "rotated",
                                        "hub",     "uniform"};
    p->kind = kinds[draw(state, 0, 7)];
    p->strategy = draw_strategy(p, one_in(state, 6));
    p->partition = one_in(state, 3) ? HOST_UNIFORM : HOST_ADAPTIVE;
    p->index = one_in(state, 8) && p->nodes <= 64 ? INCODE_NAIVE
               : one_in(state, 6)                 ? INCODE_GRID
                                                  : INCODE_KD;
    p->face_rule = one_in(state, 3) ? INCODE_FACE_PAPER : INCODE_FACE_OWN;
    p->build = draw_build(p);
    draw_sharing(p);
    p->shuffle_seed = one_in(state, 2) ? sim_draw(state) : 0;
    uint64_t most = p->nodes > 64             ? 600
                    : p->index == INCODE_KD   ? 3000
                    : p->index == INCODE_GRID ? 1000
                                              : 300;
    p->points = host_sim_draw_log(state, 30, most);
    if (p->nodes > 64 && strcmp(p->kind, "sphere") == 0 &&
        p->points > SPHERE_MAX)
        p->points = SPHERE_MAX; /* every node asks for nearly all */
    if (p->wanted[HOST_SIM_TINY] && p->nodes <= 8) {
        /* What the least memory does not hold. */
        p->index = INCODE_KD;
        p->points = draw(state, 2500, 4500);
    }
}

static void draw_wire(struct sim_quality *q, uint64_t *state, bool fast) {
    q->bytes_per_s = one_in(state, 5)
                         ? 0
                         : (uint32_t)host_sim_draw_log(
                               state, fast ? 4000000 : 60000, 100000000);
    q->latency_us = (uint32_t)host_sim_draw_log(state, 1, fast ? 50 : 3000);
    q->room = (uint32_t)host_sim_draw_log(state, 300, 32768);
    q->bytes = q->room + (uint32_t)host_sim_draw_log(state, 2048, 32768);
    q->bytes = q->bytes < SIM_BYTES_MIN ? SIM_BYTES_MIN : q->bytes;
}

static void draw_cube(struct host_sim_plan *p, uint64_t *state) {
    bool large = p->nodes > 64;
    p->window = one_in(state, 3) ? 0 : (unsigned)draw(state, 1, large ? 3 : 8);
    p->host_window = one_in(state, 2) ? 0 : (unsigned)draw(state, 1, 32);
    p->memory_more = p->wanted[HOST_SIM_TINY] || large
                         ? draw(state, 0, 8) * 1024
                         : host_sim_draw_log(state, 16384, 1 << 20);
    bool fast = large || p->wanted[HOST_SIM_TINY];
    draw_wire(&p->wire, state, fast);
    draw_wire(&p->host_wire, state, fast || p->nodes > 16);
    if (p->wanted[HOST_SIM_SLOW_HOST] && p->wanted[HOST_SIM_TINY]) {
        /* Many pages, and what a round of the host sends is what it has room
         * for: more than a few bytes. */
        p->host_wire.room += 8192;
        p->host_wire.bytes += 8192;
    }
    p->gather_us = (uint32_t)host_sim_draw_log(state, 1, 500);
    uint64_t slow = p->wire.bytes_per_s == 0 ? UINT32_MAX : p->wire.bytes_per_s;
    if (p->gather_us < FIFO_BYTES * UINT64_C(1000000) / slow)
        p->gather_us = (uint32_t)(FIFO_BYTES * UINT64_C(1000000) / slow);
    p->step_us = (uint32_t)host_sim_draw_log(state, 5, 1000);
    p->host_us = p->wanted[HOST_SIM_SLOW_HOST]
                     ? (uint32_t)host_sim_draw_log(state, 500, 5000)
                     : (uint32_t)host_sim_draw_log(state, 2, 200);
}

static void draw_faults(struct host_sim_plan *p, uint64_t *state) {
    struct sim_faults *w = &p->weather;
    bool large = p->nodes > 64;
    double worst = large ? 0.02 : 0.3;
    double part = (double)draw(state, 1, 1000) * 1e-3;
    for (int k = 0; k < SIM_CHANCES; k++) {
        uint64_t one = host_sim_draw_log(state, 1500, large ? 100000 : 30000);
        w->chance[k] = p->wanted[k] ? 1 / (double)one : 0;
    }
    w->chance[SIM_LOSS] = p->wanted[SIM_LOSS] ? worst * part * part : 0;
    w->chance[SIM_FLIP] /= 8;
    w->chance[SIM_STALL] /= 4;
    w->chance[SIM_BURST] /= 4;
    w->burst_bytes = (uint32_t)host_sim_draw_log(state, 2, 2000);
    w->stall_us = (uint32_t)host_sim_draw_log(state, 1000, 1000000);
    p->early = one_in(state, 2);
    p->gap_us = (uint32_t)host_sim_draw_log(state, 3000, 300000);
    p->lasts_us_max = (uint32_t)host_sim_draw_log(state, 5000, 2000000);
    p->events_max = (unsigned)draw(state, 1, large ? 4 : 24);
    p->calm_us = host_sim_draw_log(state, 200000, 20000000);
}

void host_sim_plan_draw(struct host_sim_plan *plan, uint64_t seed,
                        unsigned nodes) {
    uint64_t state = sim_seed(seed, 77);
    memset(plan, 0, sizeof *plan);
    plan->seed = seed;
    plan->nodes_given = nodes;
    plan->nodes = draw_nodes(&state);
    plan->nodes = nodes != 0 ? nodes : plan->nodes;
    for (int k = 0; k < HOST_SIM_FAULTS; k++) {
        unsigned n = host_sim_kinds[k].one_in;
        plan->wanted[k] = n > 0 && one_in(&state, n);
    }
    draw_work(plan, &state);
    draw_cube(plan, &state);
    draw_faults(plan, &state);
    for (int k = 0; k < HOST_SIM_FAULTS; k++)
        if (host_sim_kinds[k].draw != NULL)
            host_sim_kinds[k].draw(plan);
}

void host_sim_plan_print(FILE *file, const struct host_sim_plan *plan) {
    fprintf(file, "%llu points %s, %u node%s, %s, %s, %s, %s, %s;",
            (unsigned long long)plan->points, plan->kind, plan->nodes,
            plan->nodes == 1 ? "" : "s", plan->strategy->name,
            host_partitions[plan->partition], host_indexes[plan->index],
            host_face_rules[plan->face_rule], host_builds[plan->build]);
    if (plan->wanted[HOST_SIM_LIAR]) {
        fprintf(file, " node %u lies (%s, 1 in %u);", plan->liar.node,
                host_lies[plan->liar.way], plan->liar.one_in);
    }
    if (plan->wanted[HOST_SIM_SMALL_HOST]) {
        fprintf(file, " host memory %lluK;",
                (unsigned long long)plan->host_memory >> 10);
    }
}
