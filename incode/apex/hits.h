/* Points in the ball that the search of a regular face has come down to, and
 * where they are in the face's pencil of spheres.  Many are placed at a time;
 * the first of them draws the ball in, and what falls out of it is dropped
 * where room is wanted.  What is left is for the predicates.
 *
 * Memory: struct incode_hits, about 5 KB.  Work: that of the points given.
 *
 *     room = incode_hits_add(&pencil, &q, frame, in, &hits);
 *     incode_hits_place(&q, &pencil, &hits);
 *     if (incode_hits_contends(&q, &hits, 0, t))
 *         v = hits.id[0];
 */
#ifndef INCODE_HITS_H
#define INCODE_HITS_H

#include <stdalign.h>

#include "query.h"

enum { INCODE_HITS = 128 /* kept at a time */ };

/* t: where in the pencil, infinite where the point is not clearly beyond the
 * face. */
struct incode_hits {
    alignas(64) double p[3][INCODE_HITS];
    alignas(64) double t[INCODE_HITS];
    uint32_t id[INCODE_HITS], count;
    uint32_t placed; /* so many of them, at least, have a place */
};

/* The query's ball becomes that of the pencil's sphere at t, widened by 1e-6 of
 * its size. */
void incode_hits_draw_in(struct incode_query *q,
                         const struct incode_pencil *pencil, double t);

/* Adds the points of a brick whose bits are set; false: there are too many in
 * the ball. */
bool incode_hits_add(const struct incode_pencil *pencil, struct incode_query *q,
                     const struct incode_frame *frame, uint64_t in,
                     struct incode_hits *hits);

/* Sets the places that are missing, and draws the ball in to the first of them.
 */
void incode_hits_place(struct incode_query *q,
                       const struct incode_pencil *pencil,
                       struct incode_hits *hits);

/* Whether a hit may be the first, or tie with one placed at `last`. */
bool incode_hits_contends(const struct incode_query *q,
                          const struct incode_hits *hits, uint32_t i,
                          double last);

#endif
