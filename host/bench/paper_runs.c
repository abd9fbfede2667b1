#include "paper_runs.h"

#include <stdio.h>
#include <string.h>

#include "host/base/progress.h"
#include "host/formats/read.h"
#include "host/mesh/gen.h"
#include "host/service/strategies/strategies.h"
#include "virtual_run.h"

/* The grid of NASA's Blunt Fin. */
enum { FIN_I = 40, FIN_J = 32, FIN_K = 32, FIN = FIN_I * FIN_J * FIN_K };

/* --- sets ----------------------------------------------------------------- */

/* Every second node along the second and third index, and in a quick run every
 * fourth and the second along the first: 10,240 or 1,280 points. */
static int thin_fin(const struct host_points *whole, bool quick,
                    struct host_points *points, struct host_error *error) {
    unsigned step_i = quick ? 2 : 1, step = quick ? 4 : 2;
    for (unsigned row = 0; row < FIN && error->code == 0; row++) {
        unsigned i = row % FIN_I, j = row / FIN_I % FIN_J,
                 k = row / FIN_I / FIN_J;
        if (i % step_i == 0 && j % step == 0 && k % step == 0) {
            (void)host_points_append(points, whole->xyz + 3 * (size_t)row, 1,
                                     error);
        }
    }
    return error->code;
}

static int make_fin(const struct host_paper_runs *runs,
                    struct host_points *points, struct host_error *error) {
    struct host_points whole = {0};
    int status = runs->bluntfin == NULL
                     ? host_gen("bluntfin", FIN, 1, &whole, error)
                     : host_points_read(runs->bluntfin, &whole, error);
    if (status == 0 && whole.count != FIN) {
        status =
            host_fail(error, HOST_INPUT,
                      "%s: %llu points, where the grid of the Blunt Fin "
                      "has %d; give its file",
                      runs->bluntfin, (unsigned long long)whole.count, FIN);
    }
    status =
        status != 0 ? status : thin_fin(&whole, runs->quick, points, error);
    host_points_free(&whole);
    return status;
}

static int make_set(const struct host_paper_runs *runs, const char *set,
                    uint64_t points, struct host_points *xyz,
                    struct host_error *error) {
    uint64_t n = runs->quick ? points / HOST_PAPER_QUICK : points;
    if (strcmp(set, "Blunt Fin") == 0) {
        return make_fin(runs, xyz, error);
    }
    return host_gen(strcmp(set, "Bubbles") == 0 ? "bubbles" : "uniform", n, 1,
                    xyz, error);
}

const struct host_points *host_paper_set(struct host_paper_runs *runs,
                                         const char *set, uint64_t points,
                                         struct host_error *error) {
    for (unsigned i = 0; i < runs->sets; i++) {
        if (strcmp(runs->set[i].set, set) == 0 &&
            runs->set[i].points == points) {
            return &runs->set[i].xyz;
        }
    }
    if (runs->sets == HOST_PAPER_SETS) {
        host_fail(error, HOST_BROKEN, "bench paper: more sets than %d",
                  HOST_PAPER_SETS);
        return NULL;
    }
    struct host_points *xyz = &runs->set[runs->sets].xyz;
    if (make_set(runs, set, points, xyz, error) != 0) {
        return NULL;
    }
    runs->set[runs->sets].set = set;
    runs->set[runs->sets++].points = points;
    return xyz;
}

/* --- runs ----------------------------------------------------------------- */

static void configure(const struct host_paper_case *c,
                      struct host_run_options *options) {
    host_run_defaults(options);
    options->strategy = host_strategy_named(c->strategy);
    options->nodes = c->nodes;
    options->sharing.builders = c->builders;
    options->partition = c->partition;
    options->face_rule = c->paper_rule ? INCODE_FACE_PAPER : INCODE_FACE_OWN;
    options->build = INCODE_BUILD_FACES; /* as the paper's nodes do */
    options->quiet = true;
}

/* As "exchange, 128 nodes": what the line on the terminal says. */
static void show(const struct host_paper_case *c) {
    static char phase[96];
    (void)snprintf(phase, sizeof phase, "%s %llu, %s, %u node%s", c->set,
                   (unsigned long long)c->points, c->strategy, c->nodes,
                   c->nodes == 1 ? "" : "s");
    host_progress_phase(phase, NULL);
}

static double busiest(const struct host_run_result *r) {
    uint64_t most = 0;
    for (unsigned i = 0; i < r->nodes; i++) {
        uint64_t us = r->node[i].statistics.busy_us;
        most = us > most ? us : most;
    }
    return 1e-6 * (double)most;
}

static int make_run(struct host_paper_runs *runs,
                    const struct host_paper_case *c,
                    struct host_paper_result *result,
                    struct host_error *error) {
    static struct host_virtual_run run;
    struct host_run_options options;
    const struct host_points *points =
        host_paper_set(runs, c->set, c->points, error);
    if (points == NULL) {
        return error->code;
    }
    configure(c, &options);
    run.machine = &runs->machine[c->machine];
    run.options = &options;
    show(c);
    if (host_virtual_run(&run, points, error) != 0) {
        return error->code;
    }
    const struct host_run_result *r = &run.result;
    *result = (struct host_paper_result){.c = *c,
                                         .points = r->points,
                                         .tetrahedra = r->tetrahedra,
                                         .t_min = r->t_min_s,
                                         .t_max = r->t_max_s,
                                         .t_io = r->time_io_s,
                                         .duplication = (double)r->built /
                                                        (double)r->tetrahedra,
                                         .busy = busiest(r),
                                         .work_ns = run.work_ns};
    return 0;
}

static bool same(const struct host_paper_case *a,
                 const struct host_paper_case *b) {
    return strcmp(a->set, b->set) == 0 && a->points == b->points &&
           strcmp(a->strategy, b->strategy) == 0 &&
           a->paper_rule == b->paper_rule && a->partition == b->partition &&
           a->machine == b->machine && a->nodes == b->nodes &&
           a->builders == b->builders;
}

const struct host_paper_result *host_paper_run(struct host_paper_runs *runs,
                                               const struct host_paper_case *c,
                                               struct host_error *error) {
    for (unsigned i = 0; i < runs->results; i++) {
        if (same(&runs->result[i].c, c)) {
            return &runs->result[i];
        }
    }
    struct host_paper_result *result = &runs->result[runs->results];
    if (runs->results == HOST_PAPER_RUNS_MAX) {
        host_fail(error, HOST_BROKEN, "bench paper: more runs than %d",
                  HOST_PAPER_RUNS_MAX);
        return NULL;
    }
    if (make_run(runs, c, result, error) != 0) {
        return NULL;
    }
    runs->results++;
    return result;
}

static const struct host_paper_result *alone(struct host_paper_runs *runs,
                                             const char *set, uint64_t points,
                                             enum host_paper_machine machine,
                                             struct host_error *error) {
    const struct host_paper_case c = {.set = set,
                                      .points = points,
                                      .strategy = "sequential",
                                      .machine = machine,
                                      .nodes = 1};
    return host_paper_run(runs, &c, error);
}

double host_paper_alone_s(struct host_paper_runs *runs,
                          const struct host_paper_case *c,
                          struct host_error *error) {
    const struct host_paper_result *r =
        alone(runs, c->set, c->points, c->machine, error);
    return r == NULL ? 0 : r->t_max;
}

/* How long the work takes on which a machine's scale rests is known when it has
 * been run; a slow machine's nodes divide it into smaller steps, so that it is
 * run once more, at the scale that was found.  All points, quick or not. */
static int find_scale(struct host_bench_machine *machine,
                      struct host_error *error) {
    static struct host_paper_runs whole;
    machine->scale = 1;
    for (int i = 0; i < 2 && error->code == 0; i++) {
        whole.machine[0] = *machine;
        const struct host_paper_result *r =
            alone(&whole, "Uniform", 20000, (enum host_paper_machine)0, error);
        if (r != NULL) {
            machine->scale = machine->work_s * 1e9 / r->work_ns;
        }
        host_paper_runs_end(&whole);
    }
    return error->code;
}

int host_paper_runs_begin(struct host_paper_runs *runs,
                          struct host_error *error) {
    runs->machine[HOST_PAPER_NCUBE] = host_bench_ncube;
    runs->machine[HOST_PAPER_WORKSTATIONS] = host_bench_workstations;
    runs->machine[HOST_PAPER_HERE] = host_bench_here;
    for (int i = 0; i < HOST_PAPER_MACHINES && error->code == 0; i++) {
        if (runs->machine[i].work_s > 0) {
            (void)find_scale(&runs->machine[i], error);
        }
    }
    return error->code;
}

void host_paper_runs_end(struct host_paper_runs *runs) {
    for (unsigned i = 0; i < runs->sets; i++) {
        host_points_free(&runs->set[i].xyz);
    }
    runs->sets = runs->results = 0;
}
