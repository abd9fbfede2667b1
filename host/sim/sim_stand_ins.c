#include "sim_stand_ins.h"

#include "sim_draw.h"
#include "transport/wiring.h"

enum { REPLACE_US = 3000, FOREIGN_DEAD_MAX = 2 };

/* --- how they are drawn --------------------------------------------------- */

/* A node that answers and never works has no part in the work any more; its
 * links go on.  Node 0 must keep to its host for a second one to be sent away:
 * nothing takes its place then. */
void host_sim_draw_idler(struct host_sim_plan *plan) {
    struct host_sim_plan *p = plan;
    uint64_t state = sim_seed(p->seed, 82);
    unsigned first = p->wanted[HOST_SIM_SECOND_HOST];
    bool node = p->wanted[HOST_SIM_DEAD_NODE];
    /* A dead node and a dead wire may cut off another two of four. */
    unsigned needed = node && p->wanted[HOST_SIM_DEAD_WIRE] ? 8 : 2 + node;
    if (p->nodes < needed || p->nodes > 64 || host_sim_draw(&state, 1, 6) > 1) {
        return;
    }
    p->wanted[HOST_SIM_IDLER] = true;
    if (p->patience_us == 0) {
        p->patience_us = host_sim_draw(&state, 10000000, 30000000);
    }
    p->idler.node = (unsigned)host_sim_draw(&state, first, p->nodes - 1);
    p->idler.us = host_sim_draw(&state, 1, 3) == 1
                      ? 0
                      : host_sim_draw_log(&state, 1000, 300000);
    p->idler_ready = host_sim_draw(&state, 1, 4) > 1;
}

/* Where the counting of generations may go wrong: at the ends of their 16 and
 * 32 bits, and in jumps of half the smaller. */
static void draw_generation(struct host_sim_plan *p, uint64_t *state) {
    static const uint32_t ends[] = {0x7fff,  0x8000,     0xffff,
                                    0x10000, 0xffff8000, UINT32_MAX};
    static const uint32_t jumps[] = {0x7fff,  0x8000,     0x8001,    0xffff,
                                     0x10000, 0x7fff8000, 0x80008000};
    enum { ENDS = sizeof ends / sizeof ends[0] };
    enum { JUMPS = sizeof jumps / sizeof jumps[0] };
    p->foreign_jumps = host_sim_draw(state, 1, 2) == 1;
    p->foreign = p->foreign_jumps ? jumps[host_sim_draw(state, 0, JUMPS - 1)]
                                  : ends[host_sim_draw(state, 0, ENDS - 1)] -
                                        (uint32_t)host_sim_draw(state, 0, 2);
    if (host_sim_draw(state, 1, 8) == 1) {
        p->foreign = (uint32_t)(sim_draw(state) >> 32);
    }
}

/* The wiring of a host that was there before. */
void host_sim_draw_teller(struct host_sim_plan *plan) {
    struct host_sim_plan *p = plan;
    uint64_t state = sim_seed(p->seed, 83);
    unsigned first = p->wanted[HOST_SIM_SECOND_HOST];
    if (p->nodes > 64 || first >= p->nodes || host_sim_draw(&state, 1, 6) > 1) {
        return;
    }
    p->wanted[HOST_SIM_FOREIGN] = true;
    p->teller.node = (unsigned)host_sim_draw(&state, first, p->nodes - 1);
    p->teller.us = host_sim_draw(&state, 1, 2) == 1
                       ? 0
                       : host_sim_draw_log(&state, 1000, 300000);
    p->teller.lasts_us = host_sim_draw_log(&state, 10000, 1000000);
    draw_generation(p, &state);
}

/* --- when they come and go ------------------------------------------------ */

static void idler_comes(struct host_sim_run *r) {
    struct host_stand_in_orders orders = {.kind = HOST_IDLER,
                                          .ready = r->plan->idler_ready};
    host_world_replace(&r->world, r->plan->idler.node, REPLACE_US, &orders);
    r->idler_us = UINT64_MAX;
    r->happened[HOST_SIM_IDLER]++;
}

static void teller_comes(struct host_sim_run *r) {
    const struct host_sim_plan *p = r->plan;
    unsigned dimension = r->world.cube.options.dimension;
    uint64_t state = sim_seed(p->seed, 84);
    struct host_stand_in_orders orders = {.kind = HOST_TELLER};
    struct cube_wiring *w = &orders.wiring;
    w->generation = p->foreign;
    if (p->foreign_jumps) {
        w->generation += r->open ? cube_wiring(r->service.cube)->generation : 1;
    }
    w->generation += w->generation == 0;
    w->host_epoch = (uint32_t)(sim_draw(&state) >> 32);
    for (uint64_t i = host_sim_draw(&state, 0, FOREIGN_DEAD_MAX);
         i > 0 && dimension > 0; i--) {
        struct cube_dead dead = {
            (uint16_t)host_sim_draw(&state, 0, p->nodes - 1),
            (uint8_t)host_sim_draw(&state, 0, dimension - 1)};
        (void)wiring_add_dead(w, dead, dimension);
    }
    wiring_settle(w, dimension);
    host_world_replace(&r->world, p->teller.node, REPLACE_US, &orders);
    r->teller_us = r->world.now_us + p->teller.lasts_us;
    r->telling = true;
}

static void teller_goes(struct host_sim_run *r) {
    unsigned node = r->plan->teller.node;
    const struct host_world_node *n = &r->world.node[node];
    if (n->state == HOST_WORLD_UP && n->stand_in != NULL) {
        r->happened[HOST_SIM_FOREIGN] += host_stand_in_told(n->stand_in);
    }
    host_world_replace(&r->world, node, REPLACE_US, NULL);
    r->teller_us = UINT64_MAX;
    r->telling = false;
}

void host_sim_stand_ins_prepare(struct host_sim_run *run) {
    const struct host_sim_plan *p = run->plan;
    run->idler_us = run->teller_us = UINT64_MAX;
    if (p->wanted[HOST_SIM_IDLER] && p->idler.us == 0) {
        idler_comes(run);
    }
    if (p->wanted[HOST_SIM_FOREIGN] && p->teller.us == 0) {
        teller_comes(run);
    }
}

void host_sim_stand_ins_begin(struct host_sim_run *run) {
    const struct host_sim_plan *p = run->plan;
    if (p->wanted[HOST_SIM_IDLER] && p->idler.us > 0) {
        run->idler_us = run->world.now_us + p->idler.us;
    }
    if (p->wanted[HOST_SIM_FOREIGN] && p->teller.us > 0) {
        run->teller_us = run->world.now_us + p->teller.us;
    }
}

void host_sim_stand_ins_finish(struct host_sim_run *run) {
    run->idler_us = UINT64_MAX;
    run->teller_us = run->telling ? run->teller_us : UINT64_MAX;
}

uint64_t host_sim_stand_ins_us(const struct host_sim_run *run) {
    return run->idler_us < run->teller_us ? run->idler_us : run->teller_us;
}

void host_sim_stand_ins_strike(struct host_sim_run *run) {
    if (run->world.now_us >= run->idler_us) {
        idler_comes(run);
    }
    if (run->world.now_us >= run->teller_us) {
        if (run->telling) {
            teller_goes(run);
        } else {
            teller_comes(run);
        }
    }
}
