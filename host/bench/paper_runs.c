#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "paper.h"
#include "host/base/progress.h"
#include "host/formats/read.h"
#include "host/mesh/gen.h"
#include "host/service/strategies/strategies.h"
#include "bench_links.h"
#include "host/mesh/points.h"
#include "host/base/error.h"
#include "incode/front/afl.h"
#include "incode/pages/bricks.h"

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
    if (strcmp(set, "Blunt Fin") == 0)
        return make_fin(runs, xyz, error);
    return host_gen(strcmp(set, "Bubbles") == 0 ? "bubbles" : "uniform", n, 1,
                    xyz, error);
}

/* A set by its name; NULL: error tells. */
static const struct host_points *host_paper_set(struct host_paper_runs *runs,
                                                const char *set,
                                                uint64_t points,
                                                struct host_error *error) {
    for (unsigned i = 0; i < runs->sets; i++)
        if (strcmp(runs->set[i].set, set) == 0 && runs->set[i].points == points)
            return &runs->set[i].xyz;
    if (runs->sets == HOST_PAPER_SETS) {
        host_fail(error, HOST_BROKEN, "bench paper: more sets than %d",
                  HOST_PAPER_SETS);
        return NULL;
    }
    struct host_points *xyz = &runs->set[runs->sets].xyz;
    if (make_set(runs, set, points, xyz, error) != 0)
        return NULL;
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
    if (points == NULL)
        return error->code;
    configure(c, &options);
    run.machine = &runs->machine[c->machine];
    run.options = &options;
    show(c);
    if (host_virtual_run(&run, points, error) != 0)
        return error->code;
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
    for (unsigned i = 0; i < runs->results; i++)
        if (same(&runs->result[i].c, c))
            return &runs->result[i];
    struct host_paper_result *result = &runs->result[runs->results];
    if (runs->results == HOST_PAPER_RUNS_MAX) {
        host_fail(error, HOST_BROKEN, "bench paper: more runs than %d",
                  HOST_PAPER_RUNS_MAX);
        return NULL;
    }
    if (make_run(runs, c, result, error) != 0)
        return NULL;
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
        if (r != NULL)
            machine->scale = machine->work_s * 1e9 / r->work_ns;
        host_paper_runs_end(&whole);
    }
    return error->code;
}

int host_paper_runs_begin(struct host_paper_runs *runs,
                          struct host_error *error) {
    runs->machine[HOST_PAPER_NCUBE] = host_bench_ncube;
    runs->machine[HOST_PAPER_WORKSTATIONS] = host_bench_workstations;
    runs->machine[HOST_PAPER_HERE] = host_bench_here;
    for (int i = 0; i < HOST_PAPER_MACHINES && error->code == 0; i++)
        if (runs->machine[i].work_s > 0)
            (void)find_scale(&runs->machine[i], error);
    return error->code;
}

void host_paper_runs_end(struct host_paper_runs *runs) {
    for (unsigned i = 0; i < runs->sets; i++)
        host_points_free(&runs->set[i].xyz);
    runs->sets = runs->results = 0;
}

/* --- paper sequential ----------------------------------------------------- */

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

/* --- Table 1 -------------------------------------------------------------- */

/* Rows of points become vertex numbers, as the nodes count them. */
static int number_vertices(const struct host_points *points,
                           struct host_tetrahedra *tets, uint64_t *vertices,
                           struct host_error *error) {
    struct host_order order = {0};
    if (host_order_make(&order, "points", points->xyz, points->count,
                        HOST_ADAPTIVE, 1, false, error) != 0)
        return error->code;
    uint32_t *vertex = calloc(points->count, sizeof *vertex);
    *vertices = (uint64_t)order.bricks * INCODE_BRICK_POINTS;
    for (uint32_t v = 0; vertex != NULL && v < *vertices; v++)
        if (order.row[v] != INCODE_NONE)
            vertex[order.row[v]] = v;
    if (vertex != NULL)
        host_tetrahedra_map(tets, vertex);
    else
        host_fail_memory(error, "the vertices' numbers");
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
            number_vertices(points, &tets, &vertices, error) == 0)
            (void)host_paper_list(&tets, vertices, &list, error);
        host_tetrahedra_free(&tets);
    }
    if (points == NULL || error->code != 0)
        return error->code;
    char naive[16] = "-";
    if (p->naive_s > 0)
        (void)snprintf(naive, sizeof naive, "%.0f", p->naive_s);
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

static int host_calibrate(bool quick, struct host_calibration *fit,
                          struct host_error *error);

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
    if (host_calibrate(bench->runs.quick, &fit, error) != 0)
        return error->code;
    here->price = fit.price;
    here->message_us = fit.message_us;
    print_fit(&fit);
    host_paper_note("%-9s %7s %5s %10s %10s %9s %10s %10s %9s", "set", "points",
                    "nodes", "cpu s", "modelled", "error", "t_max s",
                    "modelled", "error");
    for (size_t i = 0; i < sizeof sets / sizeof sets[0]; i++)
        for (unsigned nodes = 1; nodes <= 2 && error->code == 0; nodes *= 2)
            (void)hold(bench, &fit, sets[i].set, sets[i].points, nodes, error);
    host_paper_note("cpu: processor time of the busiest node; "
                    "t_max is by the "
                    "clock, while host and\nnodes share the processors of this "
                    "machine.");
    return error->code;
}

/* --- paper list ----------------------------------------------------------- */

enum { TIMES = 3 };

/* The faces of a tetrahedron of positive orientation, seen from outside. */
static const uint8_t faces[4][3] = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};

/* In the list of its lowest vertex, turned until that comes first. */
static void toggle(struct incode_afl *afl, const uint32_t v[4],
                   const uint8_t face[3]) {
    uint32_t f[3] = {v[face[0]], v[face[1]], v[face[2]]};
    unsigned first =
        f[0] < f[1] ? (f[0] < f[2] ? 0 : 2) : (f[1] < f[2] ? 1 : 2);
    incode_afl_toggle(afl, f[first], f[(first + 1) % 3], f[(first + 2) % 3]);
}

int host_paper_list(const struct host_tetrahedra *tets, uint64_t vertices,
                    struct host_paper_list *list, struct host_error *error) {
    struct incode_afl afl;
    uint32_t capacity = (uint32_t)(2 * tets->count + 4);
    uint32_t bricks = (uint32_t)(vertices / INCODE_BRICK_POINTS + 1);
    void *memory = malloc(incode_afl_bytes(capacity, bricks));
    if (memory == NULL)
        return host_fail_memory(error, "the active face list");
    list->seconds = INFINITY;
    for (int times = 0; times < TIMES; times++) {
        incode_afl_init(&afl, memory, capacity, bricks, NULL);
        uint64_t start = host_now_us();
        for (uint64_t i = 0; i < tets->count; i++)
            for (int k = 0; k < 4; k++)
                toggle(&afl, tets->v[i], faces[k]);
        list->seconds =
            fmin(list->seconds, 1e-6 * (double)(host_now_us() - start));
    }
    list->searches = afl.searches;
    list->accesses = (double)afl.looks / (double)afl.searches;
    list->longest = afl.count_max;
    free(memory);
    return 0;
}

/* --- calibrate ------------------------------------------------------------ */

enum { ROUNDS = 20000, CALIBRATE_TIMES = 9 };

static const struct {
    const char *kind;
    uint64_t n, memory;
} sets[HOST_CALIBRATE_RUNS] = {
    {"uniform", 200, 4 << 20},   {"uniform", 5000, 4 << 20},
    {"uniform", 20000, 4 << 20}, {"uniform", 20000, 512 << 10},
    {"bubbles", 20000, 4 << 20}, {"bluntfin", 10240, 4 << 20},
    {"grid", 8000, 4 << 20},     {"terrain", 10000, 4 << 20},
};

/* Messages of a node that has told so much, as near as its bytes say. */
static double
host_calibrate_messages(const struct node_finished_message *totals) {
    return (double)(totals->bytes_in + totals->bytes_out) / CUBE_PAYLOAD_MAX;
}

/* Coordinate by coordinate: the sum is convex. */
void host_calibrate_fit(const double (*a)[HOST_CALIBRATE_TERMS], unsigned rows,
                        double x[HOST_CALIBRATE_TERMS]) {
    double left[HOST_CALIBRATE_RUNS];
    for (unsigned i = 0; i < rows; i++)
        left[i] = 1;
    memset(x, 0, HOST_CALIBRATE_TERMS * sizeof *x);
    for (unsigned round = 0; round < ROUNDS; round++) {
        for (int k = 0; k < HOST_CALIBRATE_TERMS; k++) {
            double along = 0, square = 0;
            for (unsigned i = 0; i < rows; i++) {
                along += a[i][k] * left[i];
                square += a[i][k] * a[i][k];
            }
            double step = square > 0 ? fmax(along / square, -x[k]) : 0;
            x[k] += step;
            for (unsigned i = 0; i < rows; i++)
                left[i] -= step * a[i][k];
        }
    }
}

/* The run that took least: its counts, each over the time in nanoseconds. */
static int measure(unsigned set, unsigned times,
                   double row[HOST_CALIBRATE_TERMS], struct host_error *error) {
    static struct host_run_result result;
    struct host_run_options o;
    struct host_points points = {0};
    double least = INFINITY;
    host_run_defaults(&o);
    o.strategy = host_strategy_named("sequential");
    o.build = INCODE_BUILD_FACES;
    o.nodes = 1;
    o.memory = sets[set].memory;
    o.quiet = true;
    int status = host_gen(sets[set].kind, sets[set].n, 1, &points, error);
    for (unsigned i = 0; i < times && status == 0; i++) {
        struct host_tetrahedra tets = {0};
        memset(&result, 0, sizeof result);
        status = host_triangulate(&o, &points, &tets, &result, error);
        host_tetrahedra_free(&tets);
        const struct node_finished_message *f = &result.node[0].statistics;
        double ns = 1e3 * (double)f->busy_us;
        if (status != 0 || ns >= least)
            continue;
        least = ns;
        host_bench_counts(f, row);
        row[HOST_CALIBRATE_MESSAGE] = host_calibrate_messages(f);
        row[HOST_CALIBRATE_START] = 1;
        for (int k = 0; k < HOST_CALIBRATE_TERMS; k++)
            row[k] /= ns;
    }
    host_points_free(&points);
    return status;
}

/* A tetrahedron's price is divided as model.h says: calls and tetrahedra come
 * in nearly the same numbers, so that no fit tells them apart. */
static void divide(struct host_calibration *fit) {
    double both = fit->price[HOST_BENCH_CALLS] + fit->price[HOST_BENCH_BUILT];
    fit->price[HOST_BENCH_BUILT] = host_bench_list_share * both;
    fit->price[HOST_BENCH_CALLS] = both - fit->price[HOST_BENCH_BUILT];
}

/* quick: each run once, and not the least of nine.  0, or what a run ends
 * with. */
static int host_calibrate(bool quick, struct host_calibration *fit,
                          struct host_error *error) {
    double a[HOST_CALIBRATE_RUNS][HOST_CALIBRATE_TERMS];
    double x[HOST_CALIBRATE_TERMS], square = 0;
    for (unsigned i = 0; i < HOST_CALIBRATE_RUNS; i++)
        if (measure(i, quick ? 1 : CALIBRATE_TIMES, a[i], error) != 0)
            return error->code;
    host_calibrate_fit(a, HOST_CALIBRATE_RUNS, x);
    for (unsigned i = 0; i < HOST_CALIBRATE_RUNS; i++) {
        double off = -1;
        for (int k = 0; k < HOST_CALIBRATE_TERMS; k++)
            off += a[i][k] * x[k];
        square += off * off;
    }
    memcpy(fit->price, x, sizeof fit->price);
    divide(fit);
    fit->message_us = 1e-3 * x[HOST_CALIBRATE_MESSAGE];
    fit->start_us = 1e-3 * x[HOST_CALIBRATE_START];
    fit->error = sqrt(square / HOST_CALIBRATE_RUNS);
    fit->runs = HOST_CALIBRATE_RUNS;
    return 0;
}
