#include "sim.h"

#include <stdlib.h>
#include <string.h>

#include "host/library/delaunay.h"
#include "host/verify/check.h"
#include "host/mesh/gen.h"
#include "host/service/strategies/strategies.h"
#include "sim_draw.h"
#include "sim_run.h"

enum {
    TIME_US_MAX = 1800000000, /* half an hour in virtual time, */
    STEPS_MAX = 60000000      /* or so many steps: it hangs */
};

/* Bytes with which every node does. */
static uint64_t memory_of(const struct host_sim_run *r) {
    const struct host_sim_plan *p = r->plan;
    struct node_setup_message setup = {
        .setup = {.bricks = r->order.bricks, .index = (uint8_t)p->index}};
    unsigned dimension = (unsigned)__builtin_ctz(p->nodes);
    struct node_identity identity = {.dimension = (uint8_t)dimension,
                                     .window = (uint8_t)p->window,
                                     .serial_baud = p->serial_baud,
                                     .epoch = 1};
    memcpy(setup.setup.cells, r->order.cells, sizeof setup.setup.cells);
    uint64_t memory = 0, needed = 1;
    while (needed > memory) {
        memory += 4096;
        needed = host_strategy_arena(p->strategy, p->nodes, &identity, memory,
                                     &p->sharing, &setup) +
                 HOST_WORLD_STACK + HOST_WORLD_STATIC;
    }
    return memory + p->memory_more / 64 * 64;
}

static int open_world(struct host_sim_run *r, struct host_error *error) {
    const struct host_sim_plan *p = r->plan;
    struct host_world_options o = {
        .cube = {.dimension = (unsigned)__builtin_ctz(p->nodes),
                 .seed = p->seed,
                 .wire = p->wire,
                 .host_wire = p->host_wire,
                 .second_host = p->wanted[HOST_SIM_SECOND_HOST],
                 .gather_us = p->gather_us},
        .memory = memory_of(r),
        .window = (uint8_t)p->window,
        .dead_us = p->dead_us,
        .step_us = p->step_us,
        .host_us = p->host_us,
        .look_us = p->look_us,
        .bare = p->wanted[HOST_SIM_BARE],
        .serial_baud = p->serial_baud,
        .time_us_max = TIME_US_MAX,
        .steps_max = STEPS_MAX,
        .absent_s = p->absent_s,
        .strike = host_sim_faults_strike,
        .context = r,
        .second = host_second_host_round,
        .second_context = &r->second,
        .liar = p->wanted[HOST_SIM_LIAR] ? &r->liar : NULL,
        .liar_node = p->liar.node,
    };
    r->liar.way = p->liar.way;
    r->liar.one_in = p->liar.one_in;
    r->liar.random = sim_seed(p->seed, 5);
    if (host_world_open(&r->world, &o, error) != 0) {
        return error->code;
    }
    struct host_sim_cube *cube = &r->world.cube;
    for (unsigned i = 0; i < p->missing; i++) {
        unsigned wire =
            (unsigned)host_sim_draw(&r->random, 0, cube->host_wire - 1);
        if (!cube->wire[wire].missing) {
            host_sim_cube_leave_out(cube, wire);
        }
    }
    return 0;
}

static int make_work(struct host_sim_run *r, struct host_error *error) {
    const struct host_sim_plan *p = r->plan;
    if (host_gen(p->kind, p->points, p->seed, &r->points, error) != 0) {
        return error->code;
    }
    return host_order_make(&r->order, "points", r->points.xyz, r->points.count,
                           host_strategy_partition(p->strategy, p->partition),
                           p->strategy->regions(p->nodes),
                           p->index == INCODE_GRID, error);
}

/* What is left in the queues of host and nodes when all is done. */
static int check_queues(const struct host_sim_run *r,
                        struct host_error *error) {
    const struct host_service *s = &r->service;
    uint64_t left = s->over ? 0 : s->spill.faces;
    for (unsigned i = 0; i < r->plan->nodes && !s->over; i++) {
        const struct host_world_node *node = &r->world.node[i];
        left += s->node[i].pages_count + s->node[i].unspills_count;
        /* A node that was cut off for good keeps what it has. */
        bool counts = node->state == HOST_WORLD_UP && node->node != NULL &&
                      !s->work.lost[i];
        left += counts ? node_held(node->node) : 0;
    }
    if (s->ledger.committed != s->ledger.bricks || left > 0) {
        return host_fail(error, HOST_BROKEN,
                         "cube: %u of %u bricks committed and %llu slots of "
                         "queues in use at the end; replay it",
                         s->ledger.committed, s->ledger.bricks,
                         (unsigned long long)left);
    }
    return 0;
}

static int check_second_host(const struct host_sim_run *r,
                             struct host_error *error) {
    return r->second.fault[0] == '\0'
               ? 0
               : host_fail(error, HOST_BROKEN, "node 0: %s; replay it",
                           r->second.fault);
}

/* Every wire that was missing was named, and no other. */
static int check_wires(const struct host_sim_run *r, struct host_error *error) {
    const struct host_world *w = &r->world;
    const bool *wanted = r->plan->wanted;
    /* What died or was lost since may be named as dead, or not at all. */
    bool all = !r->service.over && !wanted[HOST_SIM_DEAD_WIRE] &&
               !wanted[HOST_SIM_DEAD_NODE];
    for (unsigned i = 0; i < w->cube.wires; i++) {
        bool missing = w->cube.wire[i].missing, named = w->named[i];
        /* One that died before its ends had met counts as either. */
        bool dead = w->cube.wire[i].dead;
        if (missing ? all && !named : named && !dead) {
            return host_fail(error, HOST_BROKEN, "host: wire %u %s; replay it",
                             i,
                             missing ? "is missing and was not named"
                                     : "was named as missing and is there");
        }
    }
    return 0;
}

/* What the service mends is a fault all the same, where no node lies: a result
 * that was wrong at first, or a node at fault.  Where one lies, no other node
 * may be blamed. */
static int check_mended(const struct host_sim_run *r,
                        struct host_error *error) {
    const struct host_service *s = &r->service;
    bool lies = r->plan->wanted[HOST_SIM_LIAR];
    bool mended =
        s->audit.failed > 0 || s->excluded > 0 || s->strategy == &host_redo;
    if (mended && !lies) {
        return host_fail(error, HOST_UNVERIFIED,
                         "host: %u checks of the result failed and %u nodes "
                         "were excluded, although no node lies; replay it",
                         s->audit.failed, s->excluded);
    }
    return s->excluded <= (lies && s->node[r->plan->liar.node].aside)
               ? 0
               : host_fail(error, HOST_CUBE,
                           "host: a node was excluded that does not lie; "
                           "replay it");
}

static int serve(struct host_sim_run *r, struct host_machine *machine,
                 struct host_error *error) {
    const struct host_sim_plan *p = r->plan;
    struct host_service *s = &r->service;
    s->machine = machine;
    s->order = &r->order;
    s->tets = &r->tets;
    s->window = p->host_window;
    s->patience_us = p->patience_us;
    s->strategy = p->strategy;
    s->sharing = p->sharing;
    s->setup.setup.index = (uint8_t)p->index;
    s->setup.setup.face_rule = (uint8_t)p->face_rule;
    s->setup.setup.build = (uint8_t)p->build;
    s->setup.setup.shuffle_seed = p->shuffle_seed;
    s->setup.page_key = sim_seed(p->seed, 90);
    s->audit.secret = sim_seed(p->seed, 91);
    s->verifying =
        p->wanted[HOST_SIM_LIAR] ? HOST_VERIFY_ALWAYS : HOST_VERIFY_WHERE_DUE;
    host_sim_faults_prepare(r);
    int status = host_service_start(s, error);
    if (status == 0) {
        uint64_t start_us = r->world.now_us;
        host_sim_faults_begin(r);
        status = host_service_run(s, error);
        host_sim_faults_finish(r);
        host_second_host_leave(&r->second);
        r->outcome->work_us = r->world.now_us - start_us;
    }
    status = status != 0 ? status : check_queues(r, error);
    status = status != 0 ? status : check_mended(r, error);
    status = status != 0 ? status : check_second_host(r, error);
    status = status != 0 ? status : host_service_wires(s, error);
    status = status != 0 ? status : check_wires(r, error);
    r->calm_us = 0;
    r->world.strike_us = 0;
    host_service_end(s);
    return status;
}

static int compare(struct host_sim_run *r, struct host_error *error) {
    static struct host_check_report report;
    struct host_tetrahedra right = {0};
    struct host_digest digest = {{0}};
    int status = host_delaunay(r->points.xyz, r->points.count, &right, error);
    if (status == 0) {
        status = host_verify(&r->points, &right, HOST_CHECK_DELAUNAY, &report,
                             error);
    }
    if (status == 0) {
        host_digest(&right, &digest);
        host_tetrahedra_map(&r->tets, r->order.row);
        host_tetrahedra_sort(&r->tets);
        host_digest(&r->tets, &r->outcome->digest);
        if (strcmp(digest.text, r->outcome->digest.text) != 0) {
            status = host_fail(error, HOST_UNVERIFIED,
                               "host: %llu tetrahedra, digest %.15s; %llu and "
                               "%.15s are right; replay it",
                               (unsigned long long)r->tets.count,
                               r->outcome->digest.text,
                               (unsigned long long)right.count, digest.text);
        }
    }
    host_tetrahedra_free(&right);
    return status;
}

/* A run that gave up as a node lies, and says which. */
static bool names_liar(const struct host_sim_run *r, int status,
                       const struct host_error *error) {
    char name[16];
    snprintf(name, sizeof name, "node %u: ", r->plan->liar.node);
    return r->liar.told > 0 && status == HOST_UNVERIFIED &&
           strncmp(error->text, name, strlen(name)) == 0;
}

static void tell(struct host_sim_run *r) {
    struct host_sim_outcome *out = r->outcome;
    const struct host_world *w = &r->world;
    out->trace = w->cube.trace;
    out->steps = w->steps;
    out->time_us = w->now_us;
    for (unsigned i = 0; i < w->nodes; i++) {
        out->restarts += w->node[i].starts - 1;
        for (unsigned d = 0; i < 16 && d < w->node[i].links; d++) {
            const struct host_sim_port *port =
                host_sim_cube_port(&w->cube, i, d);
            out->node_frames[i] += port->end->out->frames;
        }
    }
    for (unsigned i = 0; i < 2 * w->cube.wires; i++) {
        out->frames += host_sim_cube_direction(&w->cube, i / 2, i % 2)->frames;
    }
}

int host_sim_run(const struct host_sim_plan *plan,
                 struct host_sim_outcome *outcome, struct host_error *error) {
    struct host_sim_run *r = calloc(1, sizeof *r);
    memset(outcome, 0, sizeof *outcome);
    if (r == NULL) {
        return host_fail_memory(error, "the simulation");
    }
    r->plan = plan;
    r->outcome = outcome;
    r->random = sim_seed(plan->seed, 2);
    int status = make_work(r, error);
    if (status == 0 && open_world(r, error) == 0) {
        struct host_machine machine = host_world_machine(&r->world);
        status = serve(r, &machine, error);
        tell(r);
        const char *damage = host_world_damage(&r->world);
        bool gave_up = names_liar(r, status, error);
        if (gave_up) {
            *error = (struct host_error){0};
            status = 0;
        }
        if (status == 0 && damage != NULL) {
            status =
                host_fail(error, HOST_BROKEN, "node: %s; replay it", damage);
        }
        host_world_close(&r->world);
        status = status != 0 || gave_up ? status : compare(r, error);
    }
    host_order_free(&r->order);
    host_points_free(&r->points);
    host_tetrahedra_free(&r->tets);
    free(r);
    return status != 0 ? status : error->code;
}
