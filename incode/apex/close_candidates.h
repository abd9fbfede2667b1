/* The double-double stage of MakeTetra: candidates that double precision cannot
 * tell apart, ranked in twice the precision by their places in the face's
 * pencil of spheres, all at once.  Where the points are exact and spheres
 * shared, as in a grid, that does not tell either, and the predicates must.
 *
 * Memory: the struct; 2 KB of stack.  Work: some 250 operations, and 150 a
 * vector of candidates.
 *
 *     incode_close_add(&close, p);
 *     first = incode_close_first(&close, pv, pb, pc, scale, &tally);
 */
#ifndef INCODE_CLOSE_CANDIDATES_H
#define INCODE_CLOSE_CANDIDATES_H

#include <stdalign.h>
#include <stdbool.h>
#include <stdint.h>

#include "incode/predicates/predicates.h"

enum {
    INCODE_CLOSE_MAX = 16,
    INCODE_CLOSE_NONE = 0xffff,
    INCODE_CLOSE_UNITS = 72 /* of work (incode/predicates/pause.h) */
};

struct incode_close_candidates {
    alignas(64) double p[3][INCODE_CLOSE_MAX]; /* absolute coordinates */
    uint32_t count;
};

/* False: there is no room. */
bool incode_close_add(struct incode_close_candidates *f, const double p[3]);

/* False: products of the face's edges, relative, have so few digits that its
 * ties are likely to be true ones, which the predicates settle sooner. */
bool incode_close_may_tell(const double b[3], const double c[3]);

/* Index of the candidate that is strictly first in Delaunay distance from the
 * face (v, b, c), of those strictly beyond it; INCODE_CLOSE_NONE where that is
 * not certain.  scale: a power of two by which the face is of size 1 about.
 * Distinct points. */
uint32_t incode_close_first(struct incode_close_candidates *f,
                            const double v[3], const double b[3],
                            const double c[3], double scale,
                            struct incode_tally *tally);

#endif
