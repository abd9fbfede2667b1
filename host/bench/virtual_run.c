#include "virtual_run.h"

#include <stdlib.h>
#include <string.h>

#include "host/service/strategies/strategies.h"
#include "host/sim/sim_world.h"

enum { HOST_US = 2 }; /* the host's own work is not modelled */

struct virtual_world {
    struct host_virtual_run *run;
    struct host_world world;
    struct host_service service;
    struct host_order order;
    struct host_tetrahedra tets;
    uint64_t page_bytes_to_all;
};

static uint64_t used_ns(void *context, unsigned i, const struct node *node) {
    const struct virtual_world *v = context;
    const struct cube_statistics *m = node_messages(node);
    struct node_finished_message totals;
    node_account(node, &totals);
    double times = v->run->slow > 0 && i == 0 ? v->run->slow : 1;
    return (uint64_t)(times * host_bench_node_ns(v->run->machine, &totals,
                                                 m->written + m->read));
}

static int open_world(struct virtual_world *v, struct host_error *error) {
    const struct host_run_options *run = v->run->options;
    const struct host_bench_machine *m = v->run->machine;
    struct host_world_options o = {
        .cube = {.dimension = (unsigned)__builtin_ctz(run->nodes),
                 .seed = 1,
                 .wire = m->wire,
                 .host_wire = m->host_wire,
                 .gather_us = m->gather_us,
                 .shared = m->shared},
        .memory = run->memory,
        .host_us = HOST_US,
        .step_us = 1,
        .used_ns = used_ns,
        .used_context = v,
        .routers = m->routers,
        .time_us_max = UINT64_MAX / 4,
        .steps_max = UINT64_MAX};
    return host_world_open(&v->world, &o, error);
}

static int serve(struct virtual_world *v, struct host_machine *machine,
                 struct host_error *error) {
    const struct host_run_options *run = v->run->options;
    struct host_service *s = &v->service;
    s->machine = machine;
    s->order = &v->order;
    s->tets = &v->tets;
    s->strategy = run->strategy;
    s->sharing = run->sharing;
    s->setup.setup.index = (uint8_t)run->index;
    s->setup.setup.face_rule = (uint8_t)run->face_rule;
    s->setup.setup.build = (uint8_t)run->build;
    int status = host_service_start(s, error);
    if (status == 0) {
        uint64_t start_us = v->world.now_us;
        status = host_service_run(s, error);
        v->run->result.time_triangulation_s =
            1e-6 * (double)(v->world.now_us - start_us);
        host_run_sum(s, &v->run->result);
        v->page_bytes_to_all = s->page_bytes_to_all;
    }
    host_service_end(s);
    return status;
}

static void sum(struct virtual_world *v) {
    struct host_virtual_run *run = v->run;
    struct host_run_result *r = &run->result;
    uint64_t bytes = v->page_bytes_to_all;
    run->work_ns = 0;
    for (unsigned i = 0; i < r->nodes; i++) {
        double counts[HOST_BENCH_COUNTS];
        host_bench_counts(&r->node[i].statistics, counts);
        run->work_ns += host_bench_work_ns(run->machine->price, counts);
        bytes += r->node[i].page_bytes;
    }
    r->tetrahedra = v->tets.count;
    r->points = v->order.points;
    r->time_io_s =
        host_bench_io_s(run->machine, bytes, (unsigned)__builtin_ctz(r->nodes));
}

int host_virtual_run(struct host_virtual_run *run,
                     const struct host_points *points,
                     struct host_error *error) {
    struct virtual_world *v = calloc(1, sizeof *v);
    if (v == NULL) {
        return host_fail_memory(error, "the simulated cube");
    }
    const struct host_run_options *o = run->options;
    v->run = run;
    memset(&run->result, 0, sizeof run->result);
    run->result.nodes = o->nodes;
    run->result.strategy = o->strategy;
    int status = host_order_make(
        &v->order, "points", points->xyz, points->count,
        host_strategy_partition(o->strategy, o->partition),
        o->strategy->regions(o->nodes), o->index == INCODE_GRID, error);
    if (status == 0 && open_world(v, error) == 0) {
        struct host_machine machine = host_world_machine(&v->world);
        status = serve(v, &machine, error);
        sum(v);
        host_world_close(&v->world);
    }
    host_order_free(&v->order);
    host_tetrahedra_free(&v->tets);
    free(v);
    return status != 0 ? status : error->code;
}
