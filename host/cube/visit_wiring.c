#include "visit_wiring.h"

#include <string.h>

#include "transport/wiring.h"

enum {
    NEWS_US = 300000,    /* after the last: more may come at once */
    ALIVE_US = 2000000,  /* of a generation, until pongs count as a sign that a
                            dead link is alive: its ends may not know yet */
    SILENT_US = 1500000, /* a link that its node calls silent; it may be busy */
    PAUSE_US = 500000,   /* between two generations, and twice as long each */
    PAUSE_US_MAX = 8000000, /* time that they follow at once */
    REST_US = 20000000,     /* without any, and the pause is short again */
    WRONG_US = 10000000,    /* wrong wires are looked for anew */
    WIRE_US = 4000000       /* down, and the other wire of the host's is used */
};

static uint32_t bit_of(unsigned link) {
    return (uint32_t)1 << link;
}

unsigned host_visit_wire(const struct host_visit *visit) {
    uint16_t gateway = cube_wiring(visit->cube)->gateway;
    return gateway != 0 && gateway == visit->machine->spare_node ? 1 : 0;
}

void host_visit_wiring_begin(struct host_visit *visit) {
    struct host_visit *v = visit;
    v->generation = cube_wiring(v->cube)->generation;
    v->began_us = v->evidence_us = v->now_us;
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        struct host_visit_node *node = &v->node[i];
        node->who_due = !node->there;
        node->who_again_us = 0;
        node->ping_due = true;
        node->question_due = host_node_set_has(&v->wanted, i);
        node->pong_us = node->silent_us = 0;
        node->seen = node->silent = node->received = 0;
    }
}

/* --- what is dead --------------------------------------------------------- */

static void add(struct host_visit *v, uint32_t *dead, unsigned node,
                unsigned link) {
    if (node < v->machine->nodes && link < v->machine->dimension) {
        dead[node] |= bit_of(link);
        dead[node ^ 1u << link] |= bit_of(link);
    }
}

/* What nodes have found since this generation began. */
static void add_found(struct host_visit *v, uint32_t *dead) {
    const struct cube_wiring *w = cube_wiring(v->cube);
    for (unsigned i = w->settled; i < w->dead_count; i++) {
        if (w->dead[i].dimension != CUBE_WHOLE_NODE) {
            add(v, dead, w->dead[i].node, w->dead[i].dimension);
        }
    }
    for (unsigned i = 0; i < v->wrong_count; i++) {
        add(v, dead, v->wrong[i].node, v->wrong[i].link);
    }
}

/* What nodes call silent for long enough. */
static void add_silent(struct host_visit *v, uint32_t *dead) {
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        const struct host_visit_node *node = &v->node[i];
        for (unsigned d = 0; d < v->machine->dimension; d++) {
            if ((node->silent & bit_of(d)) != 0 &&
                v->now_us - node->silent_us >= SILENT_US) {
                add(v, dead, i, d);
            }
        }
    }
}

/* What an end of a link says of it: 1 alive, -1 not, 0 nothing yet. */
static int says(const struct host_visit *v, unsigned node, unsigned link) {
    const struct host_visit_node *n = &v->node[node];
    if (n->pong_us == 0 || n->pong_us - v->began_us < ALIVE_US) {
        return 0;
    }
    return (n->seen & ~n->silent & bit_of(link)) != 0 ? 1 : -1;
}

static bool is_wrong(const struct host_visit *v, unsigned node, unsigned link) {
    for (unsigned i = 0; i < v->wrong_count; i++) {
        if (v->wrong[i].node == node && v->wrong[i].link == link) {
            return true;
        }
    }
    return false;
}

/* Whether a link that was dead is still: nobody says that it is alive, or an
 * end says that it is not. */
static bool stays_dead(const struct host_visit *v, unsigned node,
                       unsigned link) {
    unsigned other = node ^ 1u << link;
    int one = says(v, node, link), two = says(v, other, link);
    return one < 0 || two < 0 || (one == 0 && two == 0) ||
           is_wrong(v, node, link) || is_wrong(v, other, link);
}

/* By all that is known now. */
static void find_dead(struct host_visit *v, uint32_t *dead) {
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        dead[i] = 0;
        for (unsigned d = 0; d < v->machine->dimension; d++) {
            if ((v->dead[i] & bit_of(d)) != 0 && stays_dead(v, i, d)) {
                dead[i] |= bit_of(d);
            }
        }
    }
    add_found(v, dead);
    add_silent(v, dead);
}

/* --- another generation --------------------------------------------------- */

/* A node of which nothing is heard, and two or more links of which are dead, is
 * so as a whole, where nobody knows of a link to it that is not: the wiring has
 * room for few. */
static bool is_whole(const struct host_visit *v, const uint32_t *dead,
                     unsigned node) {
    bool whole = v->node[node].pong_us == 0 &&
                 node != cube_wiring(v->cube)->gateway &&
                 __builtin_popcount(dead[node]) >= 2;
    for (unsigned d = 0; d < v->machine->dimension; d++) {
        whole = whole && ((dead[node] & bit_of(d)) != 0 ||
                          v->node[node ^ 1u << d].pong_us == 0);
    }
    return whole;
}

/* All links of such nodes: what is said of one brings it back. */
static void add_whole(struct host_visit *v, uint32_t *dead, bool *whole) {
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        whole[i] = is_whole(v, dead, i);
    }
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        for (unsigned d = 0; whole[i] && d < v->machine->dimension; d++) {
            add(v, dead, i, d);
        }
    }
}

static void settle(struct host_visit *v, uint32_t *dead,
                   struct cube_wiring *next) {
    unsigned dimension = v->machine->dimension;
    bool whole[HOST_NODES_MAX];
    add_whole(v, dead, whole);
    next->dead_count = next->settled = 0;
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        if (whole[i]) {
            struct cube_dead node = {(uint16_t)i, CUBE_WHOLE_NODE};
            (void)wiring_add_dead(next, node, dimension);
        }
    }
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        for (unsigned d = 0; d < dimension; d++) {
            struct cube_dead link = {(uint16_t)i, (uint8_t)d};
            unsigned other = i ^ 1u << d;
            if (i < other && (dead[i] & bit_of(d)) != 0 && !whole[i] &&
                !whole[other]) {
                (void)wiring_add_dead(next, link, dimension);
            }
        }
    }
}

/* The gateway's wire is down, and the other one works. */
static uint16_t choose_gateway(struct host_visit *v) {
    unsigned wire = host_visit_wire(v);
    uint16_t gateway = cube_wiring(v->cube)->gateway;
    enum link_state state = cube_link_state(v->cube, wire);
    if (v->machine->spare_node == 0 || state == LINK_UP) {
        v->wire_us = v->now_us;
        return gateway;
    }
    bool other = cube_link_state(v->cube, 1 - wire) == LINK_UP;
    return !other || v->now_us - v->wire_us < WIRE_US ? gateway
           : gateway == 0                             ? v->machine->spare_node
                                                      : 0;
}

static void begin(struct host_visit *v, uint32_t *dead, uint16_t gateway) {
    struct cube_wiring next = *cube_wiring(v->cube);
    next.gateway = gateway;
    next.absent_s = HOST_VISIT_ABSENT_S;
    settle(v, dead, &next);
    v->pause_us = v->now_us - v->renewed_us > REST_US ? PAUSE_US
                  : v->pause_us < PAUSE_US_MAX / 2    ? 2 * v->pause_us
                                                      : PAUSE_US_MAX;
    v->renewed_us = v->wire_us = v->now_us;
    memcpy(v->dead, dead, v->machine->nodes * sizeof *v->dead);
    cube_renew(v->cube, &next);
    host_visit_wiring_begin(v);
}

void host_visit_wiring_renew(struct host_visit *visit) {
    uint32_t dead[HOST_NODES_MAX];
    find_dead(visit, dead);
    begin(visit, dead, choose_gateway(visit));
}

/* The wiring keeps its wrong wires for as long as a generation lasts, and a new
 * one has none for a moment. */
static void look_for_wrong(struct host_visit *v) {
    const struct cube_wiring *w = cube_wiring(v->cube);
    if (w->wrong_count > 0 || v->now_us - v->began_us > NEWS_US) {
        memcpy(v->wrong, w->wrong, w->wrong_count * sizeof w->wrong[0]);
        v->wrong_count = w->wrong_count;
    }
}

void host_visit_wiring_look(struct host_visit *visit) {
    struct host_visit *v = visit;
    uint32_t dead[HOST_NODES_MAX];
    uint16_t gateway = choose_gateway(v);
    look_for_wrong(v);
    find_dead(v, dead);
    bool same = gateway == cube_wiring(v->cube)->gateway &&
                memcmp(dead, v->dead, v->machine->nodes * sizeof *v->dead) == 0;
    bool again = v->wrong_count > 0 && v->now_us - v->began_us >= WRONG_US;
    if (same && !again) {
        v->evidence_us = v->now_us;
        return;
    }
    if (again || (v->now_us - v->evidence_us >= NEWS_US &&
                  v->now_us - v->renewed_us >= v->pause_us)) {
        begin(v, dead, gateway);
    }
}
