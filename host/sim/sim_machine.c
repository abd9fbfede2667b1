#include "sim_draw.h"
#include "sim_world.h"

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
    for (unsigned d = 0; d < host_sim_cube_links(&w->cube, host); d++) {
        host_sim_cube_port(&w->cube, host, d)->end->out->blocked = false;
    }
}

static int machine_check(void *context, struct host_error *error) {
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
