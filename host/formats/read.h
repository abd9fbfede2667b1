/* Points and tetrahedra from files, in the format that the extension says.
 *
 * Work: one pass over the file, 40 ns a number of text at most. */
#ifndef HOST_READ_H
#define HOST_READ_H

#include "host/mesh/points.h"
#include "host/mesh/tetrahedra.h"
#include "rows.h"
#include "scan.h"

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

/* Numbers one after another, from text or from bytes alike. */

struct host_stream {
    const struct host_source *source;
    bool text; /* then `scan` is read, else at..end */
    bool big;
    enum host_number type;
    struct host_scan scan;
    const uint8_t *at, *end;
};

/* The next number; HOST_INPUT where the stream is at its end. */
int host_stream_next(struct host_stream *s, double *value,
                     struct host_error *error);

/* The next number, whole and not negative. */
int host_stream_whole(struct host_stream *s, uint64_t *value,
                      struct host_error *error);

int host_stream_skip(struct host_stream *s, uint64_t count,
                     struct host_error *error);

/* Whether nothing is left. */
bool host_stream_ended(struct host_stream *s);

/* Appends points from three numbers each. */
int host_stream_points(struct host_stream *s, uint64_t rows,
                       struct host_points *points, struct host_error *error);

/* VTK's cell lists: for each of `cells`, if its type is a tetrahedron, its
 * four vertices plus `first`; any other cell of volume is an error.  With
 * `offsets` NULL every cell in `connectivity` begins with its count. */
int host_stream_cells(struct host_stream *connectivity,
                      struct host_stream *offsets, struct host_stream *types,
                      uint64_t cells, uint64_t first,
                      struct host_tetrahedra *tets, struct host_error *error);

#endif
