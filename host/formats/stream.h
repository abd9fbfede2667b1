/* Numbers one after another, from text or from bytes alike.
 *
 * Memory: none.  Work: that of host_scan_double or of a load.
 *
 *     struct host_stream s = {.source = &source, .type = HOST_F32, .big = true,
 *                             .at = data, .end = data + bytes};
 *     double value, sum = 0.0;
 *     while (n-- > 0 && host_stream_next(&s, &value, &error) == 0)
 *         sum += value;
 */
#ifndef HOST_STREAM_H
#define HOST_STREAM_H

#include "numbers.h"
#include "scan.h"

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
