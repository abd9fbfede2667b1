/* Five cospherical points told apart (Devillers and Teillaud, CGTA 44:160-168,
 * 2011): the lift of each point is raised by an amount of its own, that of the
 * lexicographically larger point infinitely more than that of the smaller.
 * Coordinates never move, so no degenerate tetrahedron can arise, and nothing
 * but the points decides.
 *
 * The raised determinant is a sum of the amounts, each times a cofactor.  For
 * the query it is -orient3d(p0,p1,p2,p3) < 0: raised, it leaves the sphere.
 * For p_i it is the orient3d with the query in place of p_i.  The largest
 * point whose cofactor is not zero decides; of two, one is not, since the
 * first four points span space. */
#ifndef INCODE_TIE_H
#define INCODE_TIE_H

#include <stdint.h>

/* Counts how many points are smaller than each of the five, 4 bits a point. */
#define INCODE_TIE_ABOVE(i, j, larger)                                         \
    ((uint32_t)1 << ((larger) ? 4 * (i) : 4 * (j)))

/* cofactor[i]: the sign that raising the i-th point gives. */
static inline int incode_tie(uint32_t above, const int cofactor[5]) {
    /* Of 0 to 4, 4 alone has its bit 2, 3 alone both bits 1 and 0. */
    int first = cofactor[__builtin_ctz(above & 0x44444) / 4];
    int second = cofactor[__builtin_ctz(above & above >> 1 & 0x11111) / 4];
    return first != 0 ? first : second;
}

#endif
