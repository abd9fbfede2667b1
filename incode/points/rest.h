/* The points that have not been inserted yet, as far as pages of boxes tell of
 * them: whether one may lie in the sphere of a cell, which is final otherwise.
 *
 * Bricks are inserted in their order, so the rest is those from one of them on:
 * all later children of the pages above it, some 30 boxes a level.
 *
 * Memory: struct incode_rest, about 11 KB.  Work: incode_rest_reaches looks at
 * these boxes, incode_rest_looks also into the pages below those reached.
 *
 *     while (!incode_rest_set(&rest, &maker, brick))
 *         deliver(page);
 *     final = !incode_rest_reaches(&rest, &x, cell);
 */
#ifndef INCODE_REST_H
#define INCODE_REST_H

#include <stdalign.h>

#include "incode/complex/complex.h"
#include "incode/maker/maker.h"

enum { INCODE_REST_MAX = (INCODE_LEVELS_MAX - 1) * INCODE_FANOUT };

struct incode_rest {
    /* Absolute coordinates; filled up to a multiple of 8 with boxes that
     * nothing reaches. */
    alignas(64) double lo[3][INCODE_REST_MAX];
    alignas(64) double hi[3][INCODE_REST_MAX];
    uint32_t page[INCODE_REST_MAX];
    uint32_t count;
    double scale; /* 2^k, of relative coordinates */
    struct incode_maker *maker;
};

/* All bricks from this one on, or none; false: a page is missing. */
bool incode_rest_set(struct incode_rest *rest, struct incode_maker *maker,
                     uint32_t brick);

/* Whether a point of the rest may lie in the sphere of a cell, or beyond its
 * facet or in its plane, as far as the rest's boxes tell. */
bool incode_rest_reaches(const struct incode_rest *rest,
                         const struct incode_complex *x,
                         const struct incode_cell *c);

/* The same, as far as all boxes tell, the lifted ones, too.  A page that is
 * missing is asked for, and may be reached. */
bool incode_rest_looks(const struct incode_rest *rest,
                       const struct incode_complex *x,
                       const struct incode_cell *c);

#endif
