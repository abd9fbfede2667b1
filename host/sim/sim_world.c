#include "sim_world.h"

#include <stdlib.h>
#include <string.h>

#include "sim_draw.h"

enum {
    GUARD_BYTES = 256,
    GUARD = 0xa5,
    BOOT_US = 2000,
    START_US_MAX = 100000, /* after which all nodes have been started */
    CONNECT_US = 20000,    /* between attempts, as TCP_PAUSE_MIN_US, */
    CONNECT_US_MAX = 1000000,
    LONG_US = 50000, /* between two looks of a slow node, once in so many */
    LONG_IN = 32,
    LISTEN_US = 50000, /* as in node/identity.h */
    PASS_US = 50,      /* between two looks of links whose processor is busy */
    RESTART_US = 20000 /* of a node that was told to */
};

/* --- the nodes in the order of their clocks ------------------------------- */

static bool before(const struct host_world *w, uint32_t a, uint32_t b) {
    uint64_t s = w->node[a].wake_us, t = w->node[b].wake_us;
    return s != t ? s < t : a < b;
}

static void place(struct host_world *w, uint32_t at, uint32_t node) {
    w->heap[at] = node;
    w->node[node].place = at;
}

/* Wakes a node at that time, whenever it was to wake before. */
static void wake_at(struct host_world *w, uint32_t node, uint64_t us) {
    uint32_t at = w->node[node].place, count = w->nodes;
    w->node[node].wake_us = us;
    while (at > 0 && before(w, node, w->heap[(at - 1) / 2])) {
        place(w, at, w->heap[(at - 1) / 2]);
        at = (at - 1) / 2;
    }
    for (;;) {
        uint32_t child = 2 * at + 1;
        if (child + 1 < count && before(w, w->heap[child + 1], w->heap[child]))
            child++;
        if (child >= count || !before(w, w->heap[child], node))
            break;
        place(w, at, w->heap[child]);
        at = child;
    }
    place(w, at, node);
}

/* Something comes for a place: a node looks once it is free. */
static void rouse(void *context, unsigned node, uint64_t us) {
    struct host_world *w = context;
    if (node > w->nodes && us < w->second_us)
        w->second_us = us;
    if (node >= w->nodes || w->node[node].state != HOST_WORLD_UP)
        return;
    struct host_world_node *n = &w->node[node];
    us = us < n->busy_until_us && !w->options.routers ? n->busy_until_us : us;
    if (us < n->wake_us)
        wake_at(w, node, us);
}

/* --- two hosts ------------------------------------------------------------ */

static void cut_host(struct host_world *w, unsigned host, bool cut) {
    unsigned place = w->nodes + host;
    host_sim_cube_cut(&w->cube, host_sim_cube_wire(&w->cube, place, 0), cut);
}

static void hang_up(struct host_world *w, unsigned host, uint64_t rest_us) {
    struct host_world_connection *c = &w->connection[host];
    if (c->connected) {
        c->connected = false;
        cut_host(w, host, true);
    }
    c->next_us = w->now_us + rest_us;
    c->pause_us = CONNECT_US;
}

static void connect_host(struct host_world *w, unsigned host) {
    struct host_world_connection *c = &w->connection[host];
    if (w->node[0].state != HOST_WORLD_UP) { /* nobody listens */
        c->next_us = w->now_us + c->pause_us;
        c->pause_us =
            2 * c->pause_us < CONNECT_US_MAX ? 2 * c->pause_us : CONNECT_US_MAX;
        return;
    }
    hang_up(w, 1 - host, CONNECT_US);
    c->connected = true;
    cut_host(w, host, false);
    host_sim_cube_connect(&w->cube, host);
    rouse(w, 0, w->now_us);
}

/* When a host connects next, and which; or UINT64_MAX. */
static uint64_t next_connection(const struct host_world *w, unsigned *host) {
    uint64_t next = UINT64_MAX;
    for (unsigned i = 0; i < 2; i++) {
        const struct host_world_connection *c = &w->connection[i];
        if (c->wanted && !c->connected && c->next_us < next) {
            next = c->next_us;
            *host = i;
        }
    }
    return next;
}

void host_world_rest(struct host_world *world, uint64_t rest_us) {
    hang_up(world, 1, rest_us);
}

void host_world_second_host(struct host_world *world, bool comes) {
    hang_up(world, 1, 0);
    world->connection[1].wanted = comes;
    world->second_us = comes ? world->now_us : UINT64_MAX;
}

/* --- nodes ---------------------------------------------------------------- */

/* Nanoseconds of this step so far. */
static uint64_t spent_ns(const struct host_world_node *node) {
    const struct host_world_options *o = &node->world->options;
    return o->used_ns == NULL || !node->stepping
               ? 0
               : o->used_ns(o->used_context,
                            (unsigned)(node - node->world->node), node->node) -
                     node->used_ns;
}

/* The world's clock goes with a slow node's until its step is over: what the
 * others do meanwhile the node sees later. */
static void take_time(struct host_world *w) {
    bool lasts = host_sim_draw(&w->look_random, 1, LONG_IN) == 1;
    w->looks++;
    w->now_us += host_sim_draw(&w->look_random, 0,
                               lasts ? LONG_US : 2 * w->options.look_us);
}

static uint64_t node_now_us(void *context) {
    const struct host_world_node *node = context;
    struct host_world *w = node->world;
    if (node->stepping && w->options.look_us > 0)
        take_time(w);
    return w->now_us + node->offset_us + spent_ns(node) / 1000;
}

static uint64_t node_busy_us(void *context) {
    const struct host_world_node *node = context;
    return node->busy_us;
}

/* The world sleeps for its nodes. */
static void node_idle(void *context, uint64_t wait_us) {
    (void)context, (void)wait_us;
}

/* Of the node that lies. */
static int node_write(void *context, struct node_counted *counted,
                      uint16_t dest, uint8_t type, const void *data,
                      size_t size) {
    const struct host_world_node *node = context;
    return host_liar_write(node->world->options.liar, counted, dest, type, data,
                           size);
}

static void node_reset(void *context, int status) {
    struct host_world_node *node = context;
    (void)status;
    node->state = HOST_WORLD_ENDED;
}

void host_world_give_up(struct host_world *world, unsigned node,
                        const char *why) {
    if (world->fault == NULL) {
        world->fault = why;
        world->fault_node = node;
    }
}

/* Takes back what the crash did to the node's wires. */
static void plug_in(struct host_world *w, unsigned i, bool in) {
    struct host_world_node *n = &w->node[i];
    for (unsigned d = 0; d < n->links; d++) {
        struct host_sim_port *port = host_sim_cube_port(&w->cube, i, d);
        if (n->unplugged) {
            host_sim_cube_cut(&w->cube, port->wire, !in);
        } else {
            host_sim_cube_deaf(&w->cube, port->wire, 1 - port->side, !in);
            sim_direction_flush(port->end->in);
        }
    }
}

void host_world_crash(struct host_world *world, unsigned node, uint64_t us,
                      bool unplugged) {
    struct host_world_node *n = &world->node[node];
    if (n->state != HOST_WORLD_UP)
        return;
    n->state = HOST_WORLD_OFF;
    if (node == 0 && world->options.cube.second_host) {
        hang_up(world, 0, CONNECT_US);
        hang_up(world, 1, CONNECT_US);
    }
    n->unplugged = unplugged;
    plug_in(world, node, false);
    n->busy_until_us = world->now_us + us;
    wake_at(world, node, n->busy_until_us);
}

void host_world_replace(struct host_world *world, unsigned node, uint64_t us,
                        const struct host_stand_in_orders *orders) {
    const struct host_stand_in_orders none = {.kind = HOST_NO_STAND_IN};
    world->node[node].orders = orders != NULL ? *orders : none;
    host_world_crash(world, node, us, false);
}

void host_world_idle(struct host_world *world, unsigned node) {
    const struct host_stand_in_orders idler = {.kind = HOST_IDLER,
                                               .ready = true};
    host_world_replace(world, node, 0, &idler);
}

void host_world_kill(struct host_world *world, unsigned node) {
    host_world_crash(world, node, 0, false);
    if (world->node[node].state == HOST_WORLD_OFF) {
        world->node[node].state = HOST_WORLD_ENDED;
        world->ended++;
        wake_at(world, node, UINT64_MAX);
    }
}

void host_world_late(struct host_world *world, unsigned node, uint64_t us) {
    wake_at(world, node, world->now_us + us);
}

void host_world_pause(struct host_world *world, unsigned node, uint64_t us) {
    struct host_world_node *n = &world->node[node];
    uint64_t until = world->now_us + us;
    if (n->state == HOST_WORLD_UP && until > n->busy_until_us) {
        n->busy_until_us = until;
        wake_at(world, node, n->wake_us < until ? until : n->wake_us);
    }
}

/* When an idle node has something to do. */
static uint64_t next_duty(struct host_world *w, struct host_world_node *n) {
    uint64_t due = w->now_us;
    due += n->learning           ? LISTEN_US
           : n->stand_in != NULL ? host_stand_in_wait_us(n->stand_in)
                                 : node_wait_us(n->node);
    unsigned i = n->board.identity.self;
    for (unsigned d = 0; d < n->links; d++) {
        const struct sim_end *end = host_sim_cube_port(&w->cube, i, d)->end;
        uint64_t bytes = sim_next_us(end->in, w->options.cube.gather_us);
        uint64_t room = sim_room_us(end->out);
        due = bytes < due ? bytes : due;
        due = room < due ? room : due;
    }
    return due;
}

/* Its links may send again what found no room. */
static void look_for_room(struct host_world *w, unsigned i) {
    for (unsigned d = 0; d < w->node[i].links; d++)
        host_sim_cube_port(&w->cube, i, d)->end->out->blocked = false;
}

/* The node's processor is busy, its links are not. */
static void pass(struct host_world *w, unsigned i) {
    struct host_world_node *n = &w->node[i];
    look_for_room(w, i);
    (void)node_receive(n->node);
    uint64_t due = next_duty(w, n), least = w->now_us + PASS_US;
    due = due < least ? least : due;
    wake_at(w, i, due < n->busy_until_us ? due : n->busy_until_us);
}

/* A step of the node itself, charged by its work: microseconds.  What the step
 * before has worked is sent now, as its time is over. */
static uint64_t charged_step(struct host_world_node *n,
                             enum node_event *event) {
    n->stepping = true;
    unsigned moved = node_receive(n->node);
    *event = node_send(n->node, moved);
    if (*event != NODE_STOPPED &&
        node_receive(n->node) + node_work(n->node) > 0)
        *event = NODE_BUSY;
    uint64_t ns = spent_ns(n);
    n->stepping = false;
    n->used_ns += ns / 1000 * 1000;
    return ns / 1000;
}

/* The same of one whose clock may go on by itself. */
static uint64_t timed_step(struct host_world_node *n, enum node_event *event) {
    struct host_world *w = n->world;
    uint64_t begin_us = w->now_us;
    n->stepping = true;
    *event = node_step(n->node);
    n->stepping = false;
    uint64_t passed_us = w->now_us - begin_us;
    w->now_us = begin_us;
    return passed_us;
}

static void step(struct host_world *w, unsigned i) {
    struct host_world_node *n = &w->node[i];
    bool charged = w->options.used_ns != NULL;
    if (charged && n->node != NULL && n->state == HOST_WORLD_UP &&
        w->now_us < n->busy_until_us) {
        pass(w, i);
        return;
    }
    uint64_t cost = host_sim_draw(&w->random, 1, 2 * w->options.step_us);
    if (n->state == HOST_WORLD_OFF) {
        plug_in(w, i, true);
        host_sim_boot(w, i);
        n->busy_until_us = w->now_us + BOOT_US;
        wake_at(w, i, n->busy_until_us);
        return;
    }
    look_for_room(w, i);
    enum node_event event = NODE_BUSY;
    if (n->learning) {
        host_sim_learn(w, i);
        event = NODE_IDLE;
    } else if (n->stand_in != NULL) {
        event = host_stand_in_step(n->stand_in);
    } else if (charged) {
        cost = charged_step(n, &event);
    } else {
        cost += timed_step(n, &event);
    }
    if (event == NODE_STOPPED && n->stand_in == NULL &&
        node_reset_why(n->node) != NODE_RESET_OVER) {
        host_world_crash(w, i, RESTART_US, false);
        return;
    }
    if (event == NODE_STOPPED) {
        n->board.reset(n, 0);
        w->ended++;
        wake_at(w, i, UINT64_MAX);
        return;
    }
    cost = event == NODE_IDLE && !charged ? cost / 8 + 1 : cost;
    cost = cost > 0 ? cost : 1;
    n->busy_us += cost;
    n->busy_until_us = w->now_us + cost;
    uint64_t due = event == NODE_IDLE ? next_duty(w, n) : 0;
    wake_at(w, i, due < n->busy_until_us ? n->busy_until_us : due);
    if (w->options.routers && cost > PASS_US)
        rouse(w, i, next_duty(w, n));
}

/* --- time ----------------------------------------------------------------- */

uint64_t host_world_host_due(const struct host_world *world, unsigned host) {
    uint64_t due = UINT64_MAX;
    unsigned place = world->nodes + host;
    for (unsigned d = 0; d < host_sim_cube_links(&world->cube, place); d++) {
        struct sim_end *end = host_sim_cube_port(&world->cube, place, d)->end;
        uint64_t bytes = sim_next_us(end->in, world->options.cube.gather_us);
        uint64_t room = sim_room_us(end->out);
        due = bytes < due ? bytes : due;
        due = room < due ? room : due;
    }
    return due;
}

/* What happens next, and when: of two at the same time, the first named. */
enum what { STRIKE, STEP, SECOND, CONNECT };

static uint64_t next_event(const struct host_world *w, enum what *what,
                           unsigned *host) {
    uint64_t next = w->node[w->heap[0]].wake_us;
    uint64_t connects = next_connection(w, host);
    *what = w->strike_us <= next ? STRIKE : STEP;
    next = *what == STRIKE ? w->strike_us : next;
    *what = w->second_us < next ? SECOND : *what;
    next = *what == SECOND ? w->second_us : next;
    *what = connects < next ? CONNECT : *what;
    return *what == CONNECT ? connects : next;
}

static void happen(struct host_world *w, enum what what, unsigned host) {
    switch (what) {
    case STRIKE:
        w->strike_us = UINT64_MAX;
        w->options.strike(w->options.context);
        break;
    case STEP:
        step(w, w->heap[0]);
        break;
    case SECOND:
        w->second_us = UINT64_MAX;
        w->options.second(w->options.second_context);
        break;
    case CONNECT:
        connect_host(w, host);
        break;
    }
    if (++w->steps > w->options.steps_max)
        host_world_give_up(w, w->nodes, "too many steps");
}

void host_world_run(struct host_world *world, uint64_t until, bool for_host) {
    struct host_world *w = world;
    while (w->fault == NULL) {
        enum what what;
        unsigned host = 0;
        uint64_t next = next_event(w, &what, &host);
        uint64_t due = for_host ? host_world_host_due(w, 0) : UINT64_MAX;
        if (due <= next && due < until)
            until = due;
        if (next >= until)
            break;
        w->now_us = next > w->now_us ? next : w->now_us;
        happen(w, what, host);
    }
    w->now_us = until > w->now_us ? until : w->now_us;
    if (w->now_us > w->options.time_us_max)
        host_world_give_up(w, w->nodes, "too long");
}

void host_world_halt(struct host_world *world) {
    for (unsigned i = 0; i < world->nodes; i++)
        wake_at(world, i, UINT64_MAX);
}

/* --- from nothing, and back ----------------------------------------------- */

static int open_node(struct host_world *w, unsigned i) {
    struct host_world_node *n = &w->node[i];
    const struct host_world_options *o = &w->options;
    n->world = w;
    n->links = host_sim_cube_links(&w->cube, i);
    n->board.context = n;
    n->board.identity.self = (uint16_t)i;
    n->board.identity.dimension = (uint8_t)o->cube.dimension;
    n->board.identity.window = o->window;
    n->board.identity.host_port = i != 0 && i == o->cube.spare_node;
    n->board.identity.dead_us = o->dead_us;
    n->board.identity.serial_baud = o->serial_baud;
    n->board.now_us = node_now_us;
    n->board.busy_us = node_busy_us;
    n->board.idle = node_idle;
    n->board.reset = node_reset;
    if (o->liar != NULL && o->liar_node == i)
        n->board.write = node_write;
    n->board.fixed_bytes = HOST_WORLD_STACK + HOST_WORLD_STATIC;
    n->board.arena_bytes = o->memory - n->board.fixed_bytes;
    n->board.arena =
        aligned_alloc(64, (n->board.arena_bytes + GUARD_BYTES + 63) / 64 * 64);
    if (n->board.arena == NULL)
        return -1;
    memset((uint8_t *)n->board.arena + n->board.arena_bytes, GUARD,
           GUARD_BYTES);
    for (unsigned d = 0; d < n->links; d++)
        n->board.pipes[d] = host_sim_cube_pipe(&w->cube, i, d);
    /* Nodes start in any order. */
    n->state = HOST_WORLD_OFF;
    n->unplugged = false;
    plug_in(w, i, false);
    wake_at(w, i, host_sim_draw(&w->random, 0, START_US_MAX));
    return 0;
}

static int open_nodes(struct host_world *w) {
    w->node = calloc(w->nodes, sizeof *w->node);
    w->heap = calloc(w->nodes, sizeof *w->heap);
    w->named = calloc(w->cube.wires, sizeof *w->named);
    if (w->node == NULL || w->heap == NULL || w->named == NULL)
        return -1;
    for (unsigned i = 0; i < w->nodes; i++) {
        w->node[i].wake_us = UINT64_MAX;
        place(w, i, i);
    }
    for (unsigned i = 0; i < w->nodes; i++)
        if (open_node(w, i) != 0)
            return -1;
    return 0;
}

int host_world_open(struct host_world *world,
                    const struct host_world_options *options,
                    struct host_error *error) {
    struct host_world *w = world;
    memset(w, 0, sizeof *w);
    w->options = *options;
    w->options.cube.wake = rouse;
    w->options.cube.context = w;
    w->nodes = 1u << options->cube.dimension;
    w->random = sim_seed(options->cube.seed, 1);
    w->look_random = sim_seed(options->cube.seed, 4);
    w->strike_us = w->second_us = UINT64_MAX;
    w->epoch = (uint32_t)(sim_draw(&w->random) >> 33) | 1;
    w->connection[0].wanted = w->connection[0].connected = true;
    if (host_sim_cube_open(&w->cube, &w->options.cube, &w->now_us, error) != 0)
        return error->code;
    if (open_nodes(w) != 0) {
        host_world_close(w);
        return host_fail_memory(error, "the simulated nodes");
    }
    return 0;
}

void host_world_close(struct host_world *world) {
    for (unsigned i = 0; world->node != NULL && i < world->nodes; i++)
        free(world->node[i].board.arena);
    free(world->node);
    free(world->heap);
    free(world->named);
    host_sim_cube_close(&world->cube);
    world->node = NULL;
}

const char *host_world_damage(const struct host_world *world) {
    for (unsigned i = 0; i < world->nodes; i++) {
        const struct node_board *b = &world->node[i].board;
        const uint8_t *past = (const uint8_t *)b->arena + b->arena_bytes;
        for (unsigned k = 0; k < GUARD_BYTES; k++)
            if (past[k] != GUARD)
                return "a node wrote past its memory";
    }
    return NULL;
}
