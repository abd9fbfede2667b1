/* Breaks ties of five cospherical points (Devillers and Teillaud, CGTA
 * 44:160-168, 2011).  The lift of each point is raised by an infinitesimal
 * amount, that of a lexicographically larger point by infinitely more than that
 * of a smaller one.  Coordinates never move, so no degenerate tetrahedron can
 * arise.  The result depends on the points alone.
 *
 * The perturbed determinant is a sum of the amounts, each times a cofactor.
 * The query's cofactor is -orient3d(p0,p1,p2,p3) < 0: raising the query moves
 * it out of the sphere.  The cofactor of p_i is the orient3d with the query in
 * place of p_i.  The largest point whose cofactor is not zero decides.  Of the
 * two largest points, at least one has a cofactor that is not zero, because the
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
