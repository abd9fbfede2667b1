/* incode_stream: points and tetrahedra through callbacks, in the run of
 * delaunay.h with a sink, and what is beyond the limit put aside (scratch.h).
 */
#include <math.h>
#include <string.h>

#include "call.h"
#include "delaunay.h"
#include "host/base/memory.h"
#include "host/base/scratch.h"
#include "host/mesh/duplicates.h"
#include "host/mesh/points.h"

enum {
    RESIDENT_MIN = 16 << 20, /* a thread */
    ROWS = 4096,             /* that a callback gives or takes at a time */
    THREADS_USEFUL = 1 << 16 /* as the number of points is not known */
};

/* What is large of a call, and not of its thread's stack. */
struct state {
    struct host_scratch scratch;
    struct host_direct_sums sums;
    double xyz[3 * ROWS];
    uint32_t duplicate[ROWS][2];
};

/* One call. */
struct stream {
    struct library_call call;
    const struct incode_callbacks *theirs;
    uint64_t resident_max; /* 0: no limit */
    struct incode_totals *out;
    struct state *state;
    struct host_points points;
    struct host_order order;
    struct host_error error;
    _Atomic uint32_t bricks; /* that there are, once it is known */
};

static enum incode_status cancel(struct stream *s) {
    s->call.host.cancelled = true;
    return INCODE_CANCELLED;
}

/* --- points --------------------------------------------------------------- */

static enum incode_status take(struct stream *s, const double *xyz,
                               size_t count) {
    double sum = 0; /* of zeros, or NaN */
    for (size_t i = 0; i < 3 * count; i++)
        sum += xyz[i] * 0.0;
    for (size_t i = 0; i < 3 * count && sum != 0; i++)
        if (!isfinite(xyz[i])) {
            s->out->at = s->points.count + i / 3;
            return INCODE_NOT_FINITE;
        }
    if (s->points.count + count >= UINT32_MAX)
        return INCODE_TOO_MANY;
    return host_points_append(&s->points, xyz, count, &s->error) == 0
               ? INCODE_OK
               : INCODE_NO_MEMORY;
}

static enum incode_status read_points(struct stream *s) {
    enum incode_status status = INCODE_OK;
    double *xyz = s->state->xyz;
    while (status == INCODE_OK && !host_call_cancelled()) {
        size_t count = 0;
        if (!s->theirs->points(s->theirs->context, xyz, ROWS, &count))
            return cancel(s);
        if (count == 0)
            return INCODE_OK;
        if (count > ROWS)
            return INCODE_BAD_ARGUMENT;
        status = take(s, xyz, count);
    }
    return status;
}

static enum incode_status give_duplicates(struct stream *s) {
    size_t bytes = (size_t)s->points.count * sizeof(uint32_t), n = 0;
    uint32_t(*pair)[2] = s->state->duplicate;
    if (s->theirs->duplicates == NULL || s->order.duplicates == 0)
        return INCODE_OK;
    uint32_t *lowest = host_map(bytes);
    enum incode_status status =
        lowest != NULL &&
                host_distinct_rows(s->points.xyz, s->points.count, lowest) != 0
            ? INCODE_OK
            : INCODE_NO_MEMORY;
    for (uint64_t row = 0;
         row < s->points.count && status == INCODE_OK && !host_call_cancelled();
         row++) {
        if (row % ROWS == 0)
            host_call_trim(ROWS * sizeof *lowest);
        if (lowest[row] != row) {
            pair[n][0] = (uint32_t)row;
            pair[n++][1] = lowest[row];
        }
        if (n == ROWS || (n > 0 && row + 1 == s->points.count)) {
            if (!s->theirs->duplicates(s->theirs->context,
                                       (const uint32_t(*)[2])pair, n))
                status = cancel(s);
            n = 0;
        }
    }
    host_unmap(lowest, bytes);
    return status;
}

/* --- tetrahedra ----------------------------------------------------------- */

static void put(void *context, const uint32_t (*v)[4], uint64_t count) {
    struct stream *s = context;
    if (s->theirs->tetrahedra(s->theirs->context, v, (size_t)count))
        s->out->count += count;
    else
        (void)cancel(s);
}

static enum incode_status triangulate(struct stream *s) {
    struct host_tetrahedra none = {0};
    enum incode_status status = read_points(s);
    s->call.host.phases = 1;
    if (status == INCODE_OK && !host_call_cancelled())
        status =
            library_order(&s->order, s->points.xyz, s->points.count, &s->error);
    if (status == INCODE_OK && !host_call_cancelled())
        status = give_duplicates(s);
    s->out->points = s->points.count;
    s->out->duplicate_count = s->order.duplicates;
    host_points_free(&s->points);
    s->bricks = s->order.bricks;
    s->call.host.phases = 2;
    if (status != INCODE_OK || host_call_cancelled())
        return status;
    s->state->sums.sink = (struct host_sink){put, s, PTHREAD_MUTEX_INITIALIZER};
    status = library_direct(
        host_direct_run(&s->order, &none, &s->state->sums, &s->error));
    s->call.host.phases = 3;
    host_tetrahedra_free(&none);
    return status;
}

/* --- all together --------------------------------------------------------- */

static enum incode_status begin(struct stream *s) {
    struct host_call *host = &s->call.host;
    uint64_t most = s->resident_max / RESIDENT_MIN;
    const char *folder =
        s->theirs->scratch == NULL ? "/tmp" : s->theirs->scratch;
    host->memory_max = UINT64_MAX;
    if (s->resident_max > 0 && most == 0)
        return INCODE_NO_MEMORY;
    s->state = host_map(sizeof *s->state);
    if (s->state == NULL)
        return INCODE_NO_MEMORY;
    if (s->resident_max == 0)
        return INCODE_OK;
    host->threads = most < host->threads ? (unsigned)most : host->threads;
    if (host_scratch_begin_own(&s->state->scratch, folder, s->resident_max,
                               host->threads, &s->error) != 0) {
        s->out->error = s->state->scratch.failure;
        return INCODE_IO;
    }
    host->scratch = &s->state->scratch;
    return INCODE_OK;
}

static void end(struct stream *s) {
    struct host_scratch *scratch = s->call.host.scratch;
    if (scratch != NULL) {
        s->out->scratch_max = scratch->bytes_max;
        s->call.host.scratch = NULL;
        host_scratch_end(scratch);
    }
    host_unmap(s->state, sizeof *s->state);
}

static enum incode_status work(struct library_call *call) {
    struct stream *s = (struct stream *)call;
    enum incode_status status = begin(s);
    if (status == INCODE_OK)
        status = triangulate(s);
    host_order_free(&s->order);
    if (call->host.cancelled)
        status = INCODE_CANCELLED;
    if (status == INCODE_NO_MEMORY && call->host.scratch != NULL &&
        call->host.scratch->failure != 0) {
        s->out->error = call->host.scratch->failure;
        status = INCODE_IO;
    }
    end(s);
    return status;
}

/* Of the work, as a part of 1.  How many points there are is not known before
 * all have come. */
static double done(struct library_call *call) {
    static const double before[] = {0, 0.05, 0.15, 1};
    const struct stream *s = (const struct stream *)call;
    unsigned phase = call->host.phases;
    double part = before[phase < 3 ? phase : 3];
    if (phase == 2)
        part +=
            0.8 * fmin(1, (double)call->host.bricks / ((double)s->bricks + 1));
    return part;
}

enum incode_status incode_stream(const struct incode_callbacks *callbacks,
                                 const struct incode_options *options,
                                 struct incode_totals *out) {
    struct incode_totals unwanted;
    out = out == NULL ? &unwanted : out;
    *out = (struct incode_totals){0};
    if (callbacks == NULL || callbacks->points == NULL ||
        callbacks->tetrahedra == NULL || !library_options(&options, 0))
        return INCODE_BAD_ARGUMENT;
    for (unsigned i = 0; i < 4; i++)
        if (callbacks->reserved[i] != NULL)
            return INCODE_BAD_ARGUMENT;
    struct stream s = {.call = {.work = work, .done = done},
                       .theirs = callbacks,
                       .resident_max = options->memory_max,
                       .out = out};
    return library_call(&s.call, options, THREADS_USEFUL);
}
