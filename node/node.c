#include "node.h"

#include <string.h>

#include "answers.h"
#include "common.h"
#include "incode/predicates/check.h"
#include "looks.h"
#include "node/roles/roles.h"
#include "result.h"
#include "transport/routes.h"

enum { IDLE_MAX_US = 100000, FAREWELL_US = 500000 };

struct node {
    const struct node_board *board;
    struct cube *cube;
    size_t cube_bytes;
    uint16_t window;
    const struct node_role *role; /* NULL: no setup in this generation */
    uint8_t role_number;
    void *role_arena;
    size_t role_bytes;
    bool stopping, closing;
    struct cube_wiring followed; /* its generation is the one at work */
    struct node_counted counted;
    struct node_pong_message pong; /* the answer that is owed, or was last */
    bool pinged;                   /* in this generation */
    bool owes_pong, owes_ready, owes_report;
    struct node_finished_message before; /* of roles before this one */
    struct node_fault fault;
    bool fault_sent;
    struct node_looks looks;
    struct node_answers answers;
    uint32_t work; /* steps and messages of roles: what a pong tells of it */
    struct node_pace pace;
    uint64_t now_us, stop_us;
};

/* Stands in for the links of a node that is only measured. */
static int nowhere(void *context, const uint8_t *bytes, size_t size) {
    (void)context, (void)bytes, (void)size;
    return 0;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): a pipe's signature */
static int nothing(void *context, uint8_t *bytes, size_t size) {
    (void)context, (void)bytes, (void)size;
    return 0;
}

size_t node_arena_needed(const struct node_identity *identity, size_t memory,
                         const struct node_setup_message *setup) {
    struct cube_config config = node_configure(identity, memory);
    const struct node_role *role = node_role_named(setup->role);
    INCODE_ASSERT(role != NULL);
    for (unsigned d = 0; d < CUBE_LINKS_MAX; d++)
        config.pipes[d] = (struct link_pipe){NULL, nowhere, nothing};
    return node_aligned(sizeof(struct node)) +
           node_aligned(cube_arena_bytes(&config)) +
           role->arena_min(memory, setup);
}

struct node *node_start(const struct node_board *board, const char **why) {
    uint8_t *memory = board->arena;
    size_t own = node_aligned(sizeof(struct node));
    struct cube_config config = node_configure(
        &board->identity, board->arena_bytes + board->fixed_bytes);
    memcpy(config.pipes, board->pipes, sizeof config.pipes);
    INCODE_ASSERT((uintptr_t)board->arena % NODE_ALIGNMENT == 0);
    *why = incode_arithmetic_fault();
    if (*why == NULL)
        *why = cube_config_fault(&config);
    if (*why != NULL)
        return NULL;
    if ((uint64_t)board->arena_bytes + board->fixed_bytes > UINT32_MAX) {
        *why = "a node's memory is below 4 GiB"; /* struct node_map says it */
        return NULL;
    }
    size_t cube = node_aligned(cube_arena_bytes(&config));
    if (board->arena_bytes < own + cube) {
        *why = "the memory does not hold the links' windows";
        return NULL;
    }
    struct node *node = board->arena;
    memset(node, 0, sizeof *node);
    node->board = board;
    node->cube_bytes = cube;
    node->window = config.window;
    node->role_arena = memory + own + cube;
    node->role_bytes = board->arena_bytes - own - cube;
    node->cube = cube_init(memory + own, cube, &config);
    INCODE_ASSERT(node->cube != NULL);
    node_looks_init(&node->looks, board, node->cube);
    node->counted.cube = node->cube;
    node->counted.self = board->identity.self;
    node->counted.yield = node_looks_yield(&node->looks);
    node->counted.write = board->write;
    node->counted.context = board->context;
    node_answers_init(&node->answers, board, &node->counted);
    node_pace_init(&node->pace, board->now_us, board->context);
    return node;
}

/* Of its memory, but for its role's. */
static size_t own_bytes(const struct node *n) {
    return n->board->fixed_bytes + node_aligned(sizeof *n) + n->cube_bytes;
}

/* Adds what the role has done. */
static void role_totals(const struct node *n,
                        struct node_finished_message *sum) {
    struct node_finished_message totals;
    memset(&totals, 0, sizeof totals);
    n->role->totals(n->role_arena, &totals, n->now_us);
    totals.memory_high_water += own_bytes(n);
    node_totals_add(sum, &totals);
}

/* What the role did stays counted; what it has is of no use any more. */
static void end_role(struct node *n) {
    if (n->role != NULL) {
        role_totals(n, &n->before);
        n->role = NULL;
    }
}

/* Whatever went before, the setup begins anew. */
static void take_setup(struct node *n, const struct cube_message *message) {
    struct node_setup_message setup;
    end_role(n);
    n->fault.size = 0;
    n->fault_sent = false;
    if (!node_setup_read(&setup, message, 1u << n->board->identity.dimension,
                         &n->fault))
        return;
    const struct node_role *role = node_role_named(setup.role);
    if (role == NULL) {
        node_fault_set(&n->fault, "unknown role #, known are 1..#", setup.role,
                       NODE_ROLES);
        return;
    }
    if (role->start(n->role_arena, n->role_bytes, &setup, &n->counted,
                    &n->fault)) {
        n->role = role;
        n->role_number = setup.role;
        n->owes_ready = true;
    }
}

static void take_ping(struct node *n, const struct cube_message *message) {
    struct node_ping_message ping;
    if (message->size != sizeof ping) {
        node_fault_set(&n->fault, "ping in # bytes, expected #", message->size,
                       sizeof ping);
        return;
    }
    memcpy(&ping, message->data, sizeof ping);
    n->pong.pinged = ping.sent;
    n->pong.received = n->counted.received;
    n->pinged = n->owes_pong = true;
}

/* What comes from the host alone, and what has no content. */
static bool is_expected(struct node *n, const struct cube_message *message) {
    uint8_t type = message->type;
    bool host_only = type == NODE_SETUP || type == NODE_JOB ||
                     type == NODE_CREDIT || type == NODE_UNSPILL ||
                     type == NODE_REPORT || type == NODE_STOP ||
                     type == NODE_PING || type == NODE_REGIONS ||
                     type == NODE_OUT || type == NODE_PAGE_TO_ALL ||
                     type == NODE_QUESTION || type == NODE_RESTART;
    if (host_only && message->source != CUBE_HOST) {
        node_fault_set(&n->fault,
                       "message of type # from node #, expected the host", type,
                       message->source);
        return false;
    }
    if ((type == NODE_REPORT || type == NODE_STOP) && message->size != 0) {
        node_fault_set(&n->fault, "message of type # in # bytes, expected none",
                       type, message->size);
        return false;
    }
    return true;
}

/* What is for a board's loader, which this one may have had before. */
static bool is_for_loader(const struct cube_message *message) {
    return message->type >= NODE_IMAGE_BEGIN && message->type <= NODE_IMAGE_DO;
}

static void serve_message(struct node *n, const struct cube_message *message) {
    if (node_answers_is_for(message)) {
        node_answers_take(&n->answers, message, n->now_us);
        return;
    }
    if (is_for_loader(message))
        return;
    switch (message->type) {
    case NODE_SETUP:
        take_setup(n, message);
        break;
    case NODE_REPORT:
        n->owes_report = true;
        break;
    case NODE_PING:
        take_ping(n, message);
        break;
    case NODE_STOP:
        n->stopping = true;
        n->stop_us = n->now_us;
        break;
    default:
        /* After a fresh start: a message that was sent to the one before.  And
         * who has a fault does not go on with what he has. */
        if (n->role != NULL && !node_fault_is_set(&n->fault))
            n->role->message(n->role_arena, message, n->now_us);
    }
}

static void take_message(struct node *n, const struct cube_message *message) {
    if (is_expected(n, message))
        serve_message(n, message);
    n->counted.received +=
        message->source == CUBE_HOST && message->type != NODE_STOP;
}

static void fill_map(const struct node *n, struct node_map *map) {
    memset(map, 0, sizeof *map);
    map->fixed = (uint32_t)n->board->fixed_bytes;
    map->arena = (uint32_t)n->board->arena_bytes;
    map->memory = map->fixed + map->arena;
    map->cube = (uint32_t)n->cube_bytes;
    map->window = n->window;
    map->node = (uint32_t)node_aligned(sizeof *n);
    if (n->role != NULL)
        n->role->map(n->role_arena, map);
}

static bool send_ready(struct node *n) {
    struct node_ready_message ready;
    memset(&ready, 0, sizeof ready);
    ready.protocol = NODE_PROTOCOL;
    ready.role = n->role_number;
    fill_map(n, &ready.map);
    return node_counted_write(&n->counted, CUBE_HOST, NODE_READY, &ready,
                              sizeof ready) == 0;
}

/* What is new of silent neighbours the host is told unasked: its pings may not
 * come through. */
static void look_at_links(struct node *n) {
    bool news = node_looks_silent(&n->looks, n->now_us);
    n->owes_pong = n->owes_pong || (news && n->pinged);
}

static bool send_pong(struct node *n) {
    n->pong.start = n->board->identity.epoch;
    n->pong.sent = n->counted.sent;
    n->pong.links = node_looks_seen(&n->looks);
    n->pong.silent = node_looks_silent_yet(&n->looks);
    n->pong.refused =
        n->board->refused == NULL ? 0 : n->board->refused(n->board->context);
    n->pong.work = n->work;
    n->pong.awaited =
        n->role == NULL ? INCODE_NONE : n->role->awaited(n->role_arena);
    n->pong.owing = n->role == NULL || n->role->owing == NULL
                        ? CUBE_HOST
                        : n->role->owing(n->role_arena);
    return node_counted_write(&n->counted, CUBE_HOST, NODE_PONG, &n->pong,
                              sizeof n->pong) == 0;
}

/* The statistics, where there is room for them on the link.  epoch: of the job
 * that is done, or 0. */
static bool send_finished(struct node *n, uint32_t epoch) {
    struct node_finished_message finished = n->before;
    if (cube_room(n->cube, CUBE_HOST) == 0)
        return false;
    role_totals(n, &finished);
    node_looks_totals(&n->looks, &finished);
    finished.epoch = epoch;
    finished.start = n->board->identity.epoch;
    finished.sent = n->counted.sent;
    node_counted_put(&n->counted, CUBE_HOST, NODE_FINISHED, &finished,
                     sizeof finished);
    return true;
}

/* A new generation of the wiring: the host begins again with all nodes.  What
 * this one had is of no use, but for what it knows of its work. */
static void follow_wiring(struct node *n) {
    const struct cube_wiring *wiring = cube_wiring(n->cube);
    if (wiring_together(wiring, &n->followed))
        return;
    end_role(n);
    n->followed = *wiring;
    n->pinged = n->owes_pong = n->owes_ready = n->owes_report = false;
    n->fault.size = 0;
    n->fault_sent = false;
    n->counted.received = n->counted.sent = 0;
    node_answers_forget(&n->answers);
}

/* --- what it tells who asks ----------------------------------------------- */

static void tell_who(void *context, struct node_who *who) {
    const struct node *n = context;
    who->role = n->role == NULL ? 0 : n->role_number;
}

static void tell_top(void *context, struct node_top *top) {
    const struct node *n = context;
    struct node_finished_message totals;
    struct incode_gauge gauge = {0};
    node_account(n, &totals);
    if (n->role != NULL) {
        top->role = n->role_number;
        n->role->gauge(n->role_arena, &gauge);
    }
    top->work = n->work;
    top->used = totals.memory_high_water > 0
                    ? (uint32_t)totals.memory_high_water
                    : (uint32_t)own_bytes(n);
    top->pages = gauge.pages;
    top->held = gauge.held;
    top->faces = gauge.faces;
    top->open = gauge.open;
    top->built = totals.statistics.tetrahedra_built;
}

static bool tell_memory(void *context, struct node_ready_message *ready) {
    const struct node *n = context;
    fill_map(n, &ready->map);
    ready->role = n->role == NULL ? 0 : n->role_number;
    return true;
}

static void tell_totals(void *context, struct node_finished_message *totals) {
    const struct node *n = context;
    node_account(n, totals);
    node_looks_totals(&n->looks, totals);
}

static size_t tell_log(void *context, char *text, size_t size) {
    const struct node *n = context;
    if (!node_fault_is_set(&n->fault) || n->fault.size + 1 > size)
        return 0;
    memcpy(text, n->fault.text, n->fault.size);
    text[n->fault.size] = '\n';
    return n->fault.size + 1;
}

static unsigned send_answers(struct node *n) {
    const struct node_teller teller = {n,           tell_who,    tell_top,
                                       tell_memory, tell_totals, tell_log};
    return node_answers_send(&n->answers, &teller, n->now_us);
}

/* Tells the host what is wrong, once.  The node goes on to pass messages of
 * others and to answer pings; it takes another setup. */
static void send_fault(struct node *n) {
    n->fault_sent = node_counted_write(&n->counted, CUBE_HOST, NODE_FAULT,
                                       n->fault.text, n->fault.size) == 0;
}

/* What the role has to say, and what is asked of it. */
static unsigned send_role(struct node *n) {
    const struct node_role *role = n->role;
    unsigned moved = role->send(n->role_arena);
    n->work += moved;
    uint32_t epoch = role->done(n->role_arena);
    if (!node_fault_is_set(&n->fault) && epoch != 0 &&
        send_finished(n, epoch)) {
        role->end(n->role_arena, n->now_us);
        moved++;
    }
    if (n->owes_report && send_finished(n, 0)) {
        n->owes_report = false;
        moved++;
    }
    return moved;
}

/* The farewell is passed on to other nodes first, then said on each link. */
static bool may_stop(struct node *n) {
    uint64_t end = n->stop_us + FAREWELL_US;
    if (!n->stopping)
        return false;
    if (!n->closing && cube_idle(n->cube)) {
        cube_close(n->cube, end);
        n->closing = true;
    }
    for (unsigned d = 0; d < cube_links(n->cube) && n->now_us < end; d++)
        if (!n->closing || !node_looks_parted(&n->looks, d))
            return false;
    return true;
}

static bool is_sound(const struct node *n) {
    return !node_fault_is_set(&n->fault) && n->role != NULL;
}

/* Whether the role takes what has come; one that is broken takes all. */
static bool may_take(struct node *n, const struct cube_message *message) {
    return !is_sound(n) || n->role->may_take == NULL ||
           node_answers_is_for(message) ||
           n->role->may_take(n->role_arena, message);
}

/* Reads a link up to what is not to be taken yet. */
static unsigned read_link(struct node *n, unsigned d) {
    struct cube_message message;
    unsigned moved = 0;
    while (cube_read_from(n->cube, d, &message)) {
        if (!may_take(n, &message)) {
            cube_put_back(n->cube);
            break;
        }
        take_message(n, &message);
        cube_release(n->cube);
        node_looks_between(&n->looks);
        moved++;
    }
    return moved;
}

unsigned node_receive(struct node *node) {
    node->now_us = node->board->now_us(node->board->context);
    unsigned moved = node_looks_poll(&node->looks, node->now_us);
    follow_wiring(node);
    look_at_links(node);
    for (unsigned d = 0; d < cube_links(node->cube); d++)
        moved += read_link(node, d);
    return moved;
}

unsigned node_work(struct node *node) {
    if (!is_sound(node) || node->owes_pong || node->owes_ready)
        return 0;
    node_pace_begin(&node->pace, node->now_us);
    unsigned worked = node->role->work(node->role_arena, &node->pace);
    node->work += worked;
    return worked;
}

enum node_event node_send(struct node *node, unsigned moved) {
    bool sound = is_sound(node);
    node_looks_between(&node->looks);
    if (node_fault_is_set(&node->fault) && !node->fault_sent) {
        send_fault(node);
    } else if (node->owes_pong) {
        node->owes_pong = !send_pong(node);
    } else if (sound && node->owes_ready) {
        node->owes_ready = !send_ready(node);
    } else if (sound) {
        moved += send_role(node);
        moved += node_fault_is_set(&node->fault); /* to be told at once */
    }
    moved += send_answers(node);
    if (may_stop(node) || node_reset_why(node) != NODE_RESET_OVER)
        return NODE_STOPPED;
    if (moved > 0)
        return NODE_BUSY;
    node_looks_idle(&node->looks);
    return NODE_IDLE;
}

enum node_reset node_reset_why(const struct node *node) {
    return node_answers_restart(&node->answers, node->now_us);
}

enum node_event node_step(struct node *node) {
    node->looks.tends = true;
    unsigned moved = node_receive(node);
    return node_send(node, moved + node_work(node));
}

uint64_t node_wait_us(const struct node *node) {
    uint64_t due = cube_next_due_us(node->cube, node->now_us);
    if (node->stopping && due > FAREWELL_US)
        due = FAREWELL_US;
    return due < IDLE_MAX_US ? due : IDLE_MAX_US;
}

unsigned node_links(const struct node *node,
                    struct node_link_state state[CUBE_LINKS_MAX]) {
    return node_answers_links(&node->answers, state);
}

bool node_has_met(const struct node *node) {
    return node_looks_seen(&node->looks) != 0;
}

uint32_t node_held(const struct node *node) {
    return node->role == NULL ? 0 : node->role->held(node->role_arena);
}

void node_account(const struct node *node,
                  struct node_finished_message *totals) {
    *totals = node->before;
    if (node->role != NULL)
        role_totals(node, totals);
}

const struct cube_statistics *node_messages(const struct node *node) {
    return cube_statistics(node->cube);
}

enum node_reset node_run(struct node *node) {
    const struct node_board *board = node->board;
    enum node_event event;
    while ((event = node_step(node)) != NODE_STOPPED)
        if (event == NODE_IDLE)
            board->idle(board->context, node_wait_us(node));
    return node_reset_why(node);
}
