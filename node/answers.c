#include "answers.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "version.h"

enum {
    RESTART_US_MIN = 50000, /* the order itself is acknowledged meanwhile */
    RESTART_US_MAX = 500000
};

void node_answers_init(struct node_answers *answers,
                       const struct node_board *board,
                       struct node_counted *counted) {
    memset(answers, 0, sizeof *answers);
    answers->board = board;
    answers->counted = counted;
    answers->start_us = board->now_us(board->context);
}

void node_answers_forget(struct node_answers *answers) {
    answers->asked_count = answers->echo_count = 0;
    answers->probing = false;
}

bool node_answers_is_for(const struct cube_message *message) {
    return message->type == NODE_QUESTION || message->type == NODE_RESTART ||
           message->type == NODE_ECHO || message->type == NODE_ECHOED;
}

/* --- what comes ----------------------------------------------------------- */

static void begin_probe(struct node_answers *a,
                        const struct node_question_message *question) {
    const struct node_identity *identity = &a->board->identity;
    bool there = question->node < 1u << identity->dimension &&
                 cube_reaches(a->counted->cube, (uint16_t)question->node);
    a->probing = true;
    a->probe = *question;
    a->probe_tag++;
    a->probe_sent = false;
    a->probe_back = !there || question->node == identity->self;
    a->probe_rtt_us = there ? 0 : UINT32_MAX;
}

static void take_question(struct node_answers *a,
                          const struct cube_message *message) {
    struct node_question_message question;
    if (message->size != sizeof question)
        return; /* of another version: the host has no answer then */
    memcpy(&question, message->data, sizeof question);
    if (question.what != NODE_PROBE) {
        if (a->asked_count < NODE_ASKED_MAX)
            a->asked[a->asked_count++] = question;
    } else if (!a->probing || a->probe.tag != question.tag) {
        begin_probe(a, &question);
    }
}

static void take_restart(struct node_answers *a,
                         const struct cube_message *message, uint64_t now_us) {
    struct node_restart_message order;
    if (message->size != sizeof order)
        return;
    memcpy(&order, message->data, sizeof order);
    if (a->restart == 0 &&
        (order.what == NODE_RESTART_PLAIN || order.what == NODE_RESTART_STAY)) {
        a->restart = order.what;
        a->restart_us = now_us;
    }
}

static void take_echo(struct node_answers *a,
                      const struct cube_message *message, uint64_t now_us) {
    struct node_echo_message echo;
    if (message->size != sizeof echo ||
        message->source >= 1u << a->board->identity.dimension)
        return;
    memcpy(&echo, message->data, sizeof echo);
    if (message->type == NODE_ECHO) {
        if (a->echo_count < NODE_ECHOES_MAX) {
            a->echo[a->echo_count].source = message->source;
            a->echo[a->echo_count++].tag = echo.tag;
        }
    } else if (a->probing && a->probe_sent && !a->probe_back &&
               echo.tag == a->probe_tag && message->source == a->probe.node) {
        a->probe_back = true;
        a->probe_rtt_us = (uint32_t)(now_us - a->probe_us);
    }
}

void node_answers_take(struct node_answers *answers,
                       const struct cube_message *message, uint64_t now_us) {
    if (message->type == NODE_QUESTION && message->source == CUBE_HOST)
        take_question(answers, message);
    else if (message->type == NODE_RESTART && message->source == CUBE_HOST)
        take_restart(answers, message, now_us);
    else if (message->type == NODE_ECHO || message->type == NODE_ECHOED)
        take_echo(answers, message, now_us);
}

/* --- what is answered ----------------------------------------------------- */

static uint32_t least(uint64_t value) {
    return value < UINT32_MAX ? (uint32_t)value : UINT32_MAX;
}

void node_who_name(uint8_t *field, size_t size, const char *name) {
    size_t length = 0;
    while (length < size && name[length] != '\0')
        length++;
    memset(field, 0, size);
    memcpy(field, name, length);
}

static size_t tell_who(const struct node_answers *a,
                       const struct node_teller *teller, uint64_t now_us,
                       uint8_t *bytes) {
    const struct node_board *board = a->board;
    struct node_who who;
    memset(&who, 0, sizeof who);
    who.protocol = NODE_PROTOCOL;
    who.kind = NODE_KIND_PROCESS;
    node_who_name(who.board, sizeof who.board, "linux");
    node_who_name(who.version, sizeof who.version, NODE_VERSION);
    who.epoch = board->identity.epoch;
    who.uptime_s = least((now_us - a->start_us) / 1000000);
    who.memory = (uint32_t)(board->arena_bytes + board->fixed_bytes);
    if (board->who != NULL)
        board->who(board->context, &who);
    if (teller->who != NULL)
        teller->who(teller->context, &who);
    memcpy(bytes, &who, sizeof who);
    return sizeof who;
}

static void fill_link(const struct node_answers *a, unsigned d,
                      struct node_link_state *link) {
    const struct cube *cube = a->counted->cube;
    const struct node_board *board = a->board;
    const struct link_statistics *s = cube_link_statistics(cube, d);
    const struct link_peer *peer = cube_link_peer(cube, d);
    memset(link, 0, sizeof *link);
    link->state = (uint8_t)cube_link_state(cube, d);
    link->refusal = (uint8_t)peer->refusal;
    link->peer_port = peer->port;
    link->peer_node = peer->node;
    link->dead = cube_link_is_dead(cube, d);
    link->rtt_us = s->rtt_us;
    link->frames_in = least(s->frames_received);
    link->frames_out = least(s->frames_sent);
    link->retransmitted = least(s->retransmitted);
    link->bad = least(s->bad_header + s->bad_crc + s->bad_code);
    link->lost =
        board->lost == NULL ? UINT32_MAX : board->lost(board->context, d);
    link->bytes_in = s->bytes_received;
    link->bytes_out = s->bytes_sent;
}

unsigned node_answers_links(const struct node_answers *answers,
                            struct node_link_state state[CUBE_LINKS_MAX]) {
    unsigned links = cube_links(answers->counted->cube);
    for (unsigned d = 0; d < links; d++)
        fill_link(answers, d, &state[d]);
    return links;
}

static size_t tell_links(const struct node_answers *a, uint8_t *bytes) {
    struct node_link_state state[CUBE_LINKS_MAX];
    size_t size = node_answers_links(a, state) * sizeof state[0];
    memcpy(bytes, state, size);
    return size;
}

static size_t tell_top(const struct node_answers *a,
                       const struct node_teller *teller, uint64_t now_us,
                       uint8_t *bytes) {
    const struct node_board *board = a->board;
    struct node_top top;
    memset(&top, 0, sizeof top);
    if (teller->top == NULL)
        return 0;
    top.memory = (uint32_t)(board->arena_bytes + board->fixed_bytes);
    top.wall_us = now_us - a->start_us;
    top.busy_us = board->busy_us(board->context);
    for (unsigned d = 0; d < cube_links(a->counted->cube); d++) {
        const struct link_statistics *s =
            cube_link_statistics(a->counted->cube, d);
        top.bytes_in += s->bytes_received;
        top.bytes_out += s->bytes_sent;
    }
    teller->top(teller->context, &top);
    memcpy(bytes, &top, sizeof top);
    return sizeof top;
}

static size_t tell_memory(const struct node_teller *teller, uint8_t *bytes) {
    struct node_ready_message ready;
    memset(&ready, 0, sizeof ready);
    ready.protocol = NODE_PROTOCOL;
    if (teller->memory == NULL || !teller->memory(teller->context, &ready))
        return 0;
    memcpy(bytes, &ready, sizeof ready);
    return sizeof ready;
}

static size_t tell_totals(const struct node_answers *a,
                          const struct node_teller *teller, uint8_t *bytes) {
    struct node_finished_message totals;
    memset(&totals, 0, sizeof totals);
    if (teller->totals == NULL)
        return 0;
    teller->totals(teller->context, &totals);
    totals.start = a->board->identity.epoch;
    totals.sent = a->counted->sent;
    memcpy(bytes, &totals, sizeof totals);
    return sizeof totals;
}

static size_t tell_log(const struct node_answers *a,
                       const struct node_teller *teller, uint8_t *bytes,
                       size_t size) {
    const struct node_board *board = a->board;
    size_t used = 0;
    if (board->log != NULL)
        used = board->log(board->context, (char *)bytes, size);
    if (teller->log != NULL)
        used += teller->log(teller->context, (char *)bytes + used, size - used);
    INCODE_ASSERT(used <= size);
    return used;
}

/* Bytes behind the head. */
static size_t tell(const struct node_answers *a,
                   const struct node_teller *teller, uint32_t what,
                   uint64_t now_us, uint8_t *bytes, size_t size) {
    switch (what) {
    case NODE_WHO:
        return tell_who(a, teller, now_us, bytes);
    case NODE_LINKS:
        return tell_links(a, bytes);
    case NODE_TOP:
        return tell_top(a, teller, now_us, bytes);
    case NODE_MEMORY:
        return tell_memory(teller, bytes);
    case NODE_TOTALS:
        return tell_totals(a, teller, bytes);
    case NODE_LOG:
        return tell_log(a, teller, bytes, size);
    default:
        return 0; /* of a later version: nothing is known of it */
    }
}

/* An answer is made where there is room for it alone. */
static bool answer(struct node_answers *a, const struct node_teller *teller,
                   const struct node_question_message *question,
                   uint64_t now_us) {
    uint8_t bytes[CUBE_PAYLOAD_MAX];
    struct node_answer_head head = {question->tag, question->what};
    if (cube_room(a->counted->cube, CUBE_HOST) == 0)
        return false;
    memcpy(bytes, &head, sizeof head);
    size_t size =
        sizeof head + tell(a, teller, question->what, now_us,
                           bytes + sizeof head, sizeof bytes - sizeof head);
    node_counted_put(a->counted, CUBE_HOST, NODE_ANSWER, bytes, size);
    return true;
}

static unsigned send_answers(struct node_answers *a,
                             const struct node_teller *teller,
                             uint64_t now_us) {
    unsigned sent = 0;
    while (sent < a->asked_count && answer(a, teller, &a->asked[sent], now_us))
        sent++;
    a->asked_count -= sent;
    memmove(a->asked, a->asked + sent, a->asked_count * sizeof a->asked[0]);
    return sent;
}

static unsigned send_echoes(struct node_answers *a) {
    unsigned sent = 0;
    while (sent < a->echo_count) {
        struct node_echo_message echo = {a->echo[sent].tag};
        if (cube_write(a->counted->cube, a->echo[sent].source, NODE_ECHOED,
                       &echo, sizeof echo) != 0)
            break;
        sent++;
    }
    a->echo_count -= sent;
    memmove(a->echo, a->echo + sent, a->echo_count * sizeof a->echo[0]);
    return sent;
}

/* The way out, and the answer once it is known. */
static unsigned send_probe(struct node_answers *a, uint64_t now_us) {
    struct {
        struct node_answer_head head;
        struct node_probe probe;
    } found = {{a->probe.tag, NODE_PROBE}, {a->probe.node, a->probe_rtt_us}};
    struct node_echo_message echo = {a->probe_tag};
    if (!a->probe_back && !a->probe_sent) {
        a->probe_sent = cube_write(a->counted->cube, (uint16_t)a->probe.node,
                                   NODE_ECHO, &echo, sizeof echo) == 0;
        a->probe_us = now_us;
        return a->probe_sent;
    }
    if (!a->probe_back && now_us - a->probe_us >= NODE_PROBE_US) {
        a->probe_back = true;
        found.probe.rtt_us = a->probe_rtt_us = UINT32_MAX;
    }
    if (a->probe_back && node_counted_write(a->counted, CUBE_HOST, NODE_ANSWER,
                                            &found, sizeof found) == 0) {
        a->probing = false;
        return 1;
    }
    return 0;
}

unsigned node_answers_send(struct node_answers *answers,
                           const struct node_teller *teller, uint64_t now_us) {
    unsigned sent = send_echoes(answers);
    if (answers->asked_count > 0)
        sent += send_answers(answers, teller, now_us);
    if (answers->probing)
        sent += send_probe(answers, now_us);
    return sent;
}

enum node_reset node_answers_restart(const struct node_answers *answers,
                                     uint64_t now_us) {
    uint64_t passed_us = now_us - answers->restart_us;
    if (answers->restart == 0 || passed_us < RESTART_US_MIN ||
        (passed_us < RESTART_US_MAX && !cube_idle(answers->counted->cube)))
        return NODE_RESET_OVER;
    return answers->restart == NODE_RESTART_STAY ? NODE_RESET_STAY
                                                 : NODE_RESET_AGAIN;
}

/* --- configure ------------------------------------------------------------ */

/* A wire that takes what is given it: as many frames to the host and back,
 * where they are a hundredth of the memory, that each end is woken for eight.
 */
enum { HOST_WINDOW = 16, HOST_WINDOW_FROM = 3 << 20 };

/* Frames a window, where the identity leaves it open: an eighth of a small
 * memory at most goes to windows. */
static uint16_t window_for(size_t bytes) {
    return bytes >= 2u << 20 ? 8 : bytes >= 1u << 20 ? 4 : 2;
}

struct cube_config node_configure(const struct node_identity *identity,
                                  size_t memory) {
    struct cube_config config;
    memset(&config, 0, sizeof config);
    config.self = identity->self;
    config.dimension = identity->dimension;
    config.window =
        identity->window != 0 ? identity->window : window_for(memory);
    config.epoch = identity->epoch;
    config.host_port = identity->host_port;
    config.host_ports = identity->host_ports;
    config.dead_us = identity->dead_us;
    if (identity->window == 0 && identity->serial_baud == 0 &&
        memory >= HOST_WINDOW_FROM)
        config.host_window = HOST_WINDOW;
    cube_for_serial(&config, identity->serial_baud);
    return config;
}
