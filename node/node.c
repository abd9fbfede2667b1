#include "node.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "node/roles/holder.h"
#include "totals.h"
#include "node/roles/worker.h"

enum { IDLE_MAX_US = 1000000, FAREWELL_US = 500000 };

struct node {
    const struct node_board *board;
    struct cube *cube;
    uint8_t *role_memory;
    size_t role_bytes, cube_bytes;
    uint16_t window;
    bool set_up, stopping, closing;
    uint8_t role; /* enum node_role_number */
    struct node_worker worker;
    struct node_holder holder;
    uint32_t generation; /* of the wiring that this node has followed */
    struct node_counted counted;
    struct node_pong_message pong; /* the answer that is owed */
    bool owes_pong, owes_ready, owes_report;
    struct node_finished_message before; /* of roles of older generations */
    const char *fault;
    bool fault_sent;
    uint64_t now_us, stop_us;
};

/* Frames a window, where the strap leaves it open: an eighth of a small
 * memory at most goes to windows. */
static uint16_t window_for(size_t bytes)
{
    return bytes >= 2u << 20 ? 8 : bytes >= 1u << 20 ? 4 : 2;
}

static size_t up64(size_t bytes)
{
    return (bytes + 63) / 64 * 64;
}

/* The cube as this node's straps and memory make it. */
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
    config.host_wire = identity->host_wire;
    config.host_wires = identity->host_wires;
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
                         const struct incode_setup *setup)
{
    struct cube_config config = configure(identity, memory);
    for (unsigned d = 0; d < CUBE_LINKS_MAX; d++) {
        config.pipes[d] = (struct link_pipe){NULL, nowhere, nothing};
    }
    return up64(sizeof(struct node)) + up64(cube_arena_bytes(&config)) +
           node_worker_outbox_bytes(memory) + incode_arena_min(setup);
}

struct node *node_start(const struct node_board *board, const char **why)
{
    uint8_t *memory = board->arena;
    size_t own = up64(sizeof(struct node));
    struct cube_config config =
        configure(&board->identity, board->arena_bytes + board->fixed_bytes);
    memcpy(config.pipes, board->pipes, sizeof config.pipes);
    *why = incode_arithmetic_fault();
    if (*why != NULL) {
        return NULL;
    }
    size_t cube = up64(cube_arena_bytes(&config));
    if (board->arena_bytes < own + cube) {
        *why = "the memory does not hold the links' windows";
        return NULL;
    }
    struct node *node = board->arena;
    memset(node, 0, sizeof *node);
    node->board = board;
    node->cube_bytes = cube;
    node->window = config.window;
    node->role_memory = memory + own + cube;
    node->role_bytes = board->arena_bytes - own - cube;
    node->cube = cube_init(memory + own, cube, &config);
    if (node->cube == NULL) {
        *why = "the cube's description is not sound";
        return NULL;
    }
    node->counted.cube = node->cube;
    return node;
}

static void take_setup(struct node *n, const struct cube_message *message)
{
    struct node_setup_message setup;
    const char *why = NULL;
    int status;
    if (message->size != sizeof setup) {
        n->fault = "host and node are of different versions";
        return;
    }
    memcpy(&setup, message->data, sizeof setup);
    if (setup.protocol != NODE_PROTOCOL) {
        n->fault = "host and node are of different versions";
        return;
    }
    n->role = setup.role;
    if (n->role != NODE_WORKER && n->role != NODE_HOLDER) {
        n->fault = "a role that is not known; are host and node of one version";
        return;
    }
    if (n->role == NODE_HOLDER) {
        status = node_holder_start(&n->holder, n->role_memory, n->role_bytes,
                                   &n->counted, &setup, &why);
    } else {
        status = node_worker_start(&n->worker, n->role_memory, n->role_bytes,
                                   &n->counted, &setup, &why);
    }
    if (status != 0) {
        n->fault = why;
        return;
    }
    n->set_up = true;
    n->owes_ready = true;
}

static void take_job(struct node *n, const struct cube_message *message)
{
    struct node_job_message job;
    /* After a fresh start: a message that was sent to the one before. */
    if (n->fault != NULL || !n->set_up) {
        return;
    }
    if (n->role != NODE_WORKER || message->size != sizeof job) {
        n->fault = "a job that is none";
        return;
    }
    memcpy(&job, message->data, sizeof job);
    node_worker_job(&n->worker, &job, n->now_us);
}

static void take_ping(struct node *n, const struct cube_message *message)
{
    struct node_ping_message ping;
    if (message->size == sizeof ping) {
        memcpy(&ping, message->data, sizeof ping);
        n->pong.pinged = ping.sent;
        n->pong.received = n->counted.received;
        n->owes_pong = true;
    }
}

static void take_message(struct node *n, const struct cube_message *message)
{
    switch (message->type) {
    case NODE_SETUP:
        take_setup(n, message);
        break;
    case NODE_JOB:
        take_job(n, message);
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
        if (n->set_up && n->role == NODE_HOLDER) {
            node_holder_message(&n->holder, message);
        } else if (n->set_up) {
            node_worker_message(&n->worker, message);
        }
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
    map->node = (uint32_t)up64(sizeof *n);
    if (n->role == NODE_HOLDER) {
        map->frame_count = n->holder.frame_count;
        map->frames = (uint32_t)n->role_bytes;
        return;
    }
    const struct incode_map *t =
        incode_triangulator_map(n->worker.triangulator);
    map->outbox = n->worker.outbox_bytes;
    map->control = (uint32_t)t->control;
    map->frames = (uint32_t)t->frames;
    map->frame_count = (uint32_t)t->frame_count;
    map->afl = (uint32_t)t->afl;
    map->afl_faces = (uint32_t)t->afl_faces;
    map->bricks = (uint32_t)t->bricks;
    map->brick_entries = (uint32_t)t->brick_entries;
    map->gather = (uint32_t)t->local_points;
    map->tasks = (uint32_t)t->tasks;
}

static bool send_ready(struct node *n)
{
    struct node_ready_message ready;
    memset(&ready, 0, sizeof ready);
    ready.protocol = NODE_PROTOCOL;
    ready.role = n->role;
    fill_map(n, &ready.map);
    return node_counted_write(&n->counted, CUBE_HOST, NODE_READY, &ready,
                              sizeof ready) == 0;
}

/* A wire whose ends never met is missing, or not there yet: the host says. */
static uint32_t links_seen(const struct node *n)
{
    uint32_t seen = 0;
    for (unsigned d = 0; d < cube_links(n->cube); d++) {
        bool up = cube_link_statistics(n->cube, d)->sessions > 0;
        seen |= (uint32_t)up << d;
    }
    return seen;
}

static bool send_pong(struct node *n)
{
    n->pong.start = n->board->identity.epoch;
    n->pong.sent = n->counted.sent;
    n->pong.links = links_seen(n);
    return node_counted_write(&n->counted, CUBE_HOST, NODE_PONG, &n->pong,
                              sizeof n->pong) == 0;
}

static void link_totals(const struct node *n,
                        struct node_finished_message *finished)
{
    for (unsigned d = 0; d < cube_links(n->cube); d++) {
        const struct link_statistics *s = cube_link_statistics(n->cube, d);
        finished->retransmitted += s->retransmitted;
    }
}

/* Adds what the role has done. */
static void role_totals(const struct node *n, struct node_finished_message *sum)
{
    struct node_finished_message totals;
    size_t used = n->board->fixed_bytes + up64(sizeof *n) + n->cube_bytes;
    memset(&totals, 0, sizeof totals);
    if (n->role == NODE_HOLDER) {
        totals.pages_held = n->holder.hits;
        totals.pages_forwarded = n->holder.misses;
        totals.bytes_in = n->holder.bytes_in;
        totals.bytes_out = n->holder.bytes_out;
        used += n->holder.frames_used * sizeof n->holder.frames[0];
    } else {
        node_worker_totals(&n->worker, &totals, n->now_us);
        used += n->worker.outbox_bytes +
                (size_t)totals.statistics.memory_high_water;
    }
    totals.memory_high_water = used;
    node_totals_add(sum, &totals);
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
    link_totals(n, &finished);
    finished.busy_us = n->board->busy_us(n->board->context);
    finished.epoch = epoch;
    finished.start = n->board->identity.epoch;
    finished.sent = n->counted.sent;
    finished.links = links_seen(n);
    INCODE_ASSERT(node_counted_write(&n->counted, CUBE_HOST, NODE_FINISHED,
                                     &finished, sizeof finished) == 0);
    return true;
}

/* A new generation of the wiring: the host begins again with all nodes.  What
 * this one had is of no use, but for what it knows of its work. */
static void follow_wiring(struct node *n)
{
    uint32_t generation = cube_wiring(n->cube)->generation;
    if (generation == n->generation) {
        return;
    }
    if (n->set_up) {
        role_totals(n, &n->before);
    }
    n->generation = generation;
    n->set_up = false;
    n->owes_pong = n->owes_ready = n->owes_report = false;
    n->fault = NULL;
    n->fault_sent = false;
    n->counted.received = n->counted.sent = 0;
}

/* Tells the host what is wrong, once.  The node goes on to pass messages of
 * others, so that the host hears of them too. */
static void send_fault(struct node *n)
{
    size_t size = 0;
    while (size < NODE_FAULT_TEXT_MAX && n->fault[size] != '\0') {
        size++;
    }
    n->fault_sent = node_counted_write(&n->counted, CUBE_HOST, NODE_FAULT,
                                       n->fault, size) == 0;
}

static unsigned serve_role(struct node *n)
{
    unsigned moved = 0;
    if (n->role == NODE_HOLDER) {
        moved += node_holder_send(&n->holder);
        n->fault = n->holder.fault;
    } else {
        moved += node_worker_work(&n->worker);
        moved += node_worker_send(&n->worker);
        n->fault = n->worker.fault;
        if (n->fault == NULL && node_worker_done(&n->worker) &&
            send_finished(n, n->worker.epoch)) {
            node_worker_end(&n->worker, n->now_us);
            moved++;
        }
    }
    if (n->owes_report && send_finished(n, 0)) {
        n->owes_report = false;
        moved++;
    }
    return moved;
}

/* Whether a neighbour needs this node no more: it has said farewell, or is
 * gone. */
static bool parted(const struct node *n, unsigned d)
{
    enum link_state state = cube_link_state(n->cube, d);
    return state == LINK_CLOSED || state == LINK_DOWN ||
           cube_link_statistics(n->cube, d)->pipe_closed > 0;
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
        if (!n->closing || !parted(n, d)) {
            return false;
        }
    }
    return true;
}

enum node_event node_step(struct node *node)
{
    struct cube_message message;
    node->now_us = node->board->now_us(node->board->context);
    unsigned moved = (unsigned)cube_poll(node->cube, node->now_us);
    follow_wiring(node);
    while (cube_read(node->cube, &message)) {
        take_message(node, &message);
        cube_release(node->cube);
        moved++;
    }
    if (node->fault != NULL) {
        if (!node->fault_sent) {
            send_fault(node);
        }
    } else if (node->owes_pong) {
        node->owes_pong = !send_pong(node);
    } else if (node->set_up && node->owes_ready) {
        node->owes_ready = !send_ready(node);
    } else if (node->set_up) {
        moved += serve_role(node);
    }
    if (may_stop(node)) {
        return NODE_STOPPED;
    }
    return moved > 0 ? NODE_BUSY : NODE_IDLE;
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
    if (!node->set_up) {
        return 0;
    }
    return node->role == NODE_HOLDER ? node->holder.queued
                                     : node_worker_held(&node->worker);
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
