/* Why a node is not there, and what is wrong with wires: part of visit.h. */
#include <stdio.h>
#include <string.h>

#include "visit.h"

#define NO_ANSWER "no answer"

/* A neighbour that has met somebody with another key where the node should be;
 * -1: none has. */
static int refused_by(const struct host_visit *v, unsigned node) {
    for (unsigned d = 0; d < v->machine->dimension; d++) {
        if ((v->node[node ^ 1u << d].refused >> d & 1) != 0) {
            return (int)(node ^ 1u << d);
        }
    }
    return -1;
}

/* A wrong wire that should lead to the node, or does. */
static const struct cube_wrong *wrong_at(const struct host_visit *v,
                                         unsigned node) {
    for (unsigned i = 0; i < v->wrong_count; i++) {
        const struct cube_wrong *w = &v->wrong[i];
        bool to = w->node < v->machine->nodes &&
                  w->link < v->machine->dimension &&
                  (w->node ^ 1u << w->link) == node;
        if (w->node == node || w->peer_node == node || to) {
            return w;
        }
    }
    return NULL;
}

static void describe_wrong(const struct host_visit *v,
                           const struct cube_wrong *wrong, char *text,
                           size_t size) {
    char fault[CUBE_FAULT_BYTES];
    struct cube_config config = {.dimension = (uint8_t)v->machine->dimension,
                                 .spare_node = v->machine->spare_node,
                                 .host_ports = v->machine->host_ports};
    cube_wrong_text(wrong, &config, fault);
    snprintf(text, size, "%s; %s", fault,
             wrong->refusal == LINK_WRONG_WIRE
                 ? "put that wire right"
                 : "bring the same version of the program everywhere");
}

/* The nearest node on the way from the gateway that is not there: what is
 * behind it cannot be heard. */
static unsigned first_missing(const struct host_visit *v, unsigned node) {
    unsigned at = cube_wiring(v->cube)->gateway, away = at ^ node;
    for (unsigned d = 0; away >> d != 0; d++) {
        if (!v->node[at].there) {
            return at;
        }
        at ^= away & 1u << d;
    }
    return node;
}

const char *host_visit_reason(const struct host_visit *visit, unsigned node,
                              char *text, size_t size) {
    const struct host_visit *v = visit;
    const struct host_machine *m = v->machine;
    const char *doubt = m->doubt == NULL ? NULL : m->doubt(m->context, node);
    const char *start =
        m->start_line == NULL ? NULL : m->start_line(m->context, node);
    const struct cube_wrong *wrong = wrong_at(v, node);
    unsigned first = first_missing(v, node);
    int other = refused_by(v, node);
    if (v->in_use) {
        snprintf(text, size,
                 "the cube is with another host, or one that has just ended; "
                 "it is free some seconds after that");
    } else if (doubt != NULL) {
        snprintf(text, size, "%s%s", doubt,
                 strchr(doubt, ';') != NULL
                     ? ""
                     : "; look after that node and its wire");
    } else if (other >= 0) {
        snprintf(text, size,
                 "node %d meets another key there; give both the same key file",
                 other);
    } else if (wrong != NULL) {
        describe_wrong(v, wrong, text, size);
    } else if (v->node[node].pong_us != 0) {
        snprintf(text, size,
                 "it is there, and answers no questions; its program is of "
                 "another version, bring the same to all nodes");
    } else if (first != node) {
        snprintf(text, size,
                 NO_ANSWER "; the way to it leads by node %u, which is not "
                           "there: look after that first",
                 first);
    } else if (start != NULL) {
        snprintf(text, size, NO_ANSWER "; start it with: %s", start);
    } else if (v->node[node].links != 0) {
        snprintf(text, size,
                 NO_ANSWER "; it was heard before, so look whether it is on, "
                           "and at its wires");
    } else {
        snprintf(text, size,
                 NO_ANSWER
                 "; look whether it is on, with its program, and wired "
                 "as it should be");
    }
    return text;
}

/* --- wires ---------------------------------------------------------------- */

static bool has_host_port(const struct host_machine *m, unsigned node) {
    return m->host_ports > 1
               ? node < m->host_ports
               : node == 0 || (m->spare_node != 0 && node == m->spare_node);
}

unsigned host_visit_links(const struct host_visit *visit, unsigned node) {
    return visit->machine->dimension +
           (has_host_port(visit->machine, node) ? 1 : 0);
}

unsigned host_visit_links_up(const struct host_visit *visit, unsigned node) {
    const struct host_visit_node *n = &visit->node[node];
    return (unsigned)__builtin_popcount(n->seen & ~n->silent);
}

/* What an end that is there says of a link: it never was up, or is silent. */
static bool is_down(const struct host_visit *v, unsigned node, unsigned link) {
    const struct host_visit_node *n = &v->node[node];
    return n->pong_us != 0 && ((n->seen & ~n->silent) >> link & 1) == 0;
}

/* Why a wire between two nodes that are there does not work; false: it does, or
 * is told of as wrong. */
static bool describe_wire(const struct host_visit *v, unsigned node,
                          unsigned link, char *text, size_t size) {
    unsigned other = node ^ 1u << link;
    const struct host_visit_node *one = &v->node[node], *two = &v->node[other];
    if (!is_down(v, node, link) && !is_down(v, other, link)) {
        return false;
    }
    for (unsigned i = 0; i < v->wrong_count; i++) {
        const struct cube_wrong *w = &v->wrong[i];
        if ((w->node == node || w->node == other) && w->link == link) {
            return false;
        }
    }
    bool key = ((one->refused | two->refused) >> link & 1) != 0;
    bool was = ((one->seen | two->seen) >> link & 1) != 0;
    snprintf(text, size, "node %u link %u to node %u: %s", node, link, other,
             key   ? "its ends have different keys; give both the same key "
                     "file"
             : was ? "the wire is not up any more; look at its plugs at both "
                     "ends"
                   : "the wire has never been up; is it there, in the right "
                     "sockets, with its lines crossed?");
    return true;
}

/* Whether what the node has said of its wires is as late as that; who is silent
 * will say no more. */
static bool is_old(const struct host_visit *v, unsigned node, uint64_t age_us) {
    const struct host_visit_node *n = &v->node[node];
    uint64_t since_us = n->born_us > v->opened_us ? n->born_us : v->opened_us;
    return !n->heard ||
           (n->pong_us >= since_us && n->pong_us - since_us >= age_us);
}

bool host_visit_faults_are_old(const struct host_visit *visit,
                               uint64_t age_us) {
    const struct host_visit *v = visit;
    if (v->now_us - v->opened_us < age_us) {
        return false; /* wrong wires are told of by others */
    }
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        for (unsigned d = 0; d < v->machine->dimension; d++) {
            unsigned other = i ^ 1u << d;
            if (v->node[i].there && v->node[other].there &&
                (is_down(v, i, d) || is_down(v, other, d)) &&
                !(is_old(v, i, age_us) && is_old(v, other, age_us))) {
                return false;
            }
        }
    }
    return true;
}

unsigned host_visit_faults(const struct host_visit *visit,
                           void (*tell)(void *context, unsigned node,
                                        unsigned link, const char *text),
                           void *context) {
    const struct host_visit *v = visit;
    char text[240];
    for (unsigned i = 0; i < v->wrong_count && tell != NULL; i++) {
        describe_wrong(v, &v->wrong[i], text, sizeof text);
        tell(context, v->wrong[i].node, v->wrong[i].link, text);
    }
    unsigned count = v->wrong_count;
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        for (unsigned d = 0; d < v->machine->dimension; d++) {
            unsigned other = i ^ 1u << d;
            if (i > other || !v->node[i].there || !v->node[other].there ||
                !describe_wire(v, i, d, text, sizeof text)) {
                continue;
            }
            count++;
            if (tell != NULL) {
                tell(context, i, d, text);
            }
        }
    }
    return count;
}
