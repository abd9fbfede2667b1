#include "session_wiring.h"

#include <stdio.h>
#include <string.h>

#include "session.h"
#include "transport/routes.h"

#define NO_ANSWER "no answer"

/* A neighbour that has met somebody with another key where the node should be;
 * -1: none has. */
static int refused_by(const struct host_session *v, unsigned node) {
    for (unsigned d = 0; d < v->machine->dimension; d++)
        if ((v->node[node ^ 1u << d].refused >> d & 1) != 0)
            return (int)(node ^ 1u << d);
    return -1;
}

/* A wrong wire that should lead to the node, or does. */
static const struct cube_wrong *wrong_at(const struct host_session *v,
                                         unsigned node) {
    for (unsigned i = 0; i < v->wrong_count; i++) {
        const struct cube_wrong *w = &v->wrong[i];
        bool to = w->node < v->machine->nodes &&
                  w->link < v->machine->dimension &&
                  (w->node ^ 1u << w->link) == node;
        if (w->node == node || w->peer_node == node || to)
            return w;
    }
    return NULL;
}

static void describe_wrong(const struct host_session *v,
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
static unsigned first_missing(const struct host_session *v, unsigned node) {
    unsigned at = cube_wiring(v->cube)->gateway, away = at ^ node;
    for (unsigned d = 0; away >> d != 0; d++) {
        if (!v->node[at].there)
            return at;
        at ^= away & 1u << d;
    }
    return node;
}

const char *host_session_reason(const struct host_session *session,
                                unsigned node, char *text, size_t size) {
    const struct host_session *v = session;
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

unsigned host_session_links(const struct host_session *session, unsigned node) {
    return session->machine->dimension +
           (has_host_port(session->machine, node) ? 1 : 0);
}

unsigned host_session_links_up(const struct host_session *session,
                               unsigned node) {
    const struct host_session_node *n = &session->node[node];
    return (unsigned)__builtin_popcount(n->seen & ~n->silent);
}

/* What an end that is there says of a link: it never was up, or is silent. */
static bool is_down(const struct host_session *v, unsigned node,
                    unsigned link) {
    const struct host_session_node *n = &v->node[node];
    return n->pong_us != 0 && ((n->seen & ~n->silent) >> link & 1) == 0;
}

/* Why a wire between two nodes that are there does not work; false: it does, or
 * is told of as wrong. */
static bool describe_wire(const struct host_session *v, unsigned node,
                          unsigned link, char *text, size_t size) {
    unsigned other = node ^ 1u << link;
    const struct host_session_node *one = &v->node[node],
                                   *two = &v->node[other];
    if (!is_down(v, node, link) && !is_down(v, other, link))
        return false;
    for (unsigned i = 0; i < v->wrong_count; i++) {
        const struct cube_wrong *w = &v->wrong[i];
        if ((w->node == node || w->node == other) && w->link == link)
            return false;
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
static bool is_old(const struct host_session *v, unsigned node,
                   uint64_t age_us) {
    const struct host_session_node *n = &v->node[node];
    uint64_t since_us = n->born_us > v->opened_us ? n->born_us : v->opened_us;
    return !n->heard ||
           (n->pong_us >= since_us && n->pong_us - since_us >= age_us);
}

bool host_session_faults_are_old(const struct host_session *session,
                                 uint64_t age_us) {
    const struct host_session *v = session;
    if (v->now_us - v->opened_us < age_us)
        return false; /* wrong wires are told of by others */
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        for (unsigned d = 0; d < v->machine->dimension; d++) {
            unsigned other = i ^ 1u << d;
            if (v->node[i].there && v->node[other].there &&
                (is_down(v, i, d) || is_down(v, other, d)) &&
                !(is_old(v, i, age_us) && is_old(v, other, age_us)))
                return false;
        }
    }
    return true;
}

unsigned host_session_faults(const struct host_session *session,
                             void (*tell)(void *context, unsigned node,
                                          unsigned link, const char *text),
                             void *context) {
    const struct host_session *v = session;
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
                !describe_wire(v, i, d, text, sizeof text))
                continue;
            count++;
            if (tell != NULL)
                tell(context, i, d, text);
        }
    }
    return count;
}

/* --- session wiring ------------------------------------------------------- */

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

unsigned host_session_wire(const struct host_session *session) {
    uint16_t gateway = cube_wiring(session->cube)->gateway;
    return gateway != 0 && gateway == session->machine->spare_node ? 1 : 0;
}

void host_session_wiring_begin(struct host_session *session) {
    struct host_session *v = session;
    v->generation = cube_wiring(v->cube)->generation;
    v->began_us = v->evidence_us = v->now_us;
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        struct host_session_node *node = &v->node[i];
        node->who_due = !node->there;
        node->who_again_us = 0;
        node->ping_due = true;
        node->question_due = host_node_set_has(&v->wanted, i);
        node->pong_us = node->silent_us = 0;
        node->seen = node->silent = node->received = 0;
    }
}

/* --- what is dead --------------------------------------------------------- */

static void add(struct host_session *v, uint32_t *dead, unsigned node,
                unsigned link) {
    if (node < v->machine->nodes && link < v->machine->dimension) {
        dead[node] |= bit_of(link);
        dead[node ^ 1u << link] |= bit_of(link);
    }
}

/* What nodes have found since this generation began. */
static void add_found(struct host_session *v, uint32_t *dead) {
    const struct cube_wiring *w = cube_wiring(v->cube);
    for (unsigned i = w->settled; i < w->dead_count; i++)
        if (w->dead[i].dimension != CUBE_WHOLE_NODE)
            add(v, dead, w->dead[i].node, w->dead[i].dimension);
    for (unsigned i = 0; i < v->wrong_count; i++)
        add(v, dead, v->wrong[i].node, v->wrong[i].link);
}

/* What nodes call silent for long enough. */
static void add_silent(struct host_session *v, uint32_t *dead) {
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        const struct host_session_node *node = &v->node[i];
        for (unsigned d = 0; d < v->machine->dimension; d++)
            if ((node->silent & bit_of(d)) != 0 &&
                v->now_us - node->silent_us >= SILENT_US)
                add(v, dead, i, d);
    }
}

/* What an end of a link says of it: 1 alive, -1 not, 0 nothing yet. */
static int says(const struct host_session *v, unsigned node, unsigned link) {
    const struct host_session_node *n = &v->node[node];
    if (n->pong_us == 0 || n->pong_us - v->began_us < ALIVE_US)
        return 0;
    return (n->seen & ~n->silent & bit_of(link)) != 0 ? 1 : -1;
}

static bool is_wrong(const struct host_session *v, unsigned node,
                     unsigned link) {
    for (unsigned i = 0; i < v->wrong_count; i++)
        if (v->wrong[i].node == node && v->wrong[i].link == link)
            return true;
    return false;
}

/* Whether a link that was dead is still: nobody says that it is alive, or an
 * end says that it is not. */
static bool stays_dead(const struct host_session *v, unsigned node,
                       unsigned link) {
    unsigned other = node ^ 1u << link;
    int one = says(v, node, link), two = says(v, other, link);
    return one < 0 || two < 0 || (one == 0 && two == 0) ||
           is_wrong(v, node, link) || is_wrong(v, other, link);
}

/* By all that is known now. */
static void find_dead(struct host_session *v, uint32_t *dead) {
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        dead[i] = 0;
        for (unsigned d = 0; d < v->machine->dimension; d++)
            if ((v->dead[i] & bit_of(d)) != 0 && stays_dead(v, i, d))
                dead[i] |= bit_of(d);
    }
    add_found(v, dead);
    add_silent(v, dead);
}

/* --- another generation --------------------------------------------------- */

/* A node of which nothing is heard, and two or more links of which are dead, is
 * so as a whole, where nobody knows of a link to it that is not: the wiring has
 * room for few. */
static bool is_whole(const struct host_session *v, const uint32_t *dead,
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
static void add_whole(struct host_session *v, uint32_t *dead, bool *whole) {
    for (unsigned i = 0; i < v->machine->nodes; i++)
        whole[i] = is_whole(v, dead, i);
    for (unsigned i = 0; i < v->machine->nodes; i++)
        for (unsigned d = 0; whole[i] && d < v->machine->dimension; d++)
            add(v, dead, i, d);
}

static void settle(struct host_session *v, uint32_t *dead,
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
                !whole[other])
                (void)wiring_add_dead(next, link, dimension);
        }
    }
}

/* The gateway's wire is down, and the other one works. */
static uint16_t choose_gateway(struct host_session *v) {
    unsigned wire = host_session_wire(v);
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

static void begin(struct host_session *v, uint32_t *dead, uint16_t gateway) {
    struct cube_wiring next = *cube_wiring(v->cube);
    next.gateway = gateway;
    next.absent_s = HOST_SESSION_ABSENT_S;
    settle(v, dead, &next);
    v->pause_us = v->now_us - v->renewed_us > REST_US ? PAUSE_US
                  : v->pause_us < PAUSE_US_MAX / 2    ? 2 * v->pause_us
                                                      : PAUSE_US_MAX;
    v->renewed_us = v->wire_us = v->now_us;
    memcpy(v->dead, dead, v->machine->nodes * sizeof *v->dead);
    cube_renew(v->cube, &next);
    host_session_wiring_begin(v);
}

void host_session_wiring_renew(struct host_session *session) {
    uint32_t dead[HOST_NODES_MAX];
    find_dead(session, dead);
    begin(session, dead, choose_gateway(session));
}

/* The wiring keeps its wrong wires for as long as a generation lasts, and a new
 * one has none for a moment. */
static void look_for_wrong(struct host_session *v) {
    const struct cube_wiring *w = cube_wiring(v->cube);
    if (w->wrong_count > 0 || v->now_us - v->began_us > NEWS_US) {
        memcpy(v->wrong, w->wrong, w->wrong_count * sizeof w->wrong[0]);
        v->wrong_count = w->wrong_count;
    }
}

void host_session_wiring_look(struct host_session *session) {
    struct host_session *v = session;
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
                  v->now_us - v->renewed_us >= v->pause_us))
        begin(v, dead, gateway);
}
