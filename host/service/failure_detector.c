#include <stdio.h>
#include <string.h>

#include "parts.h"
#include "node/common.h"

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

/* --- the beginning -------------------------------------------------------- */

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
    for (unsigned i = 0; i < s->machine->nodes; i++)
        if (!s->work.lost[i] && !s->report[i].up &&
            (best == UINT32_MAX || distance(s, i) < distance(s, best)))
            best = i;
    s->probing = best != UINT32_MAX;
    if (s->probing)
        s->node[best].ping_due = true;
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
        if (node->silent_us > s->patience_us - probe_us(s))
            node->silent_us = s->patience_us - probe_us(s);
        node->awaited = INCODE_NONE;
        node->owing = CUBE_HOST;
        node->left = false;
        s->report[i].up = s->report[i].ready = false;
        if (lost)
            close_start(s, i);
    }
    if (s->probing)
        ping_next(s);
    host_faults_begin(s);
}

void host_detector_end(struct host_service *service) {
    for (unsigned i = 0; i < service->machine->nodes; i++)
        close_start(service, i);
}

/* --- pings and pongs ------------------------------------------------------ */

bool host_detector_ping(struct host_service *service, uint16_t to) {
    struct host_node *node = &service->node[to];
    struct node_ping_message ping = {node->sent};
    if (cube_write(service->cube, to, NODE_PING, &ping, sizeof ping) != 0)
        return false;
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
    if (anew)
        s->blamed = message->source;
    bool first = !report->up;
    if (first) {
        /* It has had nothing but pings yet.  The first of them may have gone
         * to a link's end that was just about to start again. */
        report->up = true;
        s->up++;
        s->news_us = s->check_us;
        node->missed = pong.pinged - pong.received;
        node->ping_again_us = PING_AGAIN_US;
        if (anew)
            close_start(s, message->source);
        node->start = pong.start;
    }
    if (pong.start != node->start ||
        pong.pinged - pong.received != node->missed ||
        pong.sent != node->received)
        s->loss = true;
    if (pong.work != node->work)
        host_idle_progress(s, message->source);
    node->work = pong.work;
    node->awaited = pong.awaited;
    node->owing = pong.owing;
    node->refused = pong.refused;
    node->silent = pong.silent;
    host_suspects_heard(s, message->source, anew && first);
    host_missing_links_heard(s, message->source, pong.links);
    node->pinged = false;
    /* What would have been asked again, is answered. */
    node->ping_due = node->vouches == HOST_DOUBTED;
    if (first && s->probing)
        ping_next(s);
    return s->loss
               ? 0
               : host_faults_answered(s, message->source, pong.pinged, error);
}

static unsigned pings_due(const struct host_service *s) {
    unsigned due = 0;
    for (unsigned i = 0; i < s->machine->nodes; i++)
        due += s->node[i].ping_due;
    return due;
}

/* Has each node pinged once a period, one after the other; less often where
 * the wire is too slow for that and for the work. */
static void ping_in_turn(struct host_service *s, uint64_t now_us) {
    if (s->probing)
        return;
    uint64_t every = PINGS_EVERY_US / s->machine->nodes;
    every = every < PING_EVERY_US ? PING_EVERY_US : every;
    if (now_us - s->ping_us < every)
        return;
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
    if (now_us - s->ping_us >= every)
        s->ping_us = now_us;
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
    if (i == cube_wiring(s->cube)->gateway && s->machine->spare_node == 0)
        return; /* the error says so */
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
        if (!s->started || s->work.lost[i] || !(node->pinged || node->ping_due))
            continue;
        node->silent_us += elapsed_us;
        uint64_t most = silence_us_max(s, i);
        if (node->silent_us <= most - (alone ? 0 : probe_us(s)))
            continue;
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
        cube_link_statistics(s->cube, wire)->sessions == 0)
        s->wire_down_us = now_us;
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
    if (doubt == NULL)
        return 0;
    bool next = strchr(doubt, ';') != NULL;
    return host_fail(error, HOST_CUBE, "node %u link %u: %s%s", node,
                     host_detector_link(service, node), doubt,
                     next ? "" : "; look after that node and its wires");
}

static void host_idle_check(struct host_service *service, uint64_t elapsed_us);

int host_detector_check(struct host_service *service, uint64_t now_us,
                        struct host_error *error) {
    struct host_service *s = service;
    const struct cube_wiring *wiring = cube_wiring(s->cube);
    if (now_us - s->check_us < CHECK_EVERY_US)
        return 0;
    uint64_t elapsed = now_us - s->check_us;
    s->check_us = now_us;
    if (s->machine->check(s->machine->context, error) != 0)
        return error->code;
    if (s->work.living == 0) {
        return host_fail(error, HOST_CUBE,
                         "node %u link %u: no node is left to work; look after "
                         "the nodes, and run again",
                         s->blamed, host_detector_link(s, s->blamed));
    }
    if (wiring->wrong_count > 0)
        return fail_wrong(s, error);
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
    host_suspects_check(s, elapsed);
    host_idle_check(s, elapsed);
    host_missing_links_look(s, elapsed);
    if (check_wire(s, now_us, error) != 0)
        return error->code;
    return host_bring_up_check(s, now_us, elapsed, error);
}

/* --- suspects ------------------------------------------------------------- */

enum {
    DOUBT_US = 1300000,
    SLOW_US = 10000000, /* of nodes that this machine may keep waiting */
    WIRE_US = 1200000,
    TIMES = 2,         /* the longest silence that ended of late */
    FADES = 16,        /* a silence of 1 s is forgotten after so many s */
    QUIET_US = 1000000 /* silences that end sooner after a doubt: due to it */
};

/* What may be on the way before an answer: a window each way of the slowest
 * wire, 10 bits a byte. */
static uint64_t wire_us(const struct host_service *s) {
    enum { WINDOWS_BITS = 10 * 2 * 8192 };
    uint32_t baud = s->machine->serial_baud;
    return baud == 0 ? 0 : UINT64_C(1000000) * WINDOWS_BITS / baud;
}

/* For how long a node may be silent before anybody is told. */
static uint64_t doubt_us(const struct host_service *s) {
    uint64_t us = DOUBT_US + wire_us(s);
    return s->machine->slow && us < SLOW_US ? SLOW_US : us;
}

/* Notes the silences that have ended since the last check. */
static void note_silences(struct host_service *s, uint64_t elapsed_us) {
    bool doubted = false;
    for (unsigned i = 0; i < s->machine->nodes; i++)
        doubted = doubted || (s->node[i].doubted && !s->work.lost[i]);
    s->undoubted_us = doubted ? 0 : s->undoubted_us + elapsed_us;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct host_node *n = &s->node[i];
        uint64_t fades_us = elapsed_us / FADES;
        bool ended = n->silent_us < n->silence_us && n->silent == 0;
        n->slow_us -= fades_us < n->slow_us ? fades_us : n->slow_us;
        if (ended && s->undoubted_us >= QUIET_US && n->silence_us > n->slow_us)
            n->slow_us = n->silence_us;
        n->silence_us = n->silent_us;
    }
}

/* Silence up to this is usual for the node and its neighbours. */
static uint64_t usual_us(const struct host_service *s, unsigned i) {
    uint64_t most = s->node[i].slow_us;
    for (unsigned d = 0; d < s->machine->dimension; d++) {
        uint64_t other = s->node[i ^ 1u << d].slow_us;
        most = other > most ? other : most;
    }
    return TIMES * most;
}

static void look_at_wire(struct host_service *s, uint64_t elapsed_us) {
    uint64_t frames =
        cube_link_statistics(s->cube, host_detector_wire(s))->frames_received;
    s->wire_quiet_us =
        frames == s->wire_frames ? s->wire_quiet_us + elapsed_us : 0;
    s->wire_frames = frames;
}

/* Whether the node has answered of late. */
static bool is_heard(const struct host_service *s, unsigned i) {
    return !s->work.lost[i] && s->report[i].up && !s->node[i].doubted &&
           s->node[i].silent_us < (DOUBT_US + wire_us(s)) / 2;
}

/* How many say that the node is silent, and have not said since that it is not;
 * *others: how many are heard and say nothing of the kind. */
static unsigned witnesses(const struct host_service *s, unsigned i,
                          unsigned *others) {
    unsigned silent = 0;
    *others = 0;
    if (i == cube_wiring(s->cube)->gateway) {
        uint64_t limit = WIRE_US + wire_us(s);
        silent += s->wire_quiet_us > limit;
        *others += s->wire_quiet_us <= limit;
    }
    for (unsigned d = 0; d < s->machine->dimension; d++) {
        unsigned other = i ^ 1u << d;
        bool up = (s->node[other].links >> d & 1) != 0;
        bool quiet = (s->node[other].silent >> d & 1) != 0;
        silent += up && quiet && !s->work.lost[other];
        *others += up && !quiet && is_heard(s, other);
    }
    return silent;
}

static void doubt(struct host_service *s, unsigned i) {
    const struct host_machine *m = s->machine;
    const char *why = m->doubt == NULL ? NULL : m->doubt(m->context, i);
    bool next = why != NULL && strchr(why, ';') != NULL;
    const char *start = m->restarts != NULL || m->start_line == NULL
                            ? NULL
                            : m->start_line(m->context, i);
    s->node[i].doubted = true;
    host_notice(s, i,
                "no answer for %.1f s%s%s%s %s after %llu s without one, "
                "look after that node%s%s",
                1e-6 * (double)s->node[i].silent_us, why == NULL ? "" : ": ",
                why == NULL ? "" : why, next ? ", or" : "; it is",
                m->restarts != NULL ? "ended and started again" : "given up",
                (unsigned long long)s->patience_us / 1000000,
                start == NULL ? "" : ", it is started by: ",
                start == NULL ? "" : start);
}

static void doubt_wire(struct host_service *s, unsigned i, unsigned d) {
    s->node[i].wires_doubted |= 1u << d;
    s->node[i ^ 1u << d].wires_doubted |= 1u << d;
    host_notice_of(s, i, d,
                   "nothing comes by the wire to node %u; if it stays so "
                   "the run goes round it, look after that wire",
                   i ^ 1u << d);
}

/* Wires that one end says are silent, while the node at the other is heard: for
 * a while, as one that comes back is heard before it is told so. */
static void look_at_links(struct host_service *s, unsigned i,
                          uint64_t elapsed_us) {
    struct host_node *node = &s->node[i];
    uint32_t wires = node->silent & ~node->wires_doubted;
    for (unsigned d = 0; d < s->machine->dimension; d++) {
        bool both = is_heard(s, i) && is_heard(s, i ^ 1u << d);
        wires &= both ? ~(uint32_t)0 : ~(1u << d);
    }
    uint64_t limit = s->machine->slow ? SLOW_US : WIRE_US / 2 + wire_us(s);
    limit = limit < usual_us(s, i) ? usual_us(s, i) : limit;
    wires &= (1u << s->machine->dimension) - 1;
    node->wires_us = wires != 0 ? node->wires_us + elapsed_us : 0;
    for (unsigned d = 0; wires >> d != 0 && node->wires_us > limit; d++)
        if ((wires >> d & 1) != 0)
            doubt_wire(s, i, d);
}

void host_suspects_check(struct host_service *service, uint64_t elapsed_us) {
    struct host_service *s = service;
    unsigned others;
    look_at_wire(s, elapsed_us);
    note_silences(s, elapsed_us);
    for (unsigned i = 0; i < s->machine->nodes && s->started; i++) {
        uint64_t limit = doubt_us(s);
        limit = limit < usual_us(s, i) ? usual_us(s, i) : limit;
        limit = s->patience_us / 2 < limit ? s->patience_us / 2 : limit;
        if (s->work.lost[i] || s->node[i].doubted)
            continue;
        if (s->node[i].silent_us > limit && witnesses(s, i, &others) > 0 &&
            others == 0)
            doubt(s, i);
        else
            look_at_links(s, i, elapsed_us);
    }
}

void host_suspects_heard(struct host_service *service, unsigned node,
                         bool anew) {
    struct host_service *s = service;
    struct host_node *n = &s->node[node];
    n->wires_doubted &= n->silent;
    if (anew) {
        host_notice(s, node,
                    "has started again; what it had not finished is done "
                    "again");
    } else if (n->doubted) {
        host_notice(s, node, "answers again; the run goes on with it");
    }
    n->doubted = false;
}

/* --- idle nodes ----------------------------------------------------------- */

enum { SILENT_US = 1000000 };

void host_idle_progress(struct host_service *service, unsigned node) {
    service->node[node].still_us = 0;
}

/* What the node has to work for. */
static bool owes(const struct host_service *s, unsigned i) {
    const struct host_node *node = &s->node[i];
    bool ready = !node->setup_due && !s->report[i].ready;
    bool results =
        node->working && !node->job_due && node->awaited != NODE_AWAITS_OTHERS;
    bool statistics = s->reporting && !node->report_due && !node->reported;
    bool other =
        s->dealt && s->strategy->owes != NULL && s->strategy->owes(&s->work, i);
    return s->started && !s->work.lost[i] && s->report[i].up &&
           (ready || results || statistics || other);
}

/* What it waits for is the host's to send. */
static bool is_owed(const struct host_service *s, unsigned i) {
    const struct host_node *node = &s->node[i];
    uint32_t credits = node->results + s->setup.credits - node->credit;
    return node->pages_count > 0 || node->unspills_count > 0 ||
           (s->setup.credits > 0 && credits >= s->setup.credits / 2);
}

/* The living node that this one waits for: who keeps its page, or owes it
 * answers; or CUBE_HOST. */
static unsigned awaits(const struct host_service *s, unsigned i) {
    struct node_setup_message setup = s->setup;
    s->strategy->set_up(&s->work, i, &setup);
    uint32_t page = s->node[i].awaited;
    uint32_t keeper =
        page == INCODE_NONE ? CUBE_HOST : node_keeper(page, setup.holders);
    keeper = s->node[i].owing != CUBE_HOST ? s->node[i].owing : keeper;
    bool living = keeper < s->machine->nodes && !s->work.lost[keeper];
    return living ? keeper : CUBE_HOST;
}

/* Who holds this node up: the last of those who wait for each other, be it
 * itself; or CUBE_HOST: one of them goes on, so that all may. */
static unsigned culprit(const struct host_service *s, unsigned i) {
    unsigned next = awaits(s, i);
    for (unsigned k = 0; k < s->machine->nodes && next != CUBE_HOST; k++) {
        if (s->node[next].still_us <= s->patience_us / 2)
            return CUBE_HOST;
        i = next;
        next = awaits(s, i);
    }
    return i;
}

static const char *work_of_one_left(const struct host_service *s) {
    return s->work.living > 1 ? "its work is given to others"
                              : "no other node is left to do its work";
}

bool host_idle_leave(struct host_service *service, unsigned node,
                     const char *why) {
    struct host_service *s = service;
    struct host_node *n = &s->node[node];
    n->still_us = 0;
    s->blamed = node;
    n->left = true;
    if (n->started_anew)
        return false;
    if (s->machine->kill != NULL &&
        s->machine->kill(s->machine->context, node)) {
        n->started_anew = true; /* the machine will say so */
        host_notice(s, node, "%s; it is ended and started again", why);
        return true;
    }
    n->aside = true;
    s->loss = true;
    host_notice(s, node, "%s; %s, look after that node", why,
                work_of_one_left(s));
    return true;
}

/* The same, but a node that has had its new start already is put aside. */
static void leave_for_good(struct host_service *s, unsigned node,
                           const char *why) {
    if (!host_idle_leave(s, node, why)) {
        s->node[node].aside = true;
        s->loss = true;
        host_notice(s, node,
                    "%s, for the second time; %s, look after that node", why,
                    work_of_one_left(s));
    }
}

/* Sets service->loss where a node is left aside. */
static void host_idle_check(struct host_service *service, uint64_t elapsed_us) {
    struct host_service *s = service;
    for (unsigned i = 0; i < s->machine->nodes && !s->loss; i++) {
        struct host_node *node = &s->node[i];
        node->still_us = is_owed(s, i) ? 0 : node->still_us + elapsed_us;
        /* One that is silent does not answer: failure_detector.h. */
        if (!owes(s, i) || node->still_us <= s->patience_us ||
            node->silent_us > SILENT_US)
            continue;
        char why[80];
        unsigned who = culprit(s, i);
        if (who == CUBE_HOST)
            continue;
        snprintf(why, sizeof why, "answers, but has done nothing for %llu s",
                 (unsigned long long)s->patience_us / 1000000);
        leave_for_good(s, who, why);
    }
}
