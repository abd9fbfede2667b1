#include "points.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/base/progress.h"
#include "incode/triangulator.h"
#include "order.h"

enum { ROWS_SHOWN = 1 << 14 }; /* a clock a point would cost too much */

/* READ_BYTES: with what a row was read from. */
enum { ROW_BYTES = 3 * sizeof(double), READ_BYTES = 128 };

/* Makes room for `rows` more, by half of what there is; where that is much, not
 * beyond the memory that is available, which the kernel would give and then end
 * the program for; a file is reserved whole. */
static int grow(struct host_points *points, uint64_t rows,
                struct host_error *error) {
    const uint64_t much = ((uint64_t)64 << 20) / ROW_BYTES;
    uint64_t more = points->capacity / 2 + rows + 1024;
    const struct host_call *call = host_call();
    bool aside = call != NULL && call->scratch != NULL;
    void *grown = NULL;
    if (more > much && !aside) {
        uint64_t room = host_memory_available() / ROW_BYTES;
        more = room <= much ? 0 : room < more ? room : more;
    }
    uint64_t capacity = points->capacity + more;
    if (more >= rows) {
        grown = host_remap(points->xyz, points->capacity * ROW_BYTES,
                           capacity * ROW_BYTES);
    }
    if (grown == NULL && aside)
        return host_fail_memory(error, "the points");
    if (grown == NULL) {
        return host_fail(error, HOST_INPUT,
                         "host: more than %llu points are no longer held by "
                         "the memory available; free some memory or take a "
                         "machine with more",
                         (unsigned long long)points->count);
    }
    points->xyz = grown;
    points->capacity = capacity;
    return 0;
}

int host_points_append(struct host_points *points, const double *xyz,
                       uint64_t rows, struct host_error *error) {
    if (points->count + rows >= UINT32_MAX) {
        return host_fail(error, HOST_INPUT,
                         "host: more points than row numbers of 32 bits "
                         "allow; split the input");
    }
    if (points->capacity - points->count < rows &&
        grow(points, rows, error) != 0)
        return error->code;
    memcpy(points->xyz + 3 * points->count, xyz, rows * ROW_BYTES);
    host_call_trim(rows * READ_BYTES);
    points->count += rows;
    return 0;
}

void host_points_free(struct host_points *points) {
    host_unmap(points->xyz, points->capacity * ROW_BYTES);
    *points = (struct host_points){0};
}

/* --- names ---------------------------------------------------------------- */

const char *const host_partitions[] = {
    [HOST_ADAPTIVE] = "adaptive", [HOST_UNIFORM] = "uniform", NULL};
const char *const host_indexes[] = {
    [INCODE_NAIVE] = "naive", [INCODE_GRID] = "grid", [INCODE_KD] = "kd", NULL};
const char *const host_face_rules[] = {
    [INCODE_FACE_OWN] = "own", [INCODE_FACE_PAPER] = "paper", NULL};
const char *const host_builds[] = {[INCODE_BUILD_AUTO] = "auto",
                                   [INCODE_BUILD_FACES] = "faces",
                                   [INCODE_BUILD_POINTS] = "points",
                                   NULL};
