/* Whose a tetrahedron is: that of the brick of its lexicographically smallest
 * vertex.  A function of the tetrahedron alone, so that of all who build it one
 * keeps it, and host and nodes agree on which.
 *
 * Memory: none.  Work: three comparisons.
 *
 *     const double *const p[4] = {pa, pb, pc, pd};
 *     uint32_t brick = vertex[incode_owner(p)] / INCODE_BRICK_POINTS;
 */
#ifndef INCODE_OWNER_H
#define INCODE_OWNER_H

#include "incode/predicates/predicates.h"

/* Which of a tetrahedron's vertices, at p[0] to p[3], has it: 0 to 3. */
static inline unsigned incode_owner(const double *const p[4])
{
    unsigned least = 0;
    for (unsigned i = 1; i < 4; i++)
        if (incode_lexicographic(p[i], p[least]) < 0)
            least = i;
    return least;
}

#endif
