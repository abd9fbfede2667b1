/* Points and tetrahedra out to files, in the format that the extension says.
 * A file has its name when host_output_commit gives it.
 *
 * Memory: 1 MiB of buffer a file; for .neigh and .face also 8 bytes a
 * tetrahedron and 8 a point.  Work: one pass, about 100 ns a tetrahedron as
 * text.
 *
 *     host_tetrahedra_map(&tets, order.row);
 *     host_tetrahedra_sort(&tets);
 *     if (host_write("out.vtu", NULL, &points, &tets, &error) != 0)
 *         return error.code;
 *     return host_output_commit(&error);
 */
#ifndef HOST_WRITE_H
#define HOST_WRITE_H

#include <stdbool.h>

#include "host/mesh/points.h"
#include "host/mesh/tetrahedra.h"

enum { HOST_PATH_MAX = 4096 }; /* bytes of a file's name, by the kernel */

/* Writes points, so that reading gives the same doubles; "-" is standard
 * output, in the first format of the table that is written. */
int host_points_write(const char *path, const struct host_points *points,
                      struct host_error *error);

/* The same in the format that host_format_told has for `format`, if not NULL.
 */
int host_points_write_as(const char *path, const char *format,
                         const struct host_points *points,
                         struct host_error *error);

/* Writes the tetrahedra (sorted, vertices = rows of points), and the files that
 * belong beside them; "-" as above.  input: the file of the points, or NULL; it
 * is never written, even if it is one of the files beside them. */
int host_write(const char *path, const char *input,
               const struct host_points *points,
               const struct host_tetrahedra *tets, struct host_error *error);

/* Whether `name`, a file beside an output, is `input` in the same format, so
 * that it has the points already.  input: NULL is none. */
bool host_write_leaves(const char *input, const char *name);

/* 0 where `path` has an extension that host_write knows, else HOST_USAGE with
 * the list of those that are allowed.  For checking before the work starts. */
int host_write_check(const char *path, struct host_error *error);

/* File k of those that the output `path` makes, 0 being itself; NULL: there is
 * none, or its name is too long for `size` bytes.  "-" makes none. */
const char *host_write_file(const char *path, unsigned k, char *name,
                            size_t size);

/* 0 where a file can be made beside `path`, else HOST_INPUT.  `input`: as of
 * host_write. */
int host_write_probe(const char *path, const char *input,
                     struct host_error *error);

#endif
