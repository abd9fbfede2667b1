#include "sim_cube.h"

#include <stdlib.h>
#include <string.h>

#include "sim_draw.h"
#include "sim_world.h"

/* --- who is where --------------------------------------------------------- */

static unsigned host_wires_of(const struct host_sim_cube *c) {
    const struct host_sim_cube_options *o = &c->options;
    return o->spare_node != 0 ? 2 : o->host_ports > 1 ? o->host_ports : 1;
}

/* The node at the end of the host's k-th wire. */
static unsigned host_node(const struct host_sim_cube *c, unsigned k) {
    return k > 0 && c->options.spare_node != 0 ? c->options.spare_node : k;
}

unsigned host_sim_cube_links(const struct host_sim_cube *cube, unsigned place) {
    if (place >= cube->nodes)
        return place == cube->nodes ? host_wires_of(cube) : 1;
    bool hosted = false;
    for (unsigned k = 0; k < host_wires_of(cube); k++)
        hosted = hosted || host_node(cube, k) == place;
    return cube->options.dimension + hosted;
}

unsigned host_sim_cube_wire(const struct host_sim_cube *cube, unsigned place,
                            unsigned link) {
    if (place > cube->nodes)
        return cube->wires - 1;
    if (place == cube->nodes)
        return cube->host_wire + link;
    if (link == cube->options.dimension) {
        bool spare = place != 0 && cube->options.spare_node != 0;
        return cube->host_wire + (spare ? 1 : place);
    }
    unsigned low = place & ((1u << link) - 1);
    return link * (cube->nodes / 2) + (place >> (link + 1) << link) + low;
}

/* The place at the other end. */
static unsigned peer_of(const struct host_sim_cube *c, unsigned place,
                        unsigned link) {
    return place > c->nodes               ? 0
           : place == c->nodes            ? host_node(c, link)
           : link == c->options.dimension ? c->nodes
                                          : place ^ 1u << link;
}

struct host_sim_port *host_sim_cube_port(const struct host_sim_cube *cube,
                                         unsigned place, unsigned link) {
    return &cube->port[place * cube->links_max + link];
}

struct sim_direction *host_sim_cube_direction(const struct host_sim_cube *cube,
                                              unsigned wire, unsigned side) {
    return &cube->wire[wire].wire.direction[side];
}

/* --- bytes ---------------------------------------------------------------- */

static void remember(struct host_sim_cube *c, uint64_t word) {
    c->trace = (c->trace ^ word) * UINT64_C(0x9fb21c651e98df25);
    c->trace ^= c->trace >> 28;
}

static void remember_bytes(struct host_sim_cube *c, const uint8_t *bytes,
                           size_t size) {
    for (; size >= 8; bytes += 8, size -= 8) {
        uint64_t word;
        memcpy(&word, bytes, 8);
        remember(c, word);
    }
    uint64_t rest = size;
    for (size_t i = 0; i < size; i++)
        rest = rest << 8 | bytes[i];
    remember(c, rest);
}

static int port_send(void *context, const uint8_t *bytes, size_t size) {
    struct host_sim_port *port = context;
    struct host_sim_cube *c = port->cube;
    const struct host_sim_cube_options *o = &c->options;
    if (port->replaced)
        return LINK_PIPE_CLOSED;
    int taken = port->pipe.send(port->pipe.context, bytes, size);
    if (taken > 0) {
        remember(c, *c->now_us << 16 ^ port->wire << 1 ^ port->side);
        remember_bytes(c, bytes, (size_t)taken);
        if (o->wake != NULL) {
            o->wake(o->context, port->peer,
                    sim_next_us(port->end->out, o->gather_us));
        }
    }
    return taken;
}

static int port_receive(void *context, uint8_t *bytes, size_t size) {
    struct host_sim_port *port = context;
    if (port->replaced) {
        port->replaced = false;
        return LINK_PIPE_CLOSED;
    }
    int got = port->pipe.receive(port->pipe.context, bytes, size);
    const struct host_sim_cube_options *o = &port->cube->options;
    if (got > 0 && port->end->in->blocked && o->wake != NULL)
        o->wake(o->context, port->peer, *port->cube->now_us);
    return got;
}

struct link_pipe host_sim_cube_pipe(const struct host_sim_cube *cube,
                                    unsigned place, unsigned link) {
    return (struct link_pipe){host_sim_cube_port(cube, place, link), port_send,
                              port_receive};
}

static void open_port(struct host_sim_cube *c, unsigned place, unsigned link,
                      unsigned wire, unsigned peer) {
    struct host_sim_port *port = host_sim_cube_port(c, place, link);
    port->cube = c;
    port->peer = peer;
    port->wire = wire;
    port->side = place > peer;
    port->end = &c->wire[wire].wire.end[port->side];
    port->pipe = sim_pipe(port->end);
}

/* --- what breaks ---------------------------------------------------------- */

void host_sim_cube_faults(struct host_sim_cube *cube,
                          const struct sim_faults *faults) {
    for (unsigned i = 0; i < 2 * cube->wires; i++) {
        sim_direction_faults(host_sim_cube_direction(cube, i / 2, i % 2),
                             faults);
    }
}

uint64_t host_sim_cube_struck(const struct host_sim_cube *cube,
                              enum sim_fault fault) {
    uint64_t sum = 0;
    for (unsigned i = 0; i < 2 * cube->wires; i++)
        sum += host_sim_cube_direction(cube, i / 2, i % 2)->struck[fault];
    return sum;
}

void host_sim_cube_cut(struct host_sim_cube *cube, unsigned wire, bool cut) {
    struct host_sim_wire *one = &cube->wire[wire];
    one->cuts += cut ? 1u : UINT32_MAX;
    if (cut ? one->cuts == 1 : one->cuts == 0)
        sim_wire_cut(&one->wire, cut);
}

void host_sim_cube_deaf(struct host_sim_cube *cube, unsigned wire,
                        unsigned side, bool deaf) {
    struct host_sim_wire *one = &cube->wire[wire];
    one->deaf[side] += deaf ? 1u : UINT32_MAX;
    sim_direction_deaf(&one->wire.direction[side], one->deaf[side] > 0);
}

void host_sim_cube_leave_out(struct host_sim_cube *cube, unsigned wire) {
    cube->wire[wire].missing = true;
    host_sim_cube_cut(cube, wire, true);
}

void host_sim_cube_connect(struct host_sim_cube *cube, unsigned host) {
    unsigned place = cube->nodes + host, link = cube->options.dimension;
    open_port(cube, 0, link, host_sim_cube_wire(cube, place, 0), place);
    host_sim_cube_port(cube, 0, link)->replaced = true;
}

/* --- from nothing, and back ----------------------------------------------- */

static int make_wires(struct host_sim_cube *c) {
    const struct host_sim_cube_options *o = &c->options;
    size_t each = sim_wire_bytes(&o->wire);
    size_t of_host = sim_wire_bytes(&o->host_wire);
    c->wire = calloc(c->wires, sizeof *c->wire);
    c->port = calloc((size_t)c->places * c->links_max, sizeof *c->port);
    c->bytes =
        malloc(each * c->host_wire + of_host * (c->wires - c->host_wire));
    if (c->wire == NULL || c->port == NULL || c->bytes == NULL)
        return -1;
    uint8_t *bytes = c->bytes;
    for (unsigned i = 0; i < c->wires; i++) {
        bool host = i >= c->host_wire;
        sim_wire_init(&c->wire[i].wire, bytes, host ? &o->host_wire : &o->wire,
                      c->now_us, sim_seed(o->seed, 1000 + i));
        if (o->shared)
            sim_wire_share(&c->wire[i].wire, &c->medium_ns);
        bytes += host ? of_host : each;
    }
    return 0;
}

int host_sim_cube_open(struct host_sim_cube *cube,
                       const struct host_sim_cube_options *options,
                       const uint64_t *now_us, struct host_error *error) {
    struct host_sim_cube *c = cube;
    memset(c, 0, sizeof *c);
    c->options = *options;
    if (options->host_wire.bytes == 0)
        c->options.host_wire = options->wire;
    c->now_us = now_us;
    c->nodes = 1u << options->dimension;
    c->places = c->nodes + (options->second_host ? 2 : 1);
    c->host_wire = c->nodes * options->dimension / 2;
    c->wires = c->host_wire + host_wires_of(c) + options->second_host;
    c->links_max = options->dimension + 1;
    if (c->links_max < host_wires_of(c))
        c->links_max = host_wires_of(c);
    if (make_wires(c) != 0) {
        host_sim_cube_close(c);
        return host_fail_memory(error, "the simulated wires");
    }
    for (unsigned i = 0; i < c->places; i++)
        for (unsigned d = 0; d < host_sim_cube_links(c, i); d++)
            open_port(c, i, d, host_sim_cube_wire(c, i, d), peer_of(c, i, d));
    host_sim_cube_faults(c, &options->faults);
    if (options->second_host)
        host_sim_cube_cut(c, c->wires - 1, true);
    return 0;
}

void host_sim_cube_close(struct host_sim_cube *cube) {
    free(cube->wire);
    free(cube->port);
    free(cube->bytes);
    cube->wire = NULL;
    cube->port = NULL;
    cube->bytes = NULL;
}

/* --- sim machine ---------------------------------------------------------- */

/* Each look at the clock costs the host some time. */
static uint64_t machine_now_us(void *context) {
    struct host_world *w = context;
    uint64_t us = host_sim_draw(&w->random, 1, 2 * w->options.host_us);
    us += w->host_pause_us;
    w->host_pause_us = 0;
    host_world_run(w, w->now_us + us, false);
    return w->now_us;
}

static void machine_idle(void *context, uint64_t wait_us) {
    struct host_world *w = context;
    host_world_run(w, w->now_us + wait_us, true);
    unsigned host = w->nodes;
    for (unsigned d = 0; d < host_sim_cube_links(&w->cube, host); d++)
        host_sim_cube_port(&w->cube, host, d)->end->out->blocked = false;
}

static int machine_check(void *context, struct host_error *error) {
    const struct host_world *w = context;
    if (w->fault == NULL)
        return 0;
    return host_fail(error, HOST_CUBE,
                     "node %u: %s, after %llu ms and %llu steps; replay it",
                     w->fault_node, w->fault,
                     (unsigned long long)w->now_us / 1000,
                     (unsigned long long)w->steps);
}

static bool machine_ended(void *context) {
    const struct host_world *w = context;
    return w->ended == w->nodes || w->fault != NULL;
}

static void machine_stop(void *context) {
    host_world_halt(context);
}

static void machine_missing(void *context, unsigned node, unsigned link) {
    struct host_world *w = context;
    w->named[host_sim_cube_wire(&w->cube, node, link)] = true;
}

/* Seeds say what they have to say at their end. */
static void machine_told(void *context, const char *line) {
    (void)context, (void)line;
}

struct host_machine host_world_machine(struct host_world *world) {
    struct host_machine machine = {.virtual_time = true};
    machine.context = world;
    unsigned host = world->nodes;
    const struct host_sim_cube_options *o = &world->options.cube;
    machine.nodes = world->nodes;
    machine.dimension = o->dimension;
    machine.epoch = world->epoch++;
    machine.serial_baud = world->options.serial_baud;
    machine.pipe = host_sim_cube_pipe(&world->cube, host, 0);
    if (o->spare_node != 0) {
        machine.spare_node = o->spare_node;
        machine.spare = host_sim_cube_pipe(&world->cube, host, 1);
    }
    machine.absent_s = world->options.absent_s;
    machine.missing = machine_missing;
    machine.told = machine_told;
    machine.now_us = machine_now_us;
    machine.idle = machine_idle;
    machine.check = machine_check;
    machine.ended = machine_ended;
    machine.stop = machine_stop;
    return machine;
}
