/* The points of a run as the user gave them, read from a file of any format
 * that the host knows, in input order.
 *
 * Memory: 24 bytes a point, and the file itself while it is read.  Work: one
 * pass over the file, 40 ns a number of text at most.
 *
 *     struct host_points points = {0};
 *     if (host_points_read("bunny.ply", &points, &error) != 0) ...
 *     host_points_free(&points);
 */
#ifndef HOST_POINTS_H
#define HOST_POINTS_H

#include <stddef.h>
#include <stdint.h>

#include "host/base/error.h"

/* Rows 0 to count-1: xyz[3 * row + dimension], every value finite. */
struct host_points {
    double *xyz;
    uint64_t count;
    uint64_t capacity; /* rows that xyz has room for */
    uint32_t base;     /* number of row 0 in the input: 0, or 1 in a .node */
};

/* Reads by extension (.gz through zlib; "-" is .xyz from standard input).  0 or
 * error->code; *points is empty after an error. */
int host_points_read(const char *path, struct host_points *points,
                     struct host_error *error);

/* The same from memory; `path` gives the extension and the name in errors. */
int host_points_parse(const char *path, const void *data, size_t bytes,
                      struct host_points *points, struct host_error *error);

/* Appends rows; HOST_BROKEN without memory, HOST_INPUT past 2^32 - 2 rows. */
int host_points_append(struct host_points *points, const double *xyz,
                       uint64_t rows, struct host_error *error);

/* Writes by extension (.xyz .txt .csv .node .ply .off .npy .vtk .vtu .vtp; "-"
 * is .xyz on standard output), so that reading gives the same doubles.  The
 * file has its name when host_output_commit gives it. */
int host_points_write(const char *path, const struct host_points *points,
                      struct host_error *error);

void host_points_free(struct host_points *points);

#endif
