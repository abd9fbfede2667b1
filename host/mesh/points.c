#include "points.h"

#include <string.h>

#include "host/base/memory.h"
#include "host/base/progress.h"

enum { ROWS_SHOWN = 1 << 14 }; /* a clock a point would cost too much */

int host_points_append(struct host_points *points, const double *xyz,
                       uint64_t rows, struct host_error *error)
{
    const size_t row = 3 * sizeof *points->xyz;
    if (points->count + rows >= UINT32_MAX) {
        return host_fail(error, HOST_INPUT,
                         "host: more points than row numbers of 32 bits "
                         "allow; split the input");
    }
    if (points->capacity - points->count < rows) {
        uint64_t capacity = points->capacity * 3 / 2 + rows + 1024;
        void *grown =
            host_remap(points->xyz, points->capacity * row, capacity * row);
        if (grown == NULL) {
            return host_fail_memory(error, "the points");
        }
        points->xyz = grown;
        points->capacity = capacity;
    }
    memcpy(points->xyz + 3 * points->count, xyz, rows * row);
    if ((points->count + rows) / ROWS_SHOWN != points->count / ROWS_SHOWN) {
        host_progress_show(0, 0, points->count + rows);
    }
    points->count += rows;
    return 0;
}

void host_points_free(struct host_points *points)
{
    host_unmap(points->xyz, points->capacity * 3 * sizeof *points->xyz);
    *points = (struct host_points){0};
}
