#include "paper_sequential.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibrate.h"
#include "host/base/progress.h"
#include "host/mesh/names.h"
#include "host/service/strategies/strategies.h"
#include "paper_list.h"

/* --- real runs ------------------------------------------------------------ */

/* tets: NULL, or takes rows of points. */
static int run(const struct host_points *points, const char *strategy,
               unsigned nodes, enum incode_index index,
               struct host_tetrahedra *tets, struct host_run_result *result,
               struct host_error *error) {
    struct host_run_options o;
    struct host_tetrahedra own = {0};
    host_run_defaults(&o);
    o.strategy = host_strategy_named(strategy);
    o.nodes = nodes;
    o.index = index;
    o.build = INCODE_BUILD_FACES;
    o.quiet = true;
    memset(result, 0, sizeof *result);
    int status =
        host_triangulate(&o, points, tets == NULL ? &own : tets, result, error);
    host_tetrahedra_free(&own);
    return status;
}

static double busiest(const struct host_run_result *r) {
    uint64_t most = 0;
    for (unsigned i = 0; i < r->nodes; i++) {
        uint64_t us = r->node[i].statistics.busy_us;
        most = us > most ? us : most;
    }
    return 1e-6 * (double)most;
}

/* --- Table 1 -------------------------------------------------------------- */

/* Rows of points become vertex numbers, as the nodes count them. */
static int number_vertices(const struct host_points *points,
                           struct host_tetrahedra *tets, uint64_t *vertices,
                           struct host_error *error) {
    struct host_order order = {0};
    if (host_order_make(&order, "points", points->xyz, points->count,
                        HOST_ADAPTIVE, 1, false, error) != 0) {
        return error->code;
    }
    uint32_t *vertex = calloc(points->count, sizeof *vertex);
    *vertices = (uint64_t)order.bricks * INCODE_BRICK_POINTS;
    for (uint32_t v = 0; vertex != NULL && v < *vertices; v++) {
        if (order.row[v] != INCODE_NONE) {
            vertex[order.row[v]] = v;
        }
    }
    if (vertex != NULL) {
        host_tetrahedra_map(tets, vertex);
    } else {
        host_fail_memory(error, "the vertices' numbers");
    }
    free(vertex);
    host_order_free(&order);
    return error->code;
}

static void put_csv(struct host_paper_bench *bench,
                    const struct host_run_result *r, enum incode_index index,
                    double paper_s) {
    const struct host_paper_csv row = {.set = "Uniform",
                                       .machine = "this machine",
                                       .how = "measured",
                                       .strategy = "sequential",
                                       .partition = "adaptive",
                                       .face_rule = "own",
                                       .index = host_indexes[index],
                                       .points = r->points,
                                       .tetrahedra = r->tetrahedra,
                                       .nodes = 1,
                                       .t_min = r->t_min_s,
                                       .t_max = r->t_max_s,
                                       .t_io = r->time_io_s,
                                       .speed_up = 1,
                                       .duplication = 1,
                                       .paper_t_max = paper_s};
    host_paper_csv_row(&bench->print, &row);
}

static int sequential_row(struct host_paper_bench *bench,
                          const struct host_paper_sequential *p,
                          struct host_error *error) {
    static struct host_run_result r;
    static const enum incode_index indexes[] = {INCODE_NAIVE, INCODE_GRID,
                                                INCODE_KD};
    struct host_paper_list list = {0};
    double seconds[3] = {0};
    const struct host_points *points =
        host_paper_set(&bench->runs, "Uniform", p->points, error);
    for (int i = 0; i < 3 && points != NULL && error->code == 0; i++) {
        struct host_tetrahedra tets = {0};
        uint64_t vertices = 0;
        bool last = i == 2;
        if (run(points, "sequential", 1, indexes[i], &tets, &r, error) == 0) {
            seconds[i] = r.t_max_s;
            put_csv(bench, &r, indexes[i],
                    i == 0 ? p->naive_s : p->optimised_s);
        }
        if (last && error->code == 0 &&
            number_vertices(points, &tets, &vertices, error) == 0) {
            (void)host_paper_list(&tets, vertices, &list, error);
        }
        host_tetrahedra_free(&tets);
    }
    if (points == NULL || error->code != 0) {
        return error->code;
    }
    char naive[16] = "-";
    if (p->naive_s > 0) {
        (void)snprintf(naive, sizeof naive, "%.0f", p->naive_s);
    }
    host_paper_note(
        "%6llu %9.3f %9.3f %9.3f %8.0f %9.2f %8.1f %% | %8s %8.0f %6.0f %6.1f",
        (unsigned long long)points->count, seconds[0], seconds[1], seconds[2],
        (double)r.tetrahedra / seconds[2], list.accesses,
        100 * list.seconds / seconds[2], naive, p->optimised_s, p->per_s,
        p->per_mflops);
    return 0;
}

int host_paper_table_1(struct host_paper_bench *bench,
                       struct host_error *error) {
    host_paper_table(&bench->print, "1",
                     "Table 1: the sequential program, naive and optimised; "
                     "measured on this machine | the paper's IBM R6000/340");
    host_paper_note("%6s %9s %9s %9s %8s %9s %10s | %8s %8s %6s %6s", "points",
                    "naive s", "grid s", "kd s", "tps", "accesses", "list",
                    "naive s", "opt. s", "tps", "tpMf");
    for (int i = 0; i < HOST_PAPER_SEQUENTIAL && error->code == 0; i++) {
        host_progress_phase("Table 1", NULL);
        (void)sequential_row(bench, &host_paper_sequential[i], error);
    }
    host_paper_note("Accesses: faces looked at in a search of the active face "
                    "list (the paper: 1.15 to\n1.5 hash accesses, all faces in "
                    "one table; here a vertex's faces share a list);\nlist: "
                    "its searches alone, made once more, of the time with kd "
                    "(the paper: about 10 %%).");
    return error->code;
}

/* --- the model ------------------------------------------------------------ */

static void print_fit(const struct host_calibration *fit) {
    char prices[256] = "";
    size_t used = 0;
    for (int k = 0; k < HOST_BENCH_COUNTS; k++) {
        used += (size_t)snprintf(prices + used, sizeof prices - used,
                                 "%s%s %.3g (%.3g)", k == 0 ? "" : ", ",
                                 host_bench_count_names[k], fit->price[k],
                                 host_bench_prices[k]);
    }
    host_paper_note("Prices fitted to %u runs of sequential here, in ns, and "
                    "in brackets those of the\nmodels: %s;\na message %.1f us, "
                    "a start %.0f us; off by %.0f %% in the root of the mean "
                    "square.",
                    fit->runs, prices, fit->message_us, fit->start_us,
                    100 * fit->error);
}

/* The least of three real runs, and the model's. */
static int hold(struct host_paper_bench *bench,
                const struct host_calibration *fit, const char *set,
                uint64_t points, unsigned nodes, struct host_error *error) {
    static struct host_run_result r;
    double busy = INFINITY, wall = INFINITY;
    const struct host_points *xyz =
        host_paper_set(&bench->runs, set, points, error);
    const struct host_paper_case c = {.set = set,
                                      .points = points,
                                      .strategy = "spatial",
                                      .machine = HOST_PAPER_HERE,
                                      .nodes = nodes};
    for (int i = 0; i < 3 && xyz != NULL && error->code == 0; i++) {
        if (run(xyz, "spatial", nodes, INCODE_KD, NULL, &r, error) == 0) {
            busy = fmin(busy, busiest(&r));
            wall = fmin(wall, r.t_max_s);
        }
    }
    const struct host_paper_result *m =
        xyz == NULL || error->code != 0
            ? NULL
            : host_paper_run(&bench->runs, &c, error);
    if (m != NULL) {
        double modelled = m->busy + 1e-6 * fit->start_us;
        host_paper_note("%-9s %7llu %5u %10.4f %10.4f %7.1f %% %10.4f %10.4f "
                        "%7.1f %%",
                        set, (unsigned long long)xyz->count, nodes, busy,
                        modelled, 100 * (modelled / busy - 1), wall, m->t_max,
                        100 * (m->t_max / wall - 1));
    }
    return error->code;
}

int host_paper_check(struct host_paper_bench *bench, struct host_error *error) {
    static struct host_calibration fit;
    static const struct {
        const char *set;
        uint64_t points;
    } sets[] = {{"Uniform", 10000},
                {"Uniform", 20000},
                {"Bubbles", 20000},
                {"Blunt Fin", 10240}};
    struct host_bench_machine *here = &bench->runs.machine[HOST_PAPER_HERE];
    host_paper_table(&bench->print, "check",
                     "The model against real runs of spatial on this machine");
    host_progress_phase("fitting the model", NULL);
    if (host_calibrate(bench->runs.quick, &fit, error) != 0) {
        return error->code;
    }
    here->price = fit.price;
    here->message_us = fit.message_us;
    print_fit(&fit);
    host_paper_note("%-9s %7s %5s %10s %10s %9s %10s %10s %9s", "set", "points",
                    "nodes", "cpu s", "modelled", "error", "t_max s",
                    "modelled", "error");
    for (size_t i = 0; i < sizeof sets / sizeof sets[0]; i++) {
        for (unsigned nodes = 1; nodes <= 2 && error->code == 0; nodes *= 2) {
            (void)hold(bench, &fit, sets[i].set, sets[i].points, nodes, error);
        }
    }
    host_paper_note("cpu: processor time of the busiest node; t_max is by the "
                    "clock, while host and\nnodes share the processors of this "
                    "machine.");
    return error->code;
}
