#include "sim_world.h"

#include <stdlib.h>
#include <string.h>

enum {
    GUARD_BYTES = 256,
    GUARD = 0xa5,
    BOOT_US = 2000,
    CALL_AGAIN_US = 20000, /* as TCP_PAUSE_MIN_US, */
    CALL_AGAIN_US_MAX = 1000000
};

uint64_t host_world_draw(uint64_t *state, uint64_t lo, uint64_t hi)
{
    return lo + (sim_draw(state) >> 16) % (hi - lo + 1);
}

uint64_t host_world_draw_log(uint64_t *state, uint64_t lo, uint64_t hi)
{
    unsigned doublings = 0;
    while (lo << doublings < hi) {
        doublings++;
    }
    uint64_t top = lo << host_world_draw(state, 0, doublings);
    return host_world_draw(state, lo, top < hi ? top : hi);
}

/* --- the nodes in the order of their clocks ------------------------------ */

static bool before(const struct host_world *w, uint32_t a, uint32_t b)
{
    uint64_t s = w->node[a].wake_us, t = w->node[b].wake_us;
    return s != t ? s < t : a < b;
}

static void place(struct host_world *w, uint32_t at, uint32_t node)
{
    w->heap[at] = node;
    w->node[node].place = at;
}

/* Wakes a node at that time, whenever it was to wake before. */
static void wake_at(struct host_world *w, uint32_t node, uint64_t us)
{
    uint32_t at = w->node[node].place, count = w->options.nodes;
    w->node[node].wake_us = us;
    while (at > 0 && before(w, node, w->heap[(at - 1) / 2])) {
        place(w, at, w->heap[(at - 1) / 2]);
        at = (at - 1) / 2;
    }
    for (;;) {
        uint32_t child = 2 * at + 1;
        if (child + 1 < count &&
            before(w, w->heap[child + 1], w->heap[child])) {
            child++;
        }
        if (child >= count || !before(w, w->heap[child], node)) {
            break;
        }
        place(w, at, w->heap[child]);
        at = child;
    }
    place(w, at, node);
}

/* Something comes for a node: it looks once it is free. */
static void rouse(struct host_world *w, unsigned node, uint64_t us)
{
    if (node > w->options.nodes && us < w->guest_us) {
        w->guest_us = us;
    }
    if (node >= w->options.nodes || w->node[node].state != HOST_WORLD_UP) {
        return;
    }
    struct host_world_node *n = &w->node[node];
    us = us < n->busy_until_us ? n->busy_until_us : us;
    if (us < n->wake_us) {
        wake_at(w, node, us);
    }
}

/* --- wires --------------------------------------------------------------- */

static void remember(struct host_world *w, uint64_t word)
{
    w->trace = (w->trace ^ word) * UINT64_C(0x9fb21c651e98df25);
    w->trace ^= w->trace >> 28;
}

static void remember_bytes(struct host_world *w, const uint8_t *bytes,
                           size_t size)
{
    for (; size >= 8; bytes += 8, size -= 8) {
        uint64_t word;
        memcpy(&word, bytes, 8);
        remember(w, word);
    }
    uint64_t rest = size;
    for (size_t i = 0; i < size; i++) {
        rest = rest << 8 | bytes[i];
    }
    remember(w, rest);
}

static int port_send(void *context, const uint8_t *bytes, size_t size)
{
    struct host_world_port *port = context;
    struct host_world *w = port->world;
    if (port->replaced) {
        return LINK_PIPE_CLOSED;
    }
    int taken = port->pipe.send(port->pipe.context, bytes, size);
    if (taken > 0) {
        remember(w, w->now_us << 16 ^ port->wire << 1 ^ port->side);
        remember_bytes(w, bytes, (size_t)taken);
        rouse(w, port->peer, sim_next_us(port->end->out, w->options.gather_us));
    }
    return taken;
}

static int port_receive(void *context, uint8_t *bytes, size_t size)
{
    struct host_world_port *port = context;
    if (port->replaced) {
        port->replaced = false;
        return LINK_PIPE_CLOSED;
    }
    int got = port->pipe.receive(port->pipe.context, bytes, size);
    if (got > 0 && port->end->in->blocked) {
        rouse(port->world, port->peer, port->world->now_us);
    }
    return got;
}

static struct link_pipe port_pipe(struct host_world_port *port)
{
    return (struct link_pipe){port, port_send, port_receive};
}

unsigned host_world_wire_of(const struct host_world *world, unsigned node,
                            unsigned link)
{
    if (link == world->options.dimension) {
        return world->host_wire;
    }
    unsigned low = node & ((1u << link) - 1);
    return link * (world->options.nodes / 2) + (node >> (link + 1) << link) +
           low;
}

static void open_port(struct host_world *w, struct host_world_port *port,
                      unsigned owner, unsigned link, unsigned peer)
{
    unsigned nodes = w->options.nodes;
    port->world = w;
    port->owner = owner;
    port->peer = peer;
    port->wire = owner >= nodes  ? w->host_wire + owner - nodes
                 : peer >= nodes ? w->host_wire + peer - nodes
                                 : host_world_wire_of(w, owner, link);
    port->side = owner > peer;
    port->end = &w->wire[port->wire].wire.end[port->side];
    port->pipe = sim_pipe(port->end);
}

void host_world_cut(struct host_world *world, unsigned wire, bool cut)
{
    struct host_world_wire *one = &world->wire[wire];
    one->cuts += cut ? 1u : UINT32_MAX;
    if (cut ? one->cuts == 1 : one->cuts == 0) {
        sim_wire_cut(&one->wire, cut);
    }
}

void host_world_deaf(struct host_world *world, unsigned wire, unsigned side,
                     bool deaf)
{
    struct host_world_wire *one = &world->wire[wire];
    one->deaf[side] += deaf ? 1u : UINT32_MAX;
    sim_line_deaf(&one->wire.line[side], one->deaf[side] > 0);
}

void host_world_leave_out(struct host_world *world, unsigned wire)
{
    world->wire[wire].missing = true;
    host_world_cut(world, wire, true);
}

/* --- two hosts ------------------------------------------------------------ */

static void hang_up(struct host_world *w, unsigned k, uint64_t rest_us)
{
    struct host_world_door *door = &w->door[k];
    if (door->connected) {
        door->connected = false;
        host_world_cut(w, door->port.wire, true);
    }
    door->call_us = w->now_us + rest_us;
    door->pause_us = CALL_AGAIN_US;
}

static void call(struct host_world *w, unsigned k)
{
    unsigned dimension = w->options.dimension;
    struct host_world_door *door = &w->door[k];
    struct host_world_port *at = &w->node[0].port[dimension];
    if (w->node[0].state != HOST_WORLD_UP) { /* nobody listens */
        door->call_us = w->now_us + door->pause_us;
        door->pause_us = 2 * door->pause_us < CALL_AGAIN_US_MAX
                             ? 2 * door->pause_us
                             : CALL_AGAIN_US_MAX;
        return;
    }
    hang_up(w, 1 - k, CALL_AGAIN_US);
    door->connected = true;
    host_world_cut(w, door->port.wire, false);
    open_port(w, at, 0, dimension, w->options.nodes + k);
    at->replaced = true;
    rouse(w, 0, w->now_us);
}

/* When a host calls, or UINT64_MAX. */
static uint64_t next_call(const struct host_world *w, unsigned *k)
{
    uint64_t next = UINT64_MAX;
    for (unsigned i = 0; i < 2; i++) {
        const struct host_world_door *door = &w->door[i];
        if (door->wanted && !door->connected && door->call_us < next) {
            next = door->call_us;
            *k = i;
        }
    }
    return next;
}

void host_world_rest(struct host_world *world, uint64_t rest_us)
{
    hang_up(world, 1, rest_us);
}

void host_world_knock(struct host_world *world, bool comes)
{
    hang_up(world, 1, 0);
    world->door[1].wanted = comes;
    world->guest_us = comes ? world->now_us : UINT64_MAX;
}

/* --- nodes --------------------------------------------------------------- */

static uint64_t node_now_us(void *context)
{
    const struct host_world_node *node = context;
    return node->world->now_us + node->offset_us;
}

static uint64_t node_busy_us(void *context)
{
    const struct host_world_node *node = context;
    return node->busy_us;
}

/* The world sleeps for its nodes. */
static void node_idle(void *context, uint64_t wait_us)
{
    (void)context, (void)wait_us;
}

static void node_reset(void *context, int status)
{
    struct host_world_node *node = context;
    (void)status;
    node->state = HOST_WORLD_ENDED;
}

static void give_up(struct host_world *w, unsigned node, const char *why)
{
    if (w->fault == NULL) {
        w->fault = why;
        w->fault_node = node;
    }
}

/* A start: what memory holds before is chance. */
static void boot(struct host_world *w, unsigned i)
{
    struct host_world_node *n = &w->node[i];
    const char *why = NULL;
    n->offset_us = sim_draw(&w->random) >> 24;
    memset(n->board.arena, (int)(sim_draw(&w->random) >> 32 & 0xff),
           n->board.arena_bytes);
    n->board.identity.epoch = w->epoch++;
    n->starts++;
    n->state = HOST_WORLD_UP;
    n->node = node_start(&n->board, &why);
    if (n->node == NULL) {
        give_up(w, i, why);
    }
}

/* Takes back what the crash did to the node's wires. */
static void plug_in(struct host_world *w, unsigned i, bool in)
{
    struct host_world_node *n = &w->node[i];
    for (unsigned d = 0; d < n->links; d++) {
        struct host_world_port *port = &n->port[d];
        if (n->unplugged) {
            host_world_cut(w, port->wire, !in);
        } else {
            host_world_deaf(w, port->wire, 1 - port->side, !in);
            sim_line_flush(port->end->in);
        }
    }
}

void host_world_crash(struct host_world *world, unsigned node, uint64_t us,
                      bool unplugged)
{
    struct host_world_node *n = &world->node[node];
    if (n->state != HOST_WORLD_UP) {
        return;
    }
    n->state = HOST_WORLD_OFF;
    if (node == 0 && world->options.second_host) {
        hang_up(world, 0, CALL_AGAIN_US);
        hang_up(world, 1, CALL_AGAIN_US);
    }
    n->unplugged = unplugged;
    plug_in(world, node, false);
    n->busy_until_us = world->now_us + us;
    wake_at(world, node, n->busy_until_us);
}

void host_world_kill(struct host_world *world, unsigned node)
{
    host_world_crash(world, node, 0, false);
    if (world->node[node].state == HOST_WORLD_OFF) {
        world->node[node].state = HOST_WORLD_ENDED;
        world->ended++;
        wake_at(world, node, UINT64_MAX);
    }
}

void host_world_pause(struct host_world *world, unsigned node, uint64_t us)
{
    struct host_world_node *n = &world->node[node];
    uint64_t until = world->now_us + us;
    if (n->state == HOST_WORLD_UP && until > n->busy_until_us) {
        n->busy_until_us = until;
        wake_at(world, node, n->wake_us < until ? until : n->wake_us);
    }
}

/* When an idle node has something to do. */
static uint64_t next_duty(struct host_world *w, struct host_world_node *n)
{
    uint64_t due = w->now_us + node_wait_us(n->node);
    for (unsigned d = 0; d < n->links; d++) {
        uint64_t bytes = sim_next_us(n->port[d].end->in, w->options.gather_us);
        uint64_t room = sim_room_us(n->port[d].end->out);
        due = bytes < due ? bytes : due;
        due = room < due ? room : due;
    }
    return due;
}

static void step(struct host_world *w, unsigned i)
{
    struct host_world_node *n = &w->node[i];
    uint64_t cost = host_world_draw(&w->random, 1, 2 * w->options.step_us);
    if (n->state == HOST_WORLD_OFF) {
        plug_in(w, i, true);
        boot(w, i);
        n->busy_until_us = w->now_us + BOOT_US;
        wake_at(w, i, n->busy_until_us);
        return;
    }
    for (unsigned d = 0; d < n->links; d++) {
        n->port[d].end->out->blocked = false;
    }
    enum node_event event = node_step(n->node);
    if (event == NODE_STOPPED) {
        n->board.reset(n, 0);
        w->ended++;
        wake_at(w, i, UINT64_MAX);
        return;
    }
    cost = event == NODE_IDLE ? cost / 8 + 1 : cost;
    n->busy_us += cost;
    n->busy_until_us = w->now_us + cost;
    uint64_t due = event == NODE_IDLE ? next_duty(w, n) : 0;
    wake_at(w, i, due < n->busy_until_us ? n->busy_until_us : due);
}

/* --- time ---------------------------------------------------------------- */

uint64_t host_world_door_due(const struct host_world *world, unsigned host)
{
    const struct sim_end *end = world->door[host].port.end;
    uint64_t bytes = sim_next_us(end->in, world->options.gather_us);
    uint64_t room = sim_room_us(end->out);
    return bytes < room ? bytes : room;
}

/* Runs the world until that time, or until the host has something to do. */
static void run_until(struct host_world *w, uint64_t until, bool for_host)
{
    while (w->fault == NULL) {
        unsigned caller = 0;
        uint64_t next = w->node[w->heap[0]].wake_us;
        uint64_t called = next_call(w, &caller);
        bool strike = w->strike_us <= next;
        next = strike ? w->strike_us : next;
        bool guest = w->guest_us < next;
        next = guest ? w->guest_us : next;
        bool calls = called < next;
        next = calls ? called : next;
        uint64_t host = for_host ? host_world_door_due(w, 0) : UINT64_MAX;
        if (host <= next && host < until) {
            until = host;
        }
        if (next >= until) {
            break;
        }
        w->now_us = next > w->now_us ? next : w->now_us;
        if (calls) {
            call(w, caller);
        } else if (guest) {
            w->guest_us = UINT64_MAX;
            w->options.guest(w->options.guest_context);
        } else if (strike) {
            w->strike_us = UINT64_MAX;
            w->options.strike(w->options.context);
        } else {
            step(w, w->heap[0]);
        }
        if (++w->steps > w->options.steps_max) {
            give_up(w, w->options.nodes, "too many steps");
        }
    }
    w->now_us = until > w->now_us ? until : w->now_us;
    if (w->now_us > w->options.time_us_max) {
        give_up(w, w->options.nodes, "too long");
    }
}

/* Each look at the clock costs the host some time. */
static uint64_t machine_now_us(void *context)
{
    struct host_world *w = context;
    uint64_t us = host_world_draw(&w->random, 1, 2 * w->options.host_us);
    us += w->host_pause_us;
    w->host_pause_us = 0;
    run_until(w, w->now_us + us, false);
    return w->now_us;
}

static void machine_idle(void *context, uint64_t wait_us)
{
    struct host_world *w = context;
    run_until(w, w->now_us + wait_us, true);
    w->door[0].port.end->out->blocked = false;
}

static int machine_check(void *context, struct host_error *error)
{
    const struct host_world *w = context;
    if (w->fault == NULL) {
        return 0;
    }
    return host_fail(error, HOST_CUBE,
                     "node %u: %s, after %llu ms and %llu steps; replay it",
                     w->fault_node, w->fault,
                     (unsigned long long)w->now_us / 1000,
                     (unsigned long long)w->steps);
}

static bool machine_ended(void *context)
{
    const struct host_world *w = context;
    return w->ended == w->options.nodes || w->fault != NULL;
}

static void machine_stop(void *context)
{
    struct host_world *w = context;
    for (unsigned i = 0; i < w->options.nodes; i++) {
        wake_at(w, i, UINT64_MAX);
    }
}

struct link_pipe host_world_pipe(struct host_world *world, unsigned host)
{
    return port_pipe(&world->door[host].port);
}

static void machine_missing(void *context, unsigned node, unsigned link)
{
    struct host_world *w = context;
    w->wire[host_world_wire_of(w, node, link)].named = true;
}

struct host_machine host_world_machine(struct host_world *world)
{
    struct host_machine machine = {0};
    machine.context = world;
    machine.nodes = world->options.nodes;
    machine.dimension = world->options.dimension;
    machine.epoch = world->epoch++;
    machine.pipe = host_world_pipe(world, 0);
    machine.absent_s = world->options.absent_s;
    machine.missing = machine_missing;
    machine.now_us = machine_now_us;
    machine.idle = machine_idle;
    machine.check = machine_check;
    machine.ended = machine_ended;
    machine.stop = machine_stop;
    return machine;
}

/* --- from nothing, and back ---------------------------------------------- */

static int open_node(struct host_world *w, unsigned i)
{
    struct host_world_node *n = &w->node[i];
    unsigned dimension = w->options.dimension;
    n->world = w;
    n->links = dimension + (i == 0);
    n->board.context = n;
    n->board.identity.self = (uint16_t)i;
    n->board.identity.dimension = (uint8_t)dimension;
    n->board.identity.window = w->options.window;
    n->board.identity.dead_us = w->options.dead_us;
    n->board.now_us = node_now_us;
    n->board.busy_us = node_busy_us;
    n->board.idle = node_idle;
    n->board.reset = node_reset;
    n->board.fixed_bytes = HOST_WORLD_STACK + HOST_WORLD_STATIC;
    n->board.arena_bytes = w->options.memory - n->board.fixed_bytes;
    n->board.arena =
        aligned_alloc(64, (n->board.arena_bytes + GUARD_BYTES + 63) / 64 * 64);
    if (n->board.arena == NULL) {
        return -1;
    }
    memset((uint8_t *)n->board.arena + n->board.arena_bytes, GUARD,
           GUARD_BYTES);
    for (unsigned d = 0; d < n->links; d++) {
        unsigned peer = d == dimension ? w->options.nodes : i ^ 1u << d;
        open_port(w, &n->port[d], i, d, peer);
        n->board.pipes[d] = port_pipe(&n->port[d]);
    }
    /* Nodes start in any order. */
    n->state = HOST_WORLD_OFF;
    n->unplugged = false;
    plug_in(w, i, false);
    wake_at(w, i, host_world_draw(&w->random, 0, 100000));
    return 0;
}

int host_world_open(struct host_world *world,
                    const struct host_world_options *options,
                    struct host_error *error)
{
    struct host_world *w = world;
    unsigned nodes = options->nodes;
    memset(w, 0, sizeof *w);
    w->options = *options;
    w->random = sim_seed(options->seed, 1);
    w->strike_us = w->guest_us = UINT64_MAX;
    w->epoch = (uint32_t)(sim_draw(&w->random) >> 33) | 1;
    w->host_wire = nodes * options->dimension / 2;
    w->wires = w->host_wire + (options->second_host ? 2 : 1);
    size_t each = sim_wire_bytes(&options->wire);
    w->node = calloc(nodes, sizeof *w->node);
    w->wire = calloc(w->wires, sizeof *w->wire);
    w->heap = calloc(nodes, sizeof *w->heap);
    w->bytes =
        malloc(each * w->host_wire +
               sim_wire_bytes(&options->host_wire) * (w->wires - w->host_wire));
    bool good = w->node != NULL && w->wire != NULL && w->heap != NULL &&
                w->bytes != NULL;
    for (unsigned i = 0; good && i < w->wires; i++) {
        bool host = i >= w->host_wire;
        size_t second =
            i > w->host_wire ? sim_wire_bytes(&options->host_wire) : 0;
        size_t at = host ? w->host_wire * each + second : i * each;
        sim_wire_init(&w->wire[i].wire, w->bytes + at,
                      host ? &options->host_wire : &options->wire, &w->now_us,
                      sim_seed(options->seed, 1000 + i));
    }
    for (unsigned i = 0; good && i < nodes; i++) {
        w->node[i].wake_us = UINT64_MAX;
        place(w, i, i);
    }
    for (unsigned i = 0; good && i < nodes; i++) {
        good = open_node(w, i) == 0;
    }
    if (!good) {
        host_world_close(w);
        return host_fail_memory(error, "the simulated nodes");
    }
    for (unsigned k = 0; k < w->wires - w->host_wire; k++) {
        open_port(w, &w->door[k].port, nodes + k, 0, 0);
    }
    w->door[0].wanted = w->door[0].connected = true;
    if (options->second_host) {
        host_world_cut(w, w->host_wire + 1, true);
    }
    return 0;
}

void host_world_close(struct host_world *world)
{
    for (unsigned i = 0; world->node != NULL && i < world->options.nodes; i++) {
        free(world->node[i].board.arena);
    }
    free(world->node);
    free(world->wire);
    free(world->heap);
    free(world->bytes);
    world->node = NULL;
}

const char *host_world_damage(const struct host_world *world)
{
    for (unsigned i = 0; i < world->options.nodes; i++) {
        const struct node_board *b = &world->node[i].board;
        const uint8_t *past = (const uint8_t *)b->arena + b->arena_bytes;
        for (unsigned k = 0; k < GUARD_BYTES; k++) {
            if (past[k] != GUARD) {
                return "a node wrote past its memory";
            }
        }
    }
    return NULL;
}
