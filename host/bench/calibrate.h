/* The model's prices on this machine: real runs of `sequential` on one node,
 * and the prices of model.h, none of them negative, that make the sum of
 * squares of the relative errors of the node's processor time least.
 *
 * Memory: a run of 20,000 points.  Work: a second or two.
 *
 *     struct host_calibration fit;
 *     if (host_calibrate(false, &fit, &error) != 0)
 *         return error.code;
 *     double us = fit.message_us;
 */
#ifndef HOST_BENCH_CALIBRATE_H
#define HOST_BENCH_CALIBRATE_H

#include "host/run/run.h"
#include "model.h"

enum {
    HOST_CALIBRATE_RUNS = 8,
    /* After the counts: messages, and the start of a node's program. */
    HOST_CALIBRATE_MESSAGE = HOST_BENCH_COUNTS,
    HOST_CALIBRATE_START,
    HOST_CALIBRATE_TERMS
};

struct host_calibration {
    double price[HOST_BENCH_COUNTS]; /* nanoseconds */
    double message_us, start_us;
    double error; /* root of the mean square of the relative errors */
    unsigned runs;
};

/* quick: each run once, and not the least of nine.  0, or what a run ends
 * with. */
int host_calibrate(bool quick, struct host_calibration *fit,
                   struct host_error *error);

/* The x >= 0 for which the sum over rows of (sum of a[row][k] x[k] - 1)^2 is
 * least. */
void host_calibrate_fit(const double (*a)[HOST_CALIBRATE_TERMS], unsigned rows,
                        double x[HOST_CALIBRATE_TERMS]);

/* Messages of a node that has told so much, as near as its bytes say. */
double host_calibrate_messages(const struct node_finished_message *totals);

#endif
