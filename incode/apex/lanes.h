/* A vector of numbers in twice the precision, as in double_double.h.
 *
 * Memory: none.  Work: constant.
 *
 *     struct incode_lanes r = incode_lanes_difference(x, y, scale);
 *     value = incode_lanes_plus(value, incode_lanes_times(factor, r));
 */
#ifndef INCODE_LANES_H
#define INCODE_LANES_H

#include "incode/predicates/double_double.h"
#include "incode/predicates/simd.h"

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

#endif
