#include "failure_detector.h"

#include <string.h>

#include "bring_up.h"
#include "doubts.h"
#include "faults.h"
#include "idle_nodes.h"
#include "missing_links.h"
#include "notices.h"

enum {
    CHECK_EVERY_US = 20000,
    ELAPSED_US_MAX = 100000,   /* a host that was stopped blames nobody */
    PINGS_EVERY_US = 250000,   /* all nodes once, */
    PING_EVERY_US = 5000,      /* but no more than one node in this time, */
    PINGS_DUE_MAX = 8,         /* and none while so many wait for the wire */
    PING_AGAIN_US = 2000000,   /* a ping may have been lost with a node; */
    PING_AGAIN_US_MIN = 40000, /* is as a rule just after such a loss */
    PROBE_US_MIN = 500000,
    PROBE_US_MAX = 3000000,
    WIRE_DOWN_US_MAX = 8000000
};

unsigned host_detector_wire(const struct host_service *service) {
    const struct host_service *s = service;
    uint16_t gateway = cube_wiring(s->cube)->gateway;
    return gateway != 0 && gateway == s->machine->spare_node ? 1 : 0;
}

/* --- the beginning ------------------------------------------------------- */

/* A start of a node is over.  Of what it did and no statistics tell, this much
 * is known: it built the tetrahedra that it sent. */
static void close_start(struct host_service *s, unsigned i) {
    struct host_node *node = &s->node[i];
    struct incode_statistics *sum = &s->report[i].statistics.statistics;
    sum->tetrahedra_built += node->unreported;
    sum->tetrahedra_kept += node->unreported;
    sum->make_tetra_calls += node->unreported;
    node->unreported = 0;
    node->before = s->report[i].statistics;
}

static unsigned distance(const struct host_service *s, unsigned node) {
    return (unsigned)__builtin_popcount(node ^ cube_wiring(s->cube)->gateway);
}

/* Pings one more node: of those that have not answered one that is nearest to
 * the gateway, so that the way to it leads over nodes that have. */
static void ping_next(struct host_service *s) {
    unsigned best = UINT32_MAX;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        if (!s->work.lost[i] && !s->report[i].up &&
            (best == UINT32_MAX || distance(s, i) < distance(s, best))) {
            best = i;
        }
    }
    s->probing = best != UINT32_MAX;
    if (s->probing) {
        s->node[best].ping_due = true;
    }
}

/* The last part of the patience, in which a silent node is pinged alone. */
static uint64_t probe_us(const struct host_service *s) {
    uint64_t half = s->patience_us / 2;
    uint64_t probe = PROBE_US_MIN + s->patience_us / 16;
    probe = probe < PROBE_US_MAX ? probe : PROBE_US_MAX;
    return probe < half ? probe : half;
}

void host_detector_begin(struct host_service *service, uint64_t now_us) {
    struct host_service *s = service;
    s->generation = cube_wiring(s->cube)->generation;
    s->loss = false;
    s->probing = s->probe;
    s->probe = false;
    s->work.living = s->up = s->ready = 0;
    s->work.goes_round = cube_wiring(s->cube)->dead_count > 0;
    s->began_us = s->searching ? s->began_us : now_us;
    s->news_us = s->ping_us = now_us;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct host_node *node = &s->node[i];
        bool lost = node->given_up || node->aside ||
                    !cube_reaches(s->cube, (uint16_t)i);
        s->work.lost[i] = lost;
        s->work.living += !lost;
        node->ping_due = !lost && !s->probing;
        node->pinged_us = now_us;
        node->pinged = false;
        node->ping_again_us = PING_AGAIN_US_MIN;
        node->sent = node->received = node->missed = 0;
        node->still_us = 0;
        node->cut_off = false;
        node->silent = 0;
        if (node->silent_us > s->patience_us - probe_us(s)) {
            node->silent_us = s->patience_us - probe_us(s);
        }
        node->awaited = INCODE_NONE;
        node->owing = CUBE_HOST;
        node->left = false;
        s->report[i].up = s->report[i].ready = false;
        if (lost) {
            close_start(s, i);
        }
    }
    if (s->probing) {
        ping_next(s);
    }
    host_faults_begin(s);
}

void host_detector_end(struct host_service *service) {
    for (unsigned i = 0; i < service->machine->nodes; i++) {
        close_start(service, i);
    }
}

/* --- pings and pongs ------------------------------------------------------ */

bool host_detector_ping(struct host_service *service, uint16_t to) {
    struct host_node *node = &service->node[to];
    struct node_ping_message ping = {node->sent};
    if (cube_write(service->cube, to, NODE_PING, &ping, sizeof ping) != 0) {
        return false;
    }
    host_faults_pinged(service, to, node->sent);
    node->sent++;
    node->ping_due = false;
    node->pinged = true;
    return true;
}

int host_detector_pong(struct host_service *service,
                       const struct cube_message *message,
                       struct host_error *error) {
    struct host_service *s = service;
    struct host_node *node = &s->node[message->source];
    struct host_node_report *report = &s->report[message->source];
    struct node_pong_message pong;
    if (message->size != sizeof pong) {
        return host_fail(error, HOST_CUBE,
                         "node %u link %u: pong in %u bytes, expected %zu; are "
                         "host and node of one version? run make",
                         message->source,
                         host_detector_link(service, message->source),
                         message->size, sizeof pong);
    }
    memcpy(&pong, message->data, sizeof pong);
    bool anew = node->start != 0 && node->start != pong.start;
    if (anew) {
        s->blamed = message->source;
    }
    bool first = !report->up;
    if (first) {
        /* It has had nothing but pings yet.  The first of them may have gone
         * to a link's end that was just about to start again. */
        report->up = true;
        s->up++;
        s->news_us = s->check_us;
        node->missed = pong.pinged - pong.received;
        node->ping_again_us = PING_AGAIN_US;
        if (anew) {
            close_start(s, message->source);
        }
        node->start = pong.start;
    }
    if (pong.start != node->start ||
        pong.pinged - pong.received != node->missed ||
        pong.sent != node->received) {
        s->loss = true;
    }
    if (pong.work != node->work) {
        host_idle_progress(s, message->source);
    }
    node->work = pong.work;
    node->awaited = pong.awaited;
    node->owing = pong.owing;
    node->refused = pong.refused;
    node->silent = pong.silent;
    host_doubts_heard(s, message->source, anew && first);
    host_missing_links_heard(s, message->source, pong.links);
    node->pinged = false;
    /* What would have been asked again, is answered. */
    node->ping_due = node->vouches == HOST_DOUBTED;
    if (first && s->probing) {
        ping_next(s);
    }
    return s->loss
               ? 0
               : host_faults_answered(s, message->source, pong.pinged, error);
}

static unsigned pings_due(const struct host_service *s) {
    unsigned due = 0;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        due += s->node[i].ping_due;
    }
    return due;
}

/* Has each node pinged once a period, one after the other; less often where
 * the wire is too slow for that and for the work. */
static void ping_in_turn(struct host_service *s, uint64_t now_us) {
    if (s->probing) {
        return;
    }
    uint64_t every = PINGS_EVERY_US / s->machine->nodes;
    every = every < PING_EVERY_US ? PING_EVERY_US : every;
    if (now_us - s->ping_us < every) {
        return;
    }
    unsigned due = pings_due(s);
    for (unsigned i = 0; i < s->machine->nodes && due < PINGS_DUE_MAX &&
                         now_us - s->ping_us >= every;
         i++) {
        struct host_node *node = &s->node[s->ping_turn];
        if (!s->work.lost[s->ping_turn] && !node->pinged) {
            due += !node->ping_due;
            node->ping_due = true;
            node->pinged_us = now_us;
        }
        s->ping_turn = (s->ping_turn + 1) % s->machine->nodes;
        s->ping_us += every;
    }
    if (now_us - s->ping_us >= every) {
        s->ping_us = now_us;
    }
}

/* --- what is wrong -------------------------------------------------------- */

unsigned host_detector_link(const struct host_service *service, unsigned node) {
    return host_link_to(node, cube_wiring(service->cube)->gateway,
                        service->machine->dimension);
}

static int fail_wrong(const struct host_service *s, struct host_error *error) {
    const struct cube_wrong *wrong = &cube_wiring(s->cube)->wrong[0];
    char text[CUBE_FAULT_BYTES];
    (void)cube_wiring_fault(s->cube, text);
    return host_fail(error, HOST_CUBE, "wiring: %s; %s", text,
                     wrong->refusal == LINK_WRONG_WIRE
                         ? "put that wire right and run again"
                         : "run the same version of the program everywhere");
}

/* A node that was silent for as long as the user has patience. */
static void give_up(struct host_service *s, unsigned i) {
    struct host_node *node = &s->node[i];
    node->silent_us = 0;
    s->probe = true;
    if (s->machine->kill != NULL && s->machine->kill(s->machine->context, i)) {
        /* the machine will say that it has started it again */
        host_notice(s, i, "no answer for %llu s; it is ended and started again",
                    (unsigned long long)s->patience_us / 1000000);
        return;
    }
    node->given_up = true;
    s->blamed = i;
    s->loss = true;
    if (i == cube_wiring(s->cube)->gateway && s->machine->spare_node == 0) {
        return; /* the error says so */
    }
    host_notice(s, i,
                "given up after %llu s without an answer; its work is given "
                "to others, look after that node and its wires",
                (unsigned long long)s->patience_us / 1000000);
}

/* How long a node may be silent.  The run ends with the one node by which the
 * host speaks: where the wire to it was heard meanwhile, it has twice the time,
 * as its answers may have been lost with what was behind them. */
static uint64_t silence_us_max(const struct host_service *s, unsigned i) {
    bool last_resort = i == cube_wiring(s->cube)->gateway &&
                       s->machine->spare_node == 0 &&
                       s->wire_quiet_us < s->patience_us / 2;
    return last_resort ? 2 * s->patience_us : s->patience_us;
}

/* Nodes that are silent, and what follows.  One that takes nothing off its
 * links holds up all that is on the way to it and behind, and so makes others
 * silent: at first nobody is blamed, but each is pinged alone, for the last
 * part of the patience.  One that no live wire leads to needs no such proof. */
static void listen(struct host_service *s, uint64_t now_us,
                   uint64_t elapsed_us) {
    for (unsigned i = 0; i < s->machine->nodes && !s->loss; i++) {
        struct host_node *node = &s->node[i];
        bool alone = s->probing || node->cut_off;
        if (node->pinged && now_us - node->pinged_us >= node->ping_again_us) {
            node->ping_due = true;
            node->pinged_us = now_us;
            node->ping_again_us = 2 * node->ping_again_us < PING_AGAIN_US
                                      ? 2 * node->ping_again_us
                                      : PING_AGAIN_US;
        }
        if (!s->started || s->work.lost[i] ||
            !(node->pinged || node->ping_due)) {
            continue;
        }
        node->silent_us += elapsed_us;
        uint64_t most = silence_us_max(s, i);
        if (node->silent_us <= most - (alone ? 0 : probe_us(s))) {
            continue;
        }
        if (alone) {
            give_up(s, i);
        } else {
            s->probe = true;
            s->blamed = i;
            s->loss = true;
        }
    }
}

static int check_wire(struct host_service *s, uint64_t now_us,
                      struct host_error *error) {
    unsigned wire = host_detector_wire(s);
    enum link_state state = cube_link_state(s->cube, wire);
    uint16_t gateway = cube_wiring(s->cube)->gateway;
    enum host_in_use_state use = host_in_use_look(
        &s->in_use, s->machine, cube_link_peer(s->cube, wire), now_us);
    if (use != HOST_FREE) {
        return use == HOST_TAKEN ? 0
                                 : host_in_use_fail(s->machine, gateway, error);
    }
    /* A wire that was never up is waited for: its node may start late.  What is
     * wrong with one, the wiring will have in a moment. */
    if (state != LINK_DOWN ||
        cube_link_statistics(s->cube, wire)->sessions == 0) {
        s->wire_down_us = now_us;
    }
    /* Without another wire it is the node that is waited for. */
    if (now_us - s->wire_down_us > WIRE_DOWN_US_MAX &&
        s->machine->spare_node != 0) {
        s->wire_lost = true;
        s->blamed = gateway;
        s->loss = true;
    }
    return 0;
}

int host_detector_doubt(const struct host_service *service, unsigned node,
                        struct host_error *error) {
    const struct host_machine *m = service->machine;
    const char *doubt = m->doubt == NULL ? NULL : m->doubt(m->context, node);
    if (doubt == NULL) {
        return 0;
    }
    bool next = strchr(doubt, ';') != NULL;
    return host_fail(error, HOST_CUBE, "node %u link %u: %s%s", node,
                     host_detector_link(service, node), doubt,
                     next ? "" : "; look after that node and its wires");
}

int host_detector_check(struct host_service *service, uint64_t now_us,
                        struct host_error *error) {
    struct host_service *s = service;
    const struct cube_wiring *wiring = cube_wiring(s->cube);
    if (now_us - s->check_us < CHECK_EVERY_US) {
        return 0;
    }
    uint64_t elapsed = now_us - s->check_us;
    s->check_us = now_us;
    if (s->machine->check(s->machine->context, error) != 0) {
        return error->code;
    }
    if (s->work.living == 0) {
        return host_fail(error, HOST_CUBE,
                         "node %u link %u: no node is left to work; look after "
                         "the nodes, and run again",
                         s->blamed, host_detector_link(s, s->blamed));
    }
    if (wiring->wrong_count > 0) {
        return fail_wrong(s, error);
    }
    if (s->machine->restarts != NULL &&
        s->machine->restarts(s->machine->context) != s->restarts) {
        s->restarts = s->machine->restarts(s->machine->context);
        s->loss = true;
    }
    if (!host_missing_links_check(s, now_us, host_bring_up_patience(s))) {
        s->loss = s->loss || (wiring->dead_count > wiring->settled &&
                              host_missing_links_spare(s));
    }
    ping_in_turn(s, now_us);
    elapsed = elapsed < ELAPSED_US_MAX ? elapsed : ELAPSED_US_MAX;
    listen(s, now_us, elapsed);
    host_doubts_check(s, elapsed);
    host_idle_check(s, elapsed);
    host_missing_links_look(s, elapsed);
    if (check_wire(s, now_us, error) != 0) {
        return error->code;
    }
    return host_bring_up_check(s, now_us, elapsed, error);
}
