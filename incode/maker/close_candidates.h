/* The finals of MakeTetra: candidates that double precision cannot tell apart,
 * ranked in twice the precision by their places in the face's pencil of
 * spheres, all at once.  Where the points are exact and spheres shared, as in a
 * grid, that does not tell either, and the predicates must.
 *
 * Memory: the struct; 2 KB of stack.  Work: some 250 operations, and 150 a
 * vector of candidates.
 *
 *     incode_finals_add(&finals, p);
 *     first = incode_finals_first(&finals, pv, pb, pc, scale, &tally);
 */
#ifndef INCODE_FINALS_H
#define INCODE_FINALS_H

#include <stdalign.h>
#include <stdbool.h>
#include <stdint.h>

#include "incode/predicates/predicates.h"

enum { INCODE_FINALISTS = 16, INCODE_FINALS_NONE = 0xffff };

struct incode_finals {
    alignas(64) double p[3][INCODE_FINALISTS]; /* absolute coordinates */
    uint32_t count;
};

/* False: there is no room. */
bool incode_finals_add(struct incode_finals *f, const double p[3]);

/* False: products of the face's edges, relative, have so few digits that its
 * ties are likely to be true ones, which the predicates settle sooner. */
bool incode_finals_may_tell(const double b[3], const double c[3]);

/* Index of the candidate that is strictly first in Delaunay distance from the
 * face (v, b, c), of those strictly beyond it; INCODE_FINALS_NONE where that is
 * not certain.  scale: a power of two by which the face is of size 1 about.
 * Distinct points. */
uint32_t incode_finals_first(struct incode_finals *f, const double v[3],
                             const double b[3], const double c[3], double scale,
                             struct incode_tally *tally);

#endif
