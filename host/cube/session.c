#include "session.h"

#include <stdlib.h>
#include <string.h>

#include "host/service/parts.h"
#include "session_wiring.h"
#include "host/service/watchers.h"

enum {
    CHECK_EVERY_US = 20000,
    ASK_AGAIN_US = 1000000,
    WHO_AGAIN_US_MAX = 4000000, /* of a node that does not answer */
    PING_EVERY_US = 1000000,    /* all nodes once, at most, */
    PING_A_NODE_US = 5000,      /* and no more than one in this time, */
    PING_BITS = 6000,           /* nor more than a tenth of a slow wire */
    PING_RTTS = 4,              /* nor a node more than once in so many of the
                                   times that pongs take, as they may fill a
                                   wire that is slower than is said of it, */
    PING_LATE_US = 5000000,     /* but as often as this, */
    PING_A_NODE_LATE_US = 1000000, /* or this a node: little on any wire */
    PING_AGAIN = 2,                /* rounds without a pong */
    RESTART_US = 5000000,          /* for room for an order */
    FAREWELL_US = 1000000,
    OUTDONE_MAX = 64
};

static struct host_session_node *node_of(struct host_session *v, unsigned i) {
    return &v->node[i];
}

/* In which all nodes are pinged once. */
static uint64_t ping_round_us(const struct host_session *v) {
    const struct host_machine *m = v->machine;
    uint64_t one = PING_A_NODE_US;
    if (m->serial_baud != 0) {
        uint64_t slow = UINT64_C(1000000) * PING_BITS / m->serial_baud;
        one = slow > one ? slow : one;
    }
    uint64_t late = UINT64_C(1) * PING_A_NODE_LATE_US * m->nodes;
    uint64_t us = PING_RTTS * v->pong_rtt_us;
    late = late < PING_LATE_US ? PING_LATE_US : late;
    us = us < late ? us : late;
    us = us < one * m->nodes ? one * m->nodes : us;
    return us < PING_EVERY_US ? PING_EVERY_US : us;
}

/* The longest of late. */
static void note_rtt(struct host_session *v, uint64_t us) {
    uint64_t late = v->pong_rtt_us - v->pong_rtt_us / v->machine->nodes / 2;
    v->pong_rtt_us = us > late ? us : late;
}

int host_session_open(struct host_session *session,
                      struct host_machine *machine, struct host_error *error) {
    struct host_session *v = session;
    unsigned nodes = machine->nodes;
    memset(v, 0, sizeof *v);
    v->machine = machine;
    v->node = calloc(nodes, sizeof *v->node);
    v->answers = calloc(nodes, HOST_SESSION_ANSWER_BYTES);
    v->dead = calloc(nodes, sizeof *v->dead);
    if (v->node == NULL || v->answers == NULL || v->dead == NULL) {
        host_session_close(v);
        return host_fail_memory(error, "the nodes' answers");
    }
    for (unsigned i = 0; i < nodes; i++)
        v->node[i].answer = v->answers + (size_t)i * HOST_SESSION_ANSWER_BYTES;
    v->cube = host_cube_make(machine, 0, &v->cube_memory, error);
    if (v->cube == NULL) {
        host_session_close(v);
        return error->code;
    }
    v->now_us = machine->now_us(machine->context);
    v->opened_us = v->wire_us = v->now_us;
    host_session_wiring_renew(v);
    return 0;
}

/* --- what nodes say ------------------------------------------------------- */

/* A start that was not known. */
static void begin_start(struct host_session *v, unsigned i, uint32_t start) {
    struct host_session_node *node = node_of(v, i);
    node->starts++;
    node->start = start;
    node->there = false;
    node->links = 0;
    memset(&node->who, 0, sizeof node->who);
    node->who_due = true;
    node->who_again_us = 0;
}

/* What is known of a link, both ends know. */
static void note_links(struct host_session *v, unsigned i, uint32_t seen) {
    node_of(v, i)->links |= seen;
    for (unsigned d = 0; d < v->machine->dimension; d++)
        node_of(v, i ^ 1u << d)->links |= seen & (uint32_t)1 << d;
}

static void take_pong(struct host_session *v,
                      const struct cube_message *message) {
    struct node_pong_message pong;
    struct host_session_node *node = node_of(v, message->source);
    if (message->size != sizeof pong)
        return;
    memcpy(&pong, message->data, sizeof pong);
    /* A board that is told its epoch by neighbours has the same again where
     * they began anew as well; but not its counts. */
    if (pong.start != node->start || pong.sent < node->received) {
        node->received = 0;
        begin_start(v, message->source, pong.start);
    }
    if (node->pong_us == 0 || pong.silent != node->silent)
        node->silent_us = v->now_us;
    if (node->pinged)
        note_rtt(v, v->now_us - node->ping_us);
    node->pong_us = v->now_us;
    node->seen = pong.links;
    node->silent = pong.silent;
    node->refused = pong.refused;
    node->pinged = false;
    note_links(v, message->source, pong.links);
}

/* Of another version of the program the first field alone is known. */
static void take_who(struct host_session *v, unsigned i, const uint8_t *data,
                     size_t size) {
    struct host_session_node *node = node_of(v, i);
    struct node_who who;
    memset(&who, 0, sizeof who);
    if (size < sizeof who.protocol)
        return;
    memcpy(&who.protocol, data, sizeof who.protocol);
    if (who.protocol == NODE_PROTOCOL && size == sizeof who) {
        memcpy(&who, data, sizeof who);
        if (who.epoch != node->start)
            begin_start(v, i, who.epoch);
    }
    uint64_t age_us = UINT64_C(1000000) * who.uptime_s;
    node->born_us = age_us < v->now_us ? v->now_us - age_us : 0;
    node->who = who;
    node->there = true;
    node->who_due = false;
}

static void take_answer(struct host_session *v,
                        const struct cube_message *message) {
    struct host_session_node *node = node_of(v, message->source);
    struct node_answer_head head;
    if (message->size < sizeof head)
        return;
    memcpy(&head, message->data, sizeof head);
    const uint8_t *data = message->data + sizeof head;
    size_t size = message->size - sizeof head;
    if (head.what == NODE_WHO)
        take_who(v, message->source, data, size);
    if (v->machine->watchers != NULL &&
        host_watching_take(&v->watching, v->machine, message))
        return;
    if (head.tag != v->tag || head.what != v->what ||
        !host_node_set_has(&v->wanted, message->source))
        return;
    memcpy(node->answer, data, size);
    node->size = size;
    node->answered = true;
    node->question_due = false;
    node->rtt_us = (uint32_t)(v->now_us - node->question_us);
    host_node_set_remove(&v->wanted, message->source);
}

static void take_message(struct host_session *v,
                         const struct cube_message *message) {
    if (message->source >= v->machine->nodes)
        return;
    struct host_session_node *node = node_of(v, message->source);
    node->heard_us = v->now_us;
    node->heard = true;
    if (message->type == NODE_PONG)
        take_pong(v, message);
    else if (message->type == NODE_ANSWER)
        take_answer(v, message);
    else if (v->take != NULL)
        v->take(v->context, message);
    node->received++;
}

/* --- what they are asked -------------------------------------------------- */

/* What is wanted `now`, or has been asked and is `still` open for too long. */
static bool is_due(bool now, bool still, uint64_t asked_us, uint64_t again_us,
                   uint64_t now_us) {
    return now || (still && now_us - asked_us >= again_us);
}

/* Not while the answer may be on its way. */
static uint64_t again_us(const struct host_session *v, uint64_t us) {
    uint64_t late = 2 * v->pong_rtt_us;
    late = late < WHO_AGAIN_US_MAX ? late : WHO_AGAIN_US_MAX;
    return us < late ? late : us;
}

static void find_due(struct host_session *v, unsigned i) {
    struct host_session_node *node = node_of(v, i);
    bool asked = host_node_set_has(&v->wanted, i);
    node->who_due = is_due(node->who_due, !node->there, node->who_us,
                           again_us(v, node->who_again_us), v->now_us);
    node->question_due = is_due(node->question_due, asked, node->question_us,
                                again_us(v, ASK_AGAIN_US), v->now_us);
    node->ping_due = is_due(node->ping_due, node->pinged, node->ping_us,
                            PING_AGAIN * ping_round_us(v), v->now_us);
}

static bool write_question(struct host_session *v, unsigned i, uint32_t tag,
                           uint32_t what, uint32_t target) {
    struct node_question_message question = {tag, what, target};
    return cube_write(v->cube, (uint16_t)i, NODE_QUESTION, &question,
                      sizeof question) == 0;
}

static bool write_ping(struct host_session *v, unsigned i) {
    struct node_ping_message ping = {0};
    return cube_write(v->cube, (uint16_t)i, NODE_PING, &ping, sizeof ping) == 0;
}

/* Sends what is due to a node; how much. */
static unsigned serve(struct host_session *v, unsigned i) {
    struct host_session_node *node = node_of(v, i);
    unsigned sent = 0;
    if (node->who_due &&
        write_question(v, i, HOST_SESSION_WHO_TAG, NODE_WHO, 0)) {
        node->who_due = false;
        node->who_us = v->now_us;
        node->who_again_us = node->who_again_us == 0 ? ASK_AGAIN_US
                             : 2 * node->who_again_us < WHO_AGAIN_US_MAX
                                 ? 2 * node->who_again_us
                                 : WHO_AGAIN_US_MAX;
        sent++;
    }
    if (node->question_due &&
        write_question(v, i, v->tag, v->what, v->target)) {
        node->question_due = false;
        node->question_us = v->now_us;
        sent++;
    }
    struct node_question_message theirs;
    if (node->there && host_watching_due(&v->watching, i, &theirs) &&
        write_question(v, i, theirs.tag, theirs.what, 0)) {
        host_watching_sent(&v->watching, i);
        sent++;
    }
    if (node->ping_due && write_ping(v, i)) {
        node->ping_due = false;
        node->pinged = true;
        node->ping_us = v->now_us;
        sent++;
    }
    return sent;
}

static unsigned serve_all(struct host_session *v) {
    unsigned sent = 0, nodes = v->machine->nodes;
    for (unsigned k = 0; k < nodes; k++) {
        unsigned i = (v->turn + k) % nodes;
        if (cube_reaches(v->cube, (uint16_t)i)) {
            find_due(v, i);
            sent += serve(v, i);
        }
    }
    v->turn = v->turn + 1 < nodes ? v->turn + 1 : 0;
    return sent;
}

/* Each node once a round, one after the other. */
static void ping_in_turn(struct host_session *v) {
    uint64_t every = ping_round_us(v) / v->machine->nodes;
    unsigned most = v->machine->nodes;
    for (; most > 0 && v->now_us - v->ping_us >= every; most--) {
        struct host_session_node *node = node_of(v, v->ping_turn);
        node->ping_due = node->ping_due || !node->pinged;
        v->ping_turn = (v->ping_turn + 1) % v->machine->nodes;
        v->ping_us += every;
    }
    if (most == 0)
        v->ping_us = v->now_us;
}

/* --- rounds --------------------------------------------------------------- */

static int check_outdone(const struct host_session *v,
                         struct host_error *error) {
    return cube_statistics(v->cube)->outdone <= OUTDONE_MAX
               ? 0
               : host_fail(error, HOST_CUBE,
                           "node %u link %u: tells of a generation of another "
                           "host, and goes back to it when it is told a new "
                           "one; restart the nodes",
                           cube_wiring(v->cube)->gateway,
                           v->machine->dimension);
}

/* Whether another host has the cube, which may have died just before. */
static int check_use(struct host_session *v, struct host_error *error) {
    enum host_in_use_state use = host_in_use_look(
        &v->use, v->machine, cube_link_peer(v->cube, host_session_wire(v)),
        v->now_us);
    v->in_use = use != HOST_FREE;
    if (use == HOST_STAYS) {
        return host_in_use_fail(v->machine, cube_wiring(v->cube)->gateway,
                                error);
    }
    return 0;
}

static int check(struct host_session *v, struct host_error *error) {
    if (v->now_us - v->check_us < CHECK_EVERY_US)
        return 0;
    v->check_us = v->now_us;
    if (v->machine->check(v->machine->context, error) != 0 ||
        check_outdone(v, error) != 0)
        return error->code;
    uint64_t heard_us = 2 * ping_round_us(v);
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        struct host_session_node *node = node_of(v, i);
        node->heard =
            node->heard_us != 0 && v->now_us - node->heard_us <= heard_us;
    }
    ping_in_turn(v);
    host_session_wiring_look(v);
    return 0;
}

static void look_out(struct host_session *v) {
    static const struct host_watchers_progress none;
    host_watching_look(&v->watching, v->machine, v->now_us, &none);
    for (unsigned i = 0; v->watching.asked && i < v->machine->nodes; i++)
        if (!v->node[i].there)
            host_watching_leave_out(&v->watching, i);
}

int host_session_round(struct host_session *session, uint64_t wait_us,
                       struct host_error *error) {
    struct host_session *v = session;
    const struct host_machine *m = v->machine;
    struct cube_message message;
    v->now_us = m->now_us(m->context);
    unsigned moved = (unsigned)cube_poll(v->cube, v->now_us);
    if (cube_wiring(v->cube)->generation != v->generation)
        host_session_wiring_begin(v); /* nodes knew a later one */
    while (cube_read(v->cube, &message)) {
        take_message(v, &message);
        cube_release(v->cube);
        moved++;
    }
    look_out(v);
    moved += serve_all(v);
    if (check_use(v, error) != 0 || check(v, error) != 0)
        return error->code;
    if (moved == 0 && wait_us > 0) {
        uint64_t due = cube_next_due_us(v->cube, v->now_us);
        due = due < CHECK_EVERY_US ? due : CHECK_EVERY_US;
        m->idle(m->context, due < wait_us ? due : wait_us);
    }
    return 0;
}

bool host_session_send(struct host_session *session, uint16_t dest,
                       uint8_t type, const void *data, size_t size) {
    return cube_write(session->cube, dest, type, data, size) == 0;
}

int host_session_restart(struct host_session *session,
                         const struct host_node_set *set,
                         enum node_restart what, struct host_error *error) {
    struct host_session *v = session;
    struct node_restart_message restart = {(uint32_t)what};
    uint64_t begun_us = v->now_us;
    unsigned i = 0;
    while (i < v->machine->nodes && v->now_us - begun_us < RESTART_US)
        if (!host_node_set_has(set, i) ||
            host_session_send(v, (uint16_t)i, NODE_RESTART, &restart,
                              sizeof restart))
            i++;
        else if (host_session_round(v, CHECK_EVERY_US, error) != 0)
            return error->code;
    return host_session_round(v, 0, error); /* it is on its way */
}

/* --- leaving -------------------------------------------------------------- */

/* The host's wires at whose end somebody is. */
static uint32_t links_up(const struct host_session *v) {
    uint32_t up = 0;
    for (unsigned d = 0; d < cube_links(v->cube); d++)
        up |= (uint32_t)(cube_link_state(v->cube, d) == LINK_UP) << d;
    return up;
}

/* Whether one of those has not heard the farewell. */
static bool parting(const struct host_session *v, uint32_t links) {
    for (unsigned d = 0; d < cube_links(v->cube); d++)
        if ((links >> d & 1) != 0 &&
            cube_link_state(v->cube, d) == LINK_CLOSING)
            return true;
    return false;
}

/* What waits for nodes that take nothing would hold up the farewell: it is
 * dropped. */
static void part(struct host_session *v) {
    const struct host_machine *m = v->machine;
    struct cube_message message;
    uint32_t up = links_up(v);
    host_session_wiring_renew(v);
    uint64_t end_us = m->now_us(m->context) + FAREWELL_US;
    cube_close(v->cube, end_us);
    while ((v->now_us = m->now_us(m->context)) < end_us && parting(v, up)) {
        unsigned moved = (unsigned)cube_poll(v->cube, v->now_us);
        while (cube_read(v->cube, &message)) {
            cube_release(v->cube);
            moved++;
        }
        if (moved == 0) {
            uint64_t due = cube_next_due_us(v->cube, v->now_us);
            m->idle(m->context, due < CHECK_EVERY_US ? due : CHECK_EVERY_US);
        }
    }
}

void host_session_close(struct host_session *session) {
    struct host_session *v = session;
    if (v->cube != NULL)
        part(v);
    free(v->cube_memory);
    free(v->node);
    free(v->answers);
    free(v->dead);
    memset(v, 0, sizeof *v);
}

/* What waits until a session knows something, round by round. */

enum {
    SETTLED_US = 2000000, /* of a generation, in which who can be reached
                             has answered */
    NOBODY_US = 4000000,  /* at the host's wire */
    WIRES_US = 3000000    /* in which wires of a node come up */
};

/* Rounds until `done`, at most so long. */
static int until(struct host_session *v, uint64_t wait_us,
                 bool (*done)(const struct host_session *v,
                              const struct host_node_set *set),
                 const struct host_node_set *set, struct host_error *error) {
    uint64_t begun_us = v->machine->now_us(v->machine->context);
    v->now_us = begun_us;
    while (!done(v, set) && v->now_us - begun_us < wait_us)
        if (host_session_round(v, wait_us - (v->now_us - begun_us), error) != 0)
            return error->code;
    return 0;
}

static bool all_there(const struct host_session *v,
                      const struct host_node_set *set) {
    for (unsigned i = 0; i < v->machine->nodes; i++)
        if (host_node_set_has(set, i) && !v->node[i].there)
            return false;
    return true;
}

int host_session_wait(struct host_session *session,
                      const struct host_node_set *set, uint64_t wait_us,
                      struct host_error *error) {
    bool was;
    int status;
    do { /* a round fails within 9 s where the other host stays */
        was = session->in_use;
        status = until(session, wait_us, all_there, set, error);
    } while (status == 0 && (was || session->in_use) &&
             !all_there(session, set));
    return status;
}

/* A wire that was found dead may be one on the way round which others come. */
static bool all_settled(const struct host_session *v,
                        const struct host_node_set *set) {
    bool late = v->now_us - v->began_us >= SETTLED_US;
    enum link_state wire = cube_link_state(v->cube, host_session_wire(v));
    if (wire != LINK_UP && !v->in_use && v->now_us - v->opened_us >= NOBODY_US)
        return true;
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        bool known = v->node[i].there && v->node[i].pong_us != 0;
        if (host_node_set_has(set, i) && !known &&
            (!late || cube_reaches(v->cube, (uint16_t)i)))
            return false;
    }
    return true;
}

int host_session_settle(struct host_session *session,
                        const struct host_node_set *set, uint64_t wait_us,
                        struct host_error *error) {
    return until(session, wait_us, all_settled, set, error);
}

static bool wires_settled(const struct host_session *v,
                          const struct host_node_set *set) {
    (void)set;
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        const struct host_session_node *node = &v->node[i];
        if (node->there && node->heard && node->pong_us == 0)
            return false; /* it has not said */
    }
    return host_session_faults_are_old(v, WIRES_US) ||
           host_session_faults(v, NULL, NULL) == 0;
}

int host_session_settle_wires(struct host_session *session, uint64_t wait_us,
                              struct host_error *error) {
    return until(session, wait_us, wires_settled, NULL, error);
}

static bool all_answered(const struct host_session *v,
                         const struct host_node_set *set) {
    for (unsigned i = 0; i < v->machine->nodes; i++)
        if (host_node_set_has(set, i) && !v->node[i].answered &&
            cube_reaches(v->cube, (uint16_t)i))
            return false;
    return true;
}

int host_session_ask(struct host_session *session,
                     const struct host_node_set *set, enum node_question what,
                     unsigned target, uint64_t wait_us,
                     struct host_error *error) {
    struct host_session *v = session;
    v->tag =
        v->tag + 1 == HOST_WATCHERS_TAG ? HOST_SESSION_WHO_TAG + 1 : v->tag + 1;
    v->what = what;
    v->target = target;
    v->wanted = *set;
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        struct host_session_node *node = &v->node[i];
        node->answered = false;
        node->size = 0;
        node->question_due = host_node_set_has(set, i);
    }
    int status = until(v, wait_us, all_answered, set, error);
    memset(&v->wanted, 0, sizeof v->wanted);
    for (unsigned i = 0; i < v->machine->nodes; i++)
        v->node[i].question_due = false;
    return status;
}
