/* Arithmetic in twice the precision: each number the sum of two doubles.
 *
 * Memory: none.  Work: some 20 operations a sum or a product.
 *
 *     struct incode_dd a = incode_dd_difference(p, q, scale);
 *     struct incode_dd d = incode_dd_cross(a, b, c, d);        a b - c d
 *     sign of d.hi, where |d.hi| exceeds the error
 */
#ifndef INCODE_DOUBLE_DOUBLE_H
#define INCODE_DOUBLE_DOUBLE_H

#include "two_product.h"

/* hi + lo, |lo| at most half a unit in the last place of hi. */
struct incode_dd {
    double hi, lo;
};

/* Relative error at most 4 * 2^-106 (AccurateDWPlusDW in Joldes, Muller and
 * Popescu, ACM TOMS 44:15, 2017). */
static inline struct incode_dd incode_dd_plus(struct incode_dd a,
                                              struct incode_dd b)
{
    struct incode_dd r;
    double e, f, s = incode_two_sum(a.hi, b.hi, &e);
    double t = incode_two_sum(a.lo, b.lo, &f);
    s = incode_fast_two_sum(s, e + t, &e);
    r.hi = incode_fast_two_sum(s, e + f, &r.lo);
    return r;
}

static inline struct incode_dd incode_dd_minus(struct incode_dd a,
                                               struct incode_dd b)
{
    struct incode_dd negative = {-b.hi, -b.lo};
    return incode_dd_plus(a, negative);
}

/* Relative error at most 7 * 2^-106 (DWTimesDW1, as above). */
static inline struct incode_dd incode_dd_times(struct incode_dd a,
                                               struct incode_dd b)
{
    struct incode_dd r;
    double e, x = incode_two_product(a.hi, b.hi, &e);
    r.hi = incode_fast_two_sum(x, e + (a.hi * b.lo + a.lo * b.hi), &r.lo);
    return r;
}

/* a b - c d */
static inline struct incode_dd incode_dd_cross(struct incode_dd a,
                                               struct incode_dd b,
                                               struct incode_dd c,
                                               struct incode_dd d)
{
    return incode_dd_minus(incode_dd_times(a, b), incode_dd_times(c, d));
}

/* (a - b) * scale, exact for a power of two that overflows nothing. */
static inline struct incode_dd incode_dd_difference(double a, double b,
                                                    double scale)
{
    struct incode_dd r;
    double e;
    r.hi = incode_two_sum(a, -b, &e) * scale;
    r.lo = e * scale;
    return r;
}

struct incode_dd_vector {
    struct incode_dd d[3];
};

/* (p - v) * scale, as above. */
static inline struct incode_dd_vector
incode_dd_relative(const double p[3], const double v[3], double scale)
{
    struct incode_dd_vector r;
    for (int k = 0; k < 3; k++)
        r.d[k] = incode_dd_difference(p[k], v[k], scale);
    return r;
}

static inline struct incode_dd incode_dd_dot(const struct incode_dd a[3],
                                             const struct incode_dd b[3])
{
    return incode_dd_plus(incode_dd_plus(incode_dd_times(a[0], b[0]),
                                         incode_dd_times(a[1], b[1])),
                          incode_dd_times(a[2], b[2]));
}

#endif
