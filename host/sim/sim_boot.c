#include <stdio.h>
#include <string.h>

#include "sim_world.h"
#include "second_host.h"
#include "sim_draw.h"

static void start(struct host_world *w, unsigned i) {
    struct host_world_node *n = &w->node[i];
    const char *why = NULL;
    n->learning = false;
    if (n->orders.kind != HOST_NO_STAND_IN) {
        n->stand_in = host_stand_in_start(&n->board, &n->orders);
        why = "the memory does not hold a stand-in";
    } else {
        n->node = node_start(&n->board, &why);
    }
    if (n->node == NULL && n->stand_in == NULL)
        host_world_give_up(w, i, why);
}

void host_sim_learn(struct host_world *world, unsigned node) {
    struct host_world *w = world;
    unsigned i = node;
    struct host_world_node *n = &w->node[i];
    struct node_identity heard = n->board.identity;
    node_identity_ask(&n->learner, n->board.now_us(n));
    if (!node_identity_hear(&n->learner, &heard))
        return;
    if (heard.self != i || heard.dimension != n->board.identity.dimension ||
        heard.host_port != n->board.identity.host_port)
        host_world_give_up(w, i, "takes itself for another");
    w->learned += node_identity_epoch_behind(&n->learner, &n->board.identity);
    start(w, i);
}

void host_sim_boot(struct host_world *world, unsigned node) {
    struct host_world *w = world;
    unsigned i = node;
    struct host_world_node *n = &w->node[i];
    n->offset_us = sim_draw(&w->random) >> 24;
    if (w->options.used_ns == NULL) {
        memset(n->board.arena, (int)(sim_draw(&w->random) >> 32 & 0xff),
               n->board.arena_bytes);
    }
    n->used_ns = 0;
    n->board.identity.epoch = w->epoch++;
    n->starts++;
    n->state = HOST_WORLD_UP;
    n->node = NULL;
    n->stand_in = NULL;
    n->learning = w->options.bare;
    if (n->learning) {
        unsigned dimension = w->options.cube.dimension;
        node_identity_listen_ports(&n->learner, &n->board, dimension,
                                   n->links > dimension);
    } else {
        start(w, i);
    }
}

/* --- second host ---------------------------------------------------------- */

/* --- its machine ---------------------------------------------------------- */

/* The world's clock goes on without it. */
static uint64_t machine_now_us(void *context) {
    const struct host_second_host *h = context;
    return h->world->now_us + h->ahead_us;
}

static void machine_idle(void *context, uint64_t wait_us) {
    struct host_second_host *h = context;
    if (h->there)
        h->sleep_us = h->world->now_us + wait_us;
    else
        h->ahead_us += wait_us + 1;
}

static int machine_check(void *context, struct host_error *error) {
    (void)context, (void)error;
    return 0;
}

static void machine_rest(void *context, uint64_t rest_us) {
    struct host_second_host *h = context;
    host_world_rest(h->world, rest_us);
}

static bool machine_ended(void *context) {
    (void)context;
    return true;
}

static void machine_stop(void *context) {
    (void)context;
}

/* --- rounds --------------------------------------------------------------- */

void host_second_host_come(struct host_second_host *host,
                           struct host_world *world, uint64_t leave_us,
                           uint32_t host_us) {
    struct host_second_host *h = host;
    struct host_error error = {0};
    h->world = world;
    h->leave_us = leave_us;
    h->host_us = host_us;
    h->random = sim_seed(world->options.cube.seed, 3);
    h->machine = host_world_machine(world);
    h->machine.context = h;
    h->machine.pipe = host_sim_cube_pipe(&world->cube, world->nodes + 1, 0);
    h->machine.now_us = machine_now_us;
    h->machine.idle = machine_idle;
    h->machine.check = machine_check;
    h->machine.rest = machine_rest;
    h->machine.ended = machine_ended;
    h->machine.stop = machine_stop;
    h->service.machine = &h->machine;
    h->there = true;
    host_world_second_host(world, true);
    if (host_service_open(&h->service, &error) != 0) {
        snprintf(h->fault, sizeof h->fault, "%.250s", error.text);
        host_second_host_leave(h);
    }
}

void host_second_host_leave(struct host_second_host *host) {
    if (host->there) {
        host->there = false;
        host_world_second_host(host->world, false);
        host_service_end(&host->service);
    }
}

/* Nobody answers it, and it is not given the cube. */
static bool let_in(const struct host_second_host *h) {
    return h->service.up > 0 ||
           cube_link_statistics(h->service.cube, 0)->sessions > 0;
}

void host_second_host_round(void *host) {
    struct host_second_host *h = host;
    struct host_world *w = h->world;
    struct host_error error = {0};
    if (!h->there)
        return;
    if (w->now_us < h->busy_us) {
        w->second_us = h->busy_us;
        return;
    }
    h->busy_us = w->now_us + host_sim_draw(&h->random, 1, 2 * h->host_us);
    h->sleep_us = 0;
    int status = host_service_round(&h->service, &error);
    bool in_use = status == HOST_CUBE && h->service.in_use.since_us != 0;
    unsigned refused = cube_link_peer(h->service.cube, 0)->in_use;
    h->refused_us = refused != h->refused ? w->now_us : h->refused_us;
    h->refused = refused;
    if (let_in(h)) {
        snprintf(h->fault, sizeof h->fault, "a second host got in");
    } else if (status != 0 && !in_use) {
        snprintf(h->fault, sizeof h->fault, "a second host: %.230s",
                 error.text);
    }
    if (status != 0 || w->now_us >= h->leave_us || h->fault[0] != '\0') {
        host_second_host_leave(h);
        return;
    }
    uint64_t due = host_world_host_due(w, 1);
    due = h->sleep_us < due ? h->sleep_us : due;
    due = h->leave_us < due ? h->leave_us : due;
    w->second_us = h->busy_us > due ? h->busy_us : due;
}
