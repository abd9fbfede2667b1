/* A vector of numbers in twice the precision, as in double_double.h. */
#ifndef INCODE_LANES_H
#define INCODE_LANES_H

#include <stdalign.h>
#include <stdbool.h>
#include <stdint.h>

#include "incode/predicates/double_double.h"
#include "incode/predicates/simd.h"
#include "incode/predicates/predicates.h"

struct incode_lanes {
    incode_vd hi, lo;
};

INCODE_INLINE incode_vd incode_lanes_two_sum(incode_vd a, incode_vd b,
                                             incode_vd *error) {
    incode_vd s = a + b, c = s - a;
    *error = (a - (s - c)) + (b - c);
    return s;
}

INCODE_INLINE incode_vd incode_lanes_fast_two_sum(incode_vd a, incode_vd b,
                                                  incode_vd *error) {
    incode_vd s = a + b;
    *error = b - (s - a);
    return s;
}

INCODE_INLINE struct incode_lanes incode_lanes_all(struct incode_dd a) {
    return (struct incode_lanes){incode_vd_all(a.hi), incode_vd_all(a.lo)};
}

INCODE_INLINE struct incode_lanes incode_lanes_plus(struct incode_lanes a,
                                                    struct incode_lanes b) {
    struct incode_lanes r;
    incode_vd e, f, s = incode_lanes_two_sum(a.hi, b.hi, &e);
    incode_vd t = incode_lanes_two_sum(a.lo, b.lo, &f);
    s = incode_lanes_fast_two_sum(s, e + t, &e);
    r.hi = incode_lanes_fast_two_sum(s, e + f, &r.lo);
    return r;
}

INCODE_INLINE struct incode_lanes incode_lanes_minus(struct incode_lanes a,
                                                     struct incode_lanes b) {
    struct incode_lanes negative = {-b.hi, -b.lo};
    return incode_lanes_plus(a, negative);
}

INCODE_INLINE struct incode_lanes incode_lanes_times(struct incode_lanes a,
                                                     struct incode_lanes b) {
    struct incode_lanes r;
    incode_vd e, p = incode_vd_two_product(a.hi, b.hi, &e);
    e = incode_vd_fma(a.lo, b.hi, e);
    r.hi = incode_lanes_fast_two_sum(p, incode_vd_fma(a.hi, b.lo, e), &r.lo);
    return r;
}

INCODE_INLINE incode_vd incode_lanes_product(struct incode_lanes a,
                                             struct incode_lanes b,
                                             incode_vd *rest) {
    incode_vd e, p = incode_vd_two_product(a.hi, b.hi, &e);
    e = incode_vd_fma(a.lo, b.hi, e);
    *rest = incode_vd_fma(a.hi, b.lo, e);
    return p;
}

/* Errors as incode_dd_dot. */
INCODE_INLINE struct incode_lanes
incode_lanes_dot(const struct incode_lanes a[3],
                 const struct incode_lanes b[3]) {
    struct incode_lanes r;
    incode_vd e[3], f, g, p = incode_lanes_product(a[0], b[0], &e[0]);
    incode_vd q = incode_lanes_product(a[1], b[1], &e[1]);
    incode_vd s = incode_lanes_two_sum(p, q, &f);
    s = incode_lanes_two_sum(s, incode_lanes_product(a[2], b[2], &e[2]), &g);
    r.hi = incode_lanes_two_sum(s, (f + g) + (e[0] + e[1] + e[2]), &r.lo);
    return r;
}

/* (a - b) * scale, exact for a power of two that overflows nothing. */
INCODE_INLINE struct incode_lanes incode_lanes_difference(incode_vd a, double b,
                                                          double scale) {
    struct incode_lanes r;
    r.hi = incode_lanes_two_sum(a, incode_vd_all(-b), &r.lo);
    r.hi *= incode_vd_all(scale);
    r.lo *= incode_vd_all(scale);
    return r;
}

/* The double-double stage of MakeTetra: candidates that double precision cannot
 * tell apart, ranked in twice the precision by their places in the face's
 * pencil of spheres, all at once.  Where the points are exact and spheres
 * shared, as in a grid, that does not tell either, and the predicates must.
 *
 * Memory: the struct; 2 KB of stack.  Work: some 250 operations, and 150 a
 * vector of candidates. */

enum {
    INCODE_CLOSE_MAX = 16,
    INCODE_CLOSE_NONE = 0xffff,
    INCODE_CLOSE_UNITS = 72 /* of work (incode/predicates/yield.h) */
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
