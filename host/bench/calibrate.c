#include "calibrate.h"

#include <math.h>
#include <string.h>

#include "host/mesh/gen.h"
#include "host/service/strategies/strategies.h"

enum { ROUNDS = 20000, TIMES = 9 };

static const struct {
    const char *kind;
    uint64_t n, memory;
} sets[HOST_CALIBRATE_RUNS] = {
    {"uniform", 200, 4 << 20},   {"uniform", 5000, 4 << 20},
    {"uniform", 20000, 4 << 20}, {"uniform", 20000, 512 << 10},
    {"bubbles", 20000, 4 << 20}, {"bluntfin", 10240, 4 << 20},
    {"grid", 8000, 4 << 20},     {"terrain", 10000, 4 << 20},
};

double host_calibrate_messages(const struct node_finished_message *totals) {
    return (double)(totals->bytes_in + totals->bytes_out) / CUBE_PAYLOAD_MAX;
}

/* Coordinate by coordinate: the sum is convex. */
void host_calibrate_fit(const double (*a)[HOST_CALIBRATE_TERMS], unsigned rows,
                        double x[HOST_CALIBRATE_TERMS]) {
    double left[HOST_CALIBRATE_RUNS];
    for (unsigned i = 0; i < rows; i++) {
        left[i] = 1;
    }
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
            for (unsigned i = 0; i < rows; i++) {
                left[i] -= step * a[i][k];
            }
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
        if (status != 0 || ns >= least) {
            continue;
        }
        least = ns;
        host_bench_counts(f, row);
        row[HOST_CALIBRATE_MESSAGE] = host_calibrate_messages(f);
        row[HOST_CALIBRATE_START] = 1;
        for (int k = 0; k < HOST_CALIBRATE_TERMS; k++) {
            row[k] /= ns;
        }
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

int host_calibrate(bool quick, struct host_calibration *fit,
                   struct host_error *error) {
    double a[HOST_CALIBRATE_RUNS][HOST_CALIBRATE_TERMS];
    double x[HOST_CALIBRATE_TERMS], square = 0;
    for (unsigned i = 0; i < HOST_CALIBRATE_RUNS; i++) {
        if (measure(i, quick ? 1 : TIMES, a[i], error) != 0) {
            return error->code;
        }
    }
    host_calibrate_fit(a, HOST_CALIBRATE_RUNS, x);
    for (unsigned i = 0; i < HOST_CALIBRATE_RUNS; i++) {
        double off = -1;
        for (int k = 0; k < HOST_CALIBRATE_TERMS; k++) {
            off += a[i][k] * x[k];
        }
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
