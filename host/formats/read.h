/* Points and tetrahedra from files, in the format that the extension says.
 *
 * Memory: what is read, and the file itself while it is read.  Work: one pass
 * over the file, 40 ns a number of text at most.
 *
 *     if (host_points_read("bunny.ply", &points, &error) == 0 &&
 *         host_tetrahedra_read("bunny.ele", &tets, NULL, &error) == 0)
 *         host_tetrahedra_sort(&tets);
 */
#ifndef HOST_READ_H
#define HOST_READ_H

#include "host/mesh/points.h"
#include "host/mesh/tetrahedra.h"

/* Points in the order of the file, all finite and at least one (.gz through
 * zlib; "-" is standard input, in the first format
 * of the table that is read).  0 or error->code; *points is empty
 * after an error. */
int host_points_read(const char *path, struct host_points *points,
                     struct host_error *error);

/* The same of a file whose name does not tell what it holds: `format` does, as
 * host_format_told has it; NULL: the name does. */
int host_points_read_as(const char *path, const char *format,
                        struct host_points *points, struct host_error *error);

/* Notes on standard error, once, what the reader has assumed: a first line of
 * names, columns passed over. */
void host_points_note(const char *path, const struct host_points *points);

/* The same from memory; `path` gives the extension and the name in errors. */
int host_points_parse(const char *path, const void *data, size_t bytes,
                      struct host_points *points, struct host_error *error);

/* Tetrahedra (.gz allowed, "-" as above), rows numbered from 0; rows are as in
 * the file, neither sorted nor checked.  `points`, where not NULL, takes the
 * file's points, if it has any (else it stays empty).  Both are empty after an
 * error. */
int host_tetrahedra_read(const char *path, struct host_tetrahedra *tets,
                         struct host_points *points, struct host_error *error);
int host_tetrahedra_parse(const char *path, const void *data, size_t bytes,
                          struct host_tetrahedra *tets,
                          struct host_points *points, struct host_error *error);

/* HOST_INPUT where the tetrahedra of `path` have a vertex that is no row of the
 * points. */
int host_rows_check(const char *path, const struct host_tetrahedra *tets,
                    const struct host_points *points, struct host_error *error);

#endif
