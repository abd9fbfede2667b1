#include "sim_boot.h"

#include <string.h>

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
    if (n->node == NULL && n->stand_in == NULL) {
        host_world_give_up(w, i, why);
    }
}

void host_sim_learn(struct host_world *world, unsigned node) {
    struct host_world *w = world;
    unsigned i = node;
    struct host_world_node *n = &w->node[i];
    struct node_identity heard = n->board.identity;
    node_identity_ask(&n->learner, n->board.now_us(n));
    if (!node_identity_hear(&n->learner, &heard)) {
        return;
    }
    if (heard.self != i || heard.dimension != n->board.identity.dimension ||
        heard.host_port != n->board.identity.host_port) {
        host_world_give_up(w, i, "takes itself for another");
    }
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
