#include "bench_scaling.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench_set.h"
#include "bench_trial.h"
#include "gnuplot.h"
#include "host/base/create.h"
#include "host/base/progress.h"
#include "host/mesh/gen.h"
#include "host/service/strategies/strategies.h"
#include "scaling_rows.h"
#include "virtual_run.h"

enum {
    LIMIT_S = 3600,
    RUNS_MAX = 5,
    RUNS_POINTS = 300000, /* of all runs of a row, if there are more than one */
    NODES_POINTS = 100000,
    QUICK = 10, /* so many times fewer points for the nodes */
    QUICK_POINTS = 30000
};

static const uint64_t sizes[] = {1000,   3000,    10000,   30000,   100000,
                                 300000, 1000000, 3000000, 10000000};
enum { SIZES = sizeof sizes / sizeof sizes[0] };

/* --- points --------------------------------------------------------------- */

static double least(double before, double now, bool first) {
    return first || now < before ? now : before;
}

static int run_once(const struct host_bench_set *set,
                    struct host_scaling_point *row, struct host_error *error) {
    const char *const words[] = {
        "/proc/self/exe", "run", set->path,    "--format",   "npy",     "-q",
        "--stats",        "-",   "--strategy", "sequential", "--nodes", "1",
        "--memory",       "4M",  NULL};
    struct host_trial trial;
    if (host_trial_run((char *const *)words, LIMIT_S, &trial, error) != 0) {
        return error->code;
    }
    if (trial.late || trial.status != 0 || trial.tetrahedra == 0) {
        return host_fail(error, HOST_BROKEN,
                         "bench scaling: %llu points ended with status %d: "
                         "%s; run that alone",
                         (unsigned long long)set->points, trial.status,
                         trial.said);
    }
    bool first = row->runs++ == 0;
    row->tetrahedra = trial.tetrahedra;
    row->node_s = least(row->node_s, trial.cpu_s, first);
    row->host_s = least(row->host_s, trial.host_all_s, first);
    row->wall_s = least(row->wall_s, trial.wall_s, first);
    return 0;
}

static int measure_points(struct host_scaling_rows *rows, uint64_t points,
                          struct host_error *error) {
    struct host_bench_set set;
    struct host_scaling_point row = {.points = points};
    uint64_t fits = RUNS_POINTS / points;
    unsigned runs = fits < 1 ? 1 : fits < RUNS_MAX ? (unsigned)fits : RUNS_MAX;
    char phase[48];
    (void)snprintf(phase, sizeof phase, "%llu points",
                   (unsigned long long)points);
    host_progress_phase(phase, NULL);
    int status = host_bench_set_made(&set, "uniform", points, error);
    for (unsigned i = 0; i < runs && status == 0; i++) {
        status = run_once(&set, &row, error);
    }
    host_bench_set_free(&set);
    if (status == 0) {
        host_scaling_points_row(rows, &row);
    }
    return status;
}

/* --- nodes ---------------------------------------------------------------- */

static int model_nodes(struct host_scaling_rows *rows,
                       const struct host_points *points, const char *strategy,
                       unsigned nodes, struct host_error *error) {
    static struct host_virtual_run run;
    struct host_run_options options;
    char phase[48];
    host_run_defaults(&options);
    options.strategy = host_strategy_named(strategy);
    options.nodes = nodes;
    options.build = INCODE_BUILD_FACES; /* to which the prices are fitted */
    options.quiet = true;
    run = (struct host_virtual_run){.machine = &host_bench_here,
                                    .options = &options};
    (void)snprintf(phase, sizeof phase, "%s, %u nodes", strategy, nodes);
    host_progress_phase(phase, NULL);
    if (host_virtual_run(&run, points, error) != 0) {
        return error->code;
    }
    const struct host_run_result *r = &run.result;
    struct host_scaling_node row = {.strategy = strategy,
                                    .nodes = nodes,
                                    .points = r->points,
                                    .tetrahedra = r->tetrahedra};
    row.wire_bytes = (double)(r->bytes_sent + r->bytes_received);
    for (unsigned i = 0; i < nodes; i++) {
        double busy_s = 1e-6 * (double)r->node[i].statistics.busy_us;
        row.all_s += busy_s;
        row.busiest_s = busy_s > row.busiest_s ? busy_s : row.busiest_s;
    }
    host_scaling_nodes_row(rows, &row);
    return 0;
}

static int model_all(struct host_scaling_rows *rows, unsigned nodes_max,
                     uint64_t count, struct host_error *error) {
    struct host_points points = {0};
    int status = host_gen("uniform", count, 1, &points, error);
    host_scaling_nodes_head(count);
    for (unsigned n = 1; n <= nodes_max && status == 0; n *= 2) {
        for (int i = 0; i < HOST_SCALING_STRATEGIES && status == 0; i++) {
            status = model_nodes(rows, &points, host_scaling_strategies[i], n,
                                 error);
        }
    }
    host_points_free(&points);
    return status;
}

/* --- all ------------------------------------------------------------------ */

static int print_all(const struct host_scaling_options *o,
                     struct host_scaling_rows *rows, struct host_error *error) {
    int status = 0;
    host_scaling_points_head(rows);
    for (int i = 0; i < SIZES && status == 0; i++) {
        if (!o->quick || sizes[i] <= QUICK_POINTS) {
            status = measure_points(rows, sizes[i], error);
        }
    }
    if (status == 0) {
        status =
            model_all(rows, o->nodes_max,
                      o->quick ? NODES_POINTS / QUICK : NODES_POINTS, error);
    }
    host_progress_erase();
    if (status == 0 && o->svg != NULL &&
        host_scaling_draw(rows, o->svg, error) == 0) {
        printf("\nDrawn in %s.\n", o->svg);
    }
    return error->code;
}

int host_bench_scaling(const struct host_scaling_options *options,
                       struct host_error *error) {
    const struct host_scaling_options *o = options;
    if (o->svg != NULL && host_gnuplot_there(o->svg, error) != 0) {
        return error->code;
    }
    struct host_scaling_rows *rows = calloc(1, sizeof *rows);
    if (rows == NULL) {
        return host_fail_memory(error, "the rows");
    }
    if (o->csv != NULL && (rows->csv = host_create_over(o->csv)) == NULL) {
        host_fail(error, HOST_INPUT, "%s: %s; choose another file", o->csv,
                  strerror(errno));
    } else {
        host_progress_begin(true);
        (void)print_all(o, rows, error);
        host_progress_end();
    }
    if (rows->csv != NULL) {
        bool well = ferror(rows->csv) == 0;
        if ((fclose(rows->csv) != 0 || !well) && error->code == 0) {
            host_fail(error, HOST_BROKEN, "%s: %s; choose another place",
                      o->csv, strerror(errno));
        }
    }
    free(rows);
    return error->code;
}
