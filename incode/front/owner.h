/* Whose a tetrahedron is: that of the brick of one of its vertices, the
 * lexicographically smallest one, or the one of the lowest number.  A function
 * of the tetrahedron alone, so that of all who build it one keeps it, and host
 * and nodes agree on which.
 *
 * Memory: none.  Work: three comparisons.
 *
 *     const double *const p[4] = {pa, pb, pc, pd};
 *     unsigned i = incode_owner(INCODE_OWNER_SMALLEST, vertex, p);
 *     uint32_t brick = vertex[i] / INCODE_BRICK_POINTS;
 */
#ifndef INCODE_OWNER_H
#define INCODE_OWNER_H

#include <stdbool.h>
#include <stdint.h>

#include "incode/predicates/predicates.h"

enum incode_owner_rule {
    INCODE_OWNER_SMALLEST, /* the paper's: the upper left frontmost */
    INCODE_OWNER_LOWEST    /* of number: coordinates do not count */
};

/* Which of four points is the smallest: by x alone, as a rule, and without a
 * branch, as nothing foretells which it is. */
static inline unsigned incode_smallest(const double *const p[4]) {
    unsigned least = 0;
    double x = p[0][0];
    for (unsigned i = 1; i < 4; i++) {
        bool less = p[i][0] < x;
        if (__builtin_expect(p[i][0] == x, 0))
            less = incode_lexicographic(p[i], p[least]) < 0;
        x = less ? p[i][0] : x;
        least = less ? i : least;
    }
    return least;
}

/* Which of some vertex numbers is the lowest. */
static inline unsigned incode_lowest(const uint32_t *v, unsigned count) {
    unsigned least = 0;
    for (unsigned i = 1; i < count; i++)
        least = v[i] < v[least] ? i : least;
    return least;
}

/* Which of a tetrahedron's vertices v, at p[0] to p[3], has it: 0 to 3. */
static inline unsigned incode_owner(enum incode_owner_rule rule,
                                    const uint32_t v[4],
                                    const double *const p[4]) {
    return rule == INCODE_OWNER_LOWEST ? incode_lowest(v, 4)
                                       : incode_smallest(p);
}

#endif
