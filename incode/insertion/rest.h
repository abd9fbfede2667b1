/* The points that have not been inserted yet, as far as the highest boxes tell:
 * whether one may lie in the sphere of a cell, which is final otherwise.
 *
 * They are the bricks before one and those from another on: some 30 boxes of
 * each level for each of the two.  What these do not tell, look.h does.
 *
 * Memory: struct incode_rest, about 21 KB.  Work: incode_rest_reaches looks at
 * these boxes.
 *
 *     while (!incode_rest_set(&rest, &maker, first, brick))
 *         deliver(page);
 *     final = !incode_rest_reaches(&rest, &x, cell);
 */
#ifndef INCODE_REST_H
#define INCODE_REST_H

#include <stdalign.h>

#include "incode/complex/complex.h"
#include "incode/apex/maker.h"

enum { INCODE_REST_MAX = (INCODE_LEVELS_MAX - 1) * 2 * INCODE_FANOUT };

struct incode_rest {
    /* Absolute coordinates; filled up to a multiple of 8 with boxes that
     * nothing reaches. */
    alignas(64) double lo[3][INCODE_REST_MAX];
    alignas(64) double hi[3][INCODE_REST_MAX];
    uint32_t count;
};

/* All bricks before one and from another on, before < from; false: a page is
 * missing. */
bool incode_rest_set(struct incode_rest *rest, struct incode_maker *maker,
                     uint32_t before, uint32_t from);

/* Whether a point of the rest may lie in the sphere of a cell, or beyond its
 * facet or in its plane, as far as the rest's boxes tell. */
bool incode_rest_reaches(const struct incode_rest *rest,
                         const struct incode_complex *x,
                         const struct incode_cell *c);

#endif
