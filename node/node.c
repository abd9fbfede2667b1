#include "node.h"

#include <string.h>

#include "arena.h"
#include "incode/predicates/check.h"
#include "looks.h"
#include "node/roles/roles.h"
#include "totals.h"
#include "transport/wiring.h"

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
    uint32_t work; /* steps and messages of roles: what a pong tells of it */
    struct node_pace pace;
    uint64_t now_us, stop_us;
};

/* Frames a window, where the identity leaves it open: an eighth of a small
 * memory at most goes to windows. */
static uint16_t window_for(size_t bytes)
{
    return bytes >= 2u << 20 ? 8 : bytes >= 1u << 20 ? 4 : 2;
}

/* The cube as this node's identity and memory make it. */
static struct cube_config configure(const struct node_identity *identity,
                                    size_t memory)
{
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
    cube_for_serial(&config, identity->serial_baud);
    return config;
}

/* Stands in for the links of a node that is only measured. */
static int nowhere(void *context, const uint8_t *bytes, size_t size)
{
    (void)context, (void)bytes, (void)size;
    return 0;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): a pipe's signature */
static int nothing(void *context, uint8_t *bytes, size_t size)
{
    (void)context, (void)bytes, (void)size;
    return 0;
}

size_t node_arena_needed(const struct node_identity *identity, size_t memory,
                         const struct node_setup_message *setup)
{
    struct cube_config config = configure(identity, memory);
    const struct node_role *role = node_role_named(setup->role);
    INCODE_ASSERT(role != NULL);
    for (unsigned d = 0; d < CUBE_LINKS_MAX; d++) {
        config.pipes[d] = (struct link_pipe){NULL, nowhere, nothing};
    }
    return node_aligned(sizeof(struct node)) +
           node_aligned(cube_arena_bytes(&config)) +
           role->arena_min(memory, setup);
}

struct node *node_start(const struct node_board *board, const char **why)
{
    uint8_t *memory = board->arena;
    size_t own = node_aligned(sizeof(struct node));
    struct cube_config config =
        configure(&board->identity, board->arena_bytes + board->fixed_bytes);
    memcpy(config.pipes, board->pipes, sizeof config.pipes);
    INCODE_ASSERT((uintptr_t)board->arena % NODE_ALIGNMENT == 0);
    *why = incode_arithmetic_fault();
    if (*why == NULL) {
        *why = cube_config_fault(&config);
    }
    if (*why != NULL) {
        return NULL;
    }
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
    node->counted.pause = node_looks_pause(&node->looks);
    node_pace_init(&node->pace, board->now_us, board->context);
    return node;
}

/* Adds what the role has done. */
static void role_totals(const struct node *n, struct node_finished_message *sum)
{
    struct node_finished_message totals;
    memset(&totals, 0, sizeof totals);
    n->role->totals(n->role_arena, &totals, n->now_us);
    totals.memory_high_water +=
        n->board->fixed_bytes + node_aligned(sizeof *n) + n->cube_bytes;
    node_totals_add(sum, &totals);
}

/* What the role did stays counted; what it has is of no use any more. */
static void end_role(struct node *n)
{
    if (n->role != NULL) {
        role_totals(n, &n->before);
        n->role = NULL;
    }
}

static bool read_setup(struct node *n, const struct cube_message *message,
                       struct node_setup_message *setup)
{
    uint32_t protocol = NODE_PROTOCOL;
    if (message->size >= sizeof protocol) {
        memcpy(&protocol, message->data, sizeof protocol);
    }
    if (protocol != NODE_PROTOCOL) {
        node_fault_set(&n->fault, "protocol version #, expected #", protocol,
                       NODE_PROTOCOL);
        return false;
    }
    if (message->size != sizeof *setup) {
        node_fault_set(&n->fault, "setup in # bytes, expected #", message->size,
                       sizeof *setup);
        return false;
    }
    memcpy(setup, message->data, sizeof *setup);
    uint32_t nodes = 1u << n->board->identity.dimension;
    if (setup->nodes != nodes) {
        node_fault_set(&n->fault, "invalid setup: # nodes, expected #",
                       setup->nodes, nodes);
        return false;
    }
    for (unsigned i = 0; i < sizeof setup->reserved; i++) {
        if (setup->reserved[i] != 0) {
            node_fault_set(&n->fault, "invalid setup: reserved byte # is #", i,
                           setup->reserved[i]);
            return false;
        }
    }
    if (setup->reserved2 != 0) {
        node_fault_set(&n->fault, "invalid setup: what is reserved is #",
                       setup->reserved2, 0);
        return false;
    }
    return true;
}

/* Whatever went before, the setup begins anew. */
static void take_setup(struct node *n, const struct cube_message *message)
{
    struct node_setup_message setup;
    end_role(n);
    n->fault.size = 0;
    n->fault_sent = false;
    if (!read_setup(n, message, &setup)) {
        return;
    }
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

static void take_ping(struct node *n, const struct cube_message *message)
{
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
static bool is_expected(struct node *n, const struct cube_message *message)
{
    uint8_t type = message->type;
    bool host_only = type == NODE_SETUP || type == NODE_JOB ||
                     type == NODE_CREDIT || type == NODE_UNSPILL ||
                     type == NODE_REPORT || type == NODE_STOP ||
                     type == NODE_PING || type == NODE_REGIONS ||
                     type == NODE_OUT || type == NODE_PAGE_TO_ALL;
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

static void serve_message(struct node *n, const struct cube_message *message)
{
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
        if (n->role != NULL && !node_fault_is_set(&n->fault)) {
            n->role->message(n->role_arena, message, n->now_us);
        }
    }
}

static void take_message(struct node *n, const struct cube_message *message)
{
    if (is_expected(n, message)) {
        serve_message(n, message);
    }
    n->counted.received +=
        message->source == CUBE_HOST && message->type != NODE_STOP;
}

static void fill_map(const struct node *n, struct node_map *map)
{
    memset(map, 0, sizeof *map);
    map->fixed = (uint32_t)n->board->fixed_bytes;
    map->arena = (uint32_t)n->board->arena_bytes;
    map->memory = map->fixed + map->arena;
    map->cube = (uint32_t)n->cube_bytes;
    map->window = n->window;
    map->node = (uint32_t)node_aligned(sizeof *n);
    n->role->map(n->role_arena, map);
}

static bool send_ready(struct node *n)
{
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
static void look_at_links(struct node *n)
{
    bool news = node_looks_silent(&n->looks, n->now_us);
    n->owes_pong = n->owes_pong || (news && n->pinged);
}

static bool send_pong(struct node *n)
{
    n->pong.start = n->board->identity.epoch;
    n->pong.sent = n->counted.sent;
    n->pong.links = node_looks_seen(&n->looks);
    n->pong.silent = n->looks.silent;
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
static bool send_finished(struct node *n, uint32_t epoch)
{
    struct node_finished_message finished = n->before;
    if (cube_room(n->cube, CUBE_HOST) == 0) {
        return false;
    }
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
static void follow_wiring(struct node *n)
{
    const struct cube_wiring *wiring = cube_wiring(n->cube);
    if (wiring_together(wiring, &n->followed)) {
        return;
    }
    end_role(n);
    n->followed = *wiring;
    n->pinged = n->owes_pong = n->owes_ready = n->owes_report = false;
    n->fault.size = 0;
    n->fault_sent = false;
    n->counted.received = n->counted.sent = 0;
}

/* Tells the host what is wrong, once.  The node goes on to pass messages of
 * others and to answer pings; it takes another setup. */
static void send_fault(struct node *n)
{
    n->fault_sent = node_counted_write(&n->counted, CUBE_HOST, NODE_FAULT,
                                       n->fault.text, n->fault.size) == 0;
}

/* What the role has to say, and what is asked of it. */
static unsigned send_role(struct node *n)
{
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
static bool may_stop(struct node *n)
{
    uint64_t end = n->stop_us + FAREWELL_US;
    if (!n->stopping) {
        return false;
    }
    if (!n->closing && cube_idle(n->cube)) {
        cube_close(n->cube, end);
        n->closing = true;
    }
    for (unsigned d = 0; d < cube_links(n->cube) && n->now_us < end; d++) {
        if (!n->closing || !node_looks_parted(&n->looks, d)) {
            return false;
        }
    }
    return true;
}

static bool is_sound(const struct node *n)
{
    return !node_fault_is_set(&n->fault) && n->role != NULL;
}

/* Whether the role takes what has come; one that is broken takes all. */
static bool may_take(struct node *n, const struct cube_message *message)
{
    return !is_sound(n) || n->role->may_take == NULL ||
           n->role->may_take(n->role_arena, message);
}

/* Reads a link up to what is not to be taken yet. */
static unsigned read_link(struct node *n, unsigned d)
{
    struct cube_message message;
    unsigned moved = 0;
    while (cube_read_from(n->cube, d, &message)) {
        if (!may_take(n, &message)) {
            cube_put_back(n->cube);
            break;
        }
        take_message(n, &message);
        cube_release(n->cube);
        moved++;
    }
    return moved;
}

unsigned node_receive(struct node *node)
{
    node->now_us = node->board->now_us(node->board->context);
    unsigned moved = node_looks_poll(&node->looks, node->now_us);
    follow_wiring(node);
    look_at_links(node);
    for (unsigned d = 0; d < cube_links(node->cube); d++) {
        moved += read_link(node, d);
    }
    return moved;
}

unsigned node_work(struct node *node)
{
    if (!is_sound(node) || node->owes_pong || node->owes_ready) {
        return 0;
    }
    node_pace_begin(&node->pace, node->now_us);
    unsigned worked = node->role->work(node->role_arena, &node->pace);
    node->work += worked;
    return worked;
}

enum node_event node_send(struct node *node, unsigned moved)
{
    bool sound = is_sound(node);
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
    if (may_stop(node)) {
        return NODE_STOPPED;
    }
    if (moved > 0) {
        return NODE_BUSY;
    }
    node_looks_idle(&node->looks);
    return NODE_IDLE;
}

enum node_event node_step(struct node *node)
{
    node->looks.tends = true;
    unsigned moved = node_receive(node);
    return node_send(node, moved + node_work(node));
}

uint64_t node_wait_us(const struct node *node)
{
    uint64_t due = cube_next_due_us(node->cube, node->now_us);
    if (node->stopping && due > FAREWELL_US) {
        due = FAREWELL_US;
    }
    return due < IDLE_MAX_US ? due : IDLE_MAX_US;
}

uint32_t node_held(const struct node *node)
{
    return node->role == NULL ? 0 : node->role->held(node->role_arena);
}

void node_account(const struct node *node, struct node_finished_message *totals)
{
    *totals = node->before;
    if (node->role != NULL) {
        role_totals(node, totals);
    }
}

const struct cube_statistics *node_messages(const struct node *node)
{
    return cube_statistics(node->cube);
}

void node_run(struct node *node)
{
    const struct node_board *board = node->board;
    enum node_event event;
    while ((event = node_step(node)) != NODE_STOPPED) {
        if (event == NODE_IDLE) {
            board->idle(board->context, node_wait_us(node));
        }
    }
}
