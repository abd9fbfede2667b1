#include "parts.h"

#include <stdio.h>
#include <string.h>

#include "host/base/progress.h"
#include "transport/routes.h"

enum {
    WAIT_US_MAX = 10000000,  /* for one more node; at most half the patience */
    SEARCH_US_MAX = 4000000, /* and two fifths */
    AGAIN_US = 10000000,
    ABSENT_S = 3,          /* not up for so long, in a search */
    ABSENT_US = 3000000,   /* and where nothing needs it */
    ATTENTIVE_US = 1000000 /* a node without an answer for longer is not */
};

/* Follows live links from the gateway: which nodes they lead to. */
static const bool *follow(const struct host_service *s,
                          const struct cube_wiring *w) {
    static bool reached[HOST_NODES_MAX];
    unsigned dimension = s->machine->dimension, count = 1, before = 0;
    memset(reached, 0, sizeof reached);
    reached[w->gateway] = true;
    while (count > before) {
        before = count;
        for (unsigned i = 0; i < s->machine->nodes; i++) {
            for (unsigned d = 0; reached[i] && d < dimension; d++) {
                unsigned other = i ^ 1u << d;
                if (!reached[other] &&
                    !wiring_is_dead(w, w->dead_count, i, d, dimension)) {
                    reached[other] = true;
                    count++;
                }
            }
        }
    }
    return reached;
}

/* True: they lead to all nodes that are not lost, and so does the host's. */
static bool holds_together(const struct host_service *s,
                           const struct cube_wiring *w) {
    unsigned dimension = s->machine->dimension;
    const bool *reached = follow(s, w);
    bool all =
        !wiring_is_dead(w, w->dead_count, w->gateway, dimension, dimension);
    for (unsigned i = 0; i < s->machine->nodes; i++)
        all = all && (reached[i] || s->work.lost[i]);
    return all;
}

bool host_missing_links_spare(struct host_service *service) {
    struct host_service *s = service;
    struct cube_wiring found = *cube_wiring(s->cube);
    found.gateway = host_generation_gateway(s, &found);
    bool spare = holds_together(s, &found);
    const bool *reached = follow(s, &found);
    for (unsigned i = 0; i < s->machine->nodes; i++)
        s->node[i].cut_off = !spare && !s->work.lost[i] && !reached[i];
    return spare;
}

/* Errors and what is as good as one go there, whatever else is quiet. */
static void name_wire(struct host_service *s, unsigned node, unsigned link) {
    char other[16] = "the host";
    s->missing_wires++;
    if (s->machine->missing != NULL) {
        s->machine->missing(s->machine->context, node, link);
        return;
    }
    if (link < s->machine->dimension)
        snprintf(other, sizeof other, "node %u", node ^ 1u << link);
    host_note("node %u link %u: the wire to %s does not come up; the run goes "
              "on without it, look after that wire",
              node, link, other);
}

static void tell(struct host_service *s, const struct cube_wiring *w) {
    for (unsigned i = w->settled; i < w->dead_count; i++)
        name_wire(s, w->dead[i].node, w->dead[i].dimension);
}

static void search(struct host_service *s, uint64_t now_us) {
    struct cube_wiring next = *cube_wiring(s->cube);
    next.dead_count = next.settled;
    next.absent_s = ABSENT_S;
    s->searching = true;
    s->search_us = now_us;
    cube_renew(s->cube, &next);
}

/* missing: the dead that were found are. */
static void end_search(struct host_service *s, uint64_t now_us, bool missing) {
    struct cube_wiring next = *cube_wiring(s->cube);
    next.absent_s = missing ? s->machine->absent_s : 0;
    if (missing) {
        tell(s, &next);
        next.gateway = host_generation_gateway(s, &next);
        s->generations++;
    } else {
        next.dead_count = next.settled;
    }
    s->searching = false;
    s->began_us = now_us;
    cube_renew(s->cube, &next);
}

/* For one more node, and for wires that do not come up. */
static uint64_t wait_us(uint64_t patience_us) {
    return patience_us / 2 < WAIT_US_MAX ? patience_us / 2 : WAIT_US_MAX;
}

static uint64_t search_us(uint64_t patience_us) {
    uint64_t most = patience_us * 2 / 5;
    return most < SEARCH_US_MAX ? most : SEARCH_US_MAX;
}

bool host_missing_links_check(struct host_service *service, uint64_t now_us,
                              uint64_t patience_us) {
    struct host_service *s = service;
    struct cube_wiring found = *cube_wiring(s->cube);
    if (s->started || s->machine->absent_s == 0)
        return false;
    if (!s->searching) {
        if (s->up < s->work.living &&
            now_us - s->news_us >= wait_us(patience_us))
            search(s, now_us);
        return s->searching;
    }
    found.gateway = host_generation_gateway(s, &found);
    if (s->up == s->work.living) {
        end_search(s, now_us,
                   false); /* all have come, or the wires are not needed */
    } else if (now_us - s->search_us < search_us(patience_us)) {
        return true;
    } else if (found.dead_count < CUBE_DEAD_MAX && holds_together(s, &found)) {
        end_search(s, now_us, true);
    } else if (now_us - s->search_us >= AGAIN_US) {
        search(s, now_us);
    }
    return true;
}

/* --- wires that nothing needs --------------------------------------------- */

static uint32_t bit_of(unsigned link) {
    return (uint32_t)1 << link;
}

void host_missing_links_heard(struct host_service *service, unsigned node,
                              uint32_t links) {
    struct host_service *s = service;
    s->node[node].links_heard_us = s->uncabled_us;
    s->node[node].links |= links;
    for (unsigned d = 0; d < s->machine->dimension; d++)
        s->node[node ^ 1u << d].links |= links & bit_of(d);
}

static bool has_host_port(const struct host_machine *m, unsigned node) {
    return m->host_ports > 1
               ? node < m->host_ports
               : node == 0 || (m->spare_node != 0 && node == m->spare_node);
}

/* Links of a node whose wires should have been up and never were, by their
 * lower ends; what is dead was named, or will be. */
static uint32_t missing_of(const struct host_service *s, unsigned node) {
    const struct cube_wiring *w = cube_wiring(s->cube);
    unsigned dimension = s->machine->dimension;
    uint32_t missing = has_host_port(s->machine, node) ? bit_of(dimension) : 0;
    missing |= ~node & (bit_of(dimension) - 1);
    missing &= ~s->node[node].links;
    for (unsigned d = 0; missing >> d != 0; d++) {
        bool there = !s->work.lost[node] &&
                     (d == dimension || !s->work.lost[node ^ 1u << d]) &&
                     !wiring_is_dead(w, w->dead_count, node, d, dimension);
        missing &= there ? ~(uint32_t)0 : ~bit_of(d);
    }
    return missing;
}

/* Whether both ends have spoken of it late enough. */
static bool is_certain(const struct host_service *s, unsigned node,
                       unsigned link) {
    unsigned other = link < s->machine->dimension ? node ^ 1u << link : node;
    return s->node[node].links_heard_us >= ABSENT_US &&
           s->node[other].links_heard_us >= ABSENT_US;
}

/* How many wires are missing, and of how many that is certain. */
static unsigned count_missing(const struct host_service *s, unsigned *certain) {
    unsigned count = 0;
    *certain = 0;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        uint32_t missing = missing_of(s, i);
        for (unsigned d = 0; missing >> d != 0; d++) {
            bool one = (missing & bit_of(d)) != 0;
            count += one;
            *certain += one && is_certain(s, i, d);
        }
    }
    return count;
}

static void name_all(struct host_service *s) {
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        uint32_t missing = missing_of(s, i);
        for (unsigned d = 0; missing >> d != 0; d++)
            if ((missing & bit_of(d)) != 0)
                name_wire(s, i, d);
    }
}

/* Nodes that need them as well go round them, in a new generation. */
static void go_round_all(struct host_service *s) {
    struct cube_wiring next = *cube_wiring(s->cube);
    bool all = true;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        uint32_t missing = missing_of(s, i);
        for (unsigned d = 0; missing >> d != 0; d++) {
            struct cube_dead dead = {(uint16_t)i, (uint8_t)d};
            all = all && ((missing & bit_of(d)) == 0 ||
                          wiring_add_dead(&next, dead, s->machine->dimension));
        }
    }
    if (!all || !holds_together(s, &next))
        return;
    next.gateway = host_generation_gateway(s, &next);
    s->generations++;
    cube_renew(s->cube, &next);
}

static bool all_attentive(const struct host_service *s) {
    bool all = true;
    for (unsigned i = 0; i < s->machine->nodes; i++)
        all = all && (s->work.lost[i] || s->node[i].silent_us <= ATTENTIVE_US);
    return all;
}

/* When the run is over, pings are all there is to do. */
static void call_all(struct host_service *s) {
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct host_node *node = &s->node[i];
        node->ping_due = node->ping_due || (!s->work.lost[i] && !node->pinged);
    }
}

void host_missing_links_look(struct host_service *service,
                             uint64_t elapsed_us) {
    struct host_service *s = service;
    unsigned certain;
    if (s->cabled || !s->started)
        return;
    unsigned missing = count_missing(s, &certain);
    if (missing > 0 && all_attentive(s))
        s->uncabled_us += elapsed_us;
    if (missing == certain) {
        name_all(s);
        s->cabled = true;
        if (missing > 0 && s->strategy->meshes && !s->finished &&
            s->ledger.committed < s->ledger.bricks)
            go_round_all(s);
    } else if (s->finished) {
        call_all(s);
    }
}

bool host_missing_links_awaited(const struct host_service *service) {
    const struct host_service *s = service;
    unsigned certain;
    return s->finished && !s->over && !s->cabled &&
           count_missing(s, &certain) > 0;
}
