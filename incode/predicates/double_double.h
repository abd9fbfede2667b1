/* Arithmetic in twice the precision: each number the sum of two doubles. */
#ifndef INCODE_DOUBLE_DOUBLE_H
#define INCODE_DOUBLE_DOUBLE_H

/* Sums and products of doubles without error: the rounded result and what
 * rounding took away (Knuth; Dekker, Numer. Math. 18:224-242, 1971).
 *
 * Work: 6 operations a sum; a product 2 by a fused multiply-add, which is
 * exact by definition where the processor has one for doubles, 17 by Dekker's
 * splitting elsewhere (never a library's fma: newlib's on a Cortex-M3 is just
 * x * y + z).  Both give the same bits as long as no part of the product
 * falls below 2^-1022 and no factor exceeds 2^995. */

#if defined(__FMA__) || defined(__FP_FAST_FMA) ||                              \
    (defined(__ARM_FEATURE_FMA) && defined(__ARM_FP) && (__ARM_FP & 8))
#define INCODE_HAS_FMA 1
#else
#define INCODE_HAS_FMA 0
#endif

static inline double incode_two_sum(double a, double b, double *error) {
    double x = a + b, bv = x - a, av = x - bv;
    *error = (a - av) + (b - bv);
    return x;
}

/* For |a| >= |b| or a = 0. */
static inline double incode_fast_two_sum(double a, double b, double *error) {
    double x = a + b;
    *error = b - (x - a);
    return x;
}

/* a = high + what is returned, of 26 bits each. */
static inline double incode_split(double a, double *high) {
    double c = 0x8000001p0 * a; /* 2^27 + 1 */
    *high = c - (c - a);
    return a - *high;
}

static inline double incode_two_product_dekker(double a, double b,
                                               double *error) {
    double ah, al = incode_split(a, &ah), bh, bl = incode_split(b, &bh);
    double x = a * b;
    *error = al * bl - (((x - ah * bh) - al * bh) - ah * bl);
    return x;
}

static inline double incode_two_product(double a, double b, double *error) {
#if INCODE_HAS_FMA
    double x = a * b;
    *error = __builtin_fma(a, b, -x);
    return x;
#else
    return incode_two_product_dekker(a, b, error);
#endif
}

/* About a b + c, rounded once or twice: for terms that an error bound covers.
 */
static inline double incode_multiply_add(double a, double b, double c) {
#if INCODE_HAS_FMA
    return __builtin_fma(a, b, c);
#else
    return a * b + c;
#endif
}

/* hi + lo, |lo| at most half a unit in the last place of hi. */
struct incode_dd {
    double hi, lo;
};

/* Relative error at most 4 * 2^-106 (AccurateDWPlusDW in Joldes, Muller and
 * Popescu, ACM TOMS 44:15, 2017). */
static inline struct incode_dd incode_dd_plus(struct incode_dd a,
                                              struct incode_dd b) {
    struct incode_dd r;
    double e, f, s = incode_two_sum(a.hi, b.hi, &e);
    double t = incode_two_sum(a.lo, b.lo, &f);
    s = incode_fast_two_sum(s, e + t, &e);
    r.hi = incode_fast_two_sum(s, e + f, &r.lo);
    return r;
}

static inline struct incode_dd incode_dd_minus(struct incode_dd a,
                                               struct incode_dd b) {
    struct incode_dd negative = {-b.hi, -b.lo};
    return incode_dd_plus(a, negative);
}

/* Relative error at most 7 * 2^-106 (DWTimesDW1, as above). */
static inline struct incode_dd incode_dd_times(struct incode_dd a,
                                               struct incode_dd b) {
    struct incode_dd r;
    double e, x = incode_two_product(a.hi, b.hi, &e);
    e = incode_multiply_add(a.lo, b.hi, e);
    r.hi = incode_fast_two_sum(x, incode_multiply_add(a.hi, b.lo, e), &r.lo);
    return r;
}

/* The high product, and what follows it but for 2^-106 of it. */
static inline double incode_dd_product(struct incode_dd a, struct incode_dd b,
                                       double *rest) {
    double e, p = incode_two_product(a.hi, b.hi, &e);
    e = incode_multiply_add(a.lo, b.hi, e);
    *rest = incode_multiply_add(a.hi, b.lo, e);
    return p;
}

/* a b - c d; error at most 20 * 2^-106 (|a b| + |c d|): high parts are summed
 * without error, and what that leaves over, below 4 * 2^-53 of the same, in
 * double precision (Ogita, Rump and Oishi, SIAM J. Sci. Comput. 26, 2005). */
static inline struct incode_dd incode_dd_cross(struct incode_dd a,
                                               struct incode_dd b,
                                               struct incode_dd c,
                                               struct incode_dd d) {
    struct incode_dd r;
    double e, f, g, p = incode_dd_product(a, b, &e);
    double q = incode_dd_product(c, d, &f), s = incode_two_sum(p, -q, &g);
    r.hi = incode_two_sum(s, g + (e - f), &r.lo);
    return r;
}

/* (a - b) * scale, exact for a power of two that overflows nothing. */
static inline struct incode_dd incode_dd_difference(double a, double b,
                                                    double scale) {
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
incode_dd_relative(const double p[3], const double v[3], double scale) {
    struct incode_dd_vector r;
    for (int k = 0; k < 3; k++)
        r.d[k] = incode_dd_difference(p[k], v[k], scale);
    return r;
}

/* a x b, each component as above. */
static inline struct incode_dd_vector
incode_dd_vector_product(const struct incode_dd a[3],
                         const struct incode_dd b[3]) {
    struct incode_dd_vector r;
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        r.d[k] = incode_dd_cross(a[i], b[j], a[j], b[i]);
    }
    return r;
}

/* Error at most 33 * 2^-106 of the sum of the terms' sizes, as above. */
static inline struct incode_dd incode_dd_dot(const struct incode_dd a[3],
                                             const struct incode_dd b[3]) {
    struct incode_dd r;
    double e[3], f, g, p = incode_dd_product(a[0], b[0], &e[0]);
    double q = incode_dd_product(a[1], b[1], &e[1]);
    double s = incode_two_sum(p, q, &f);
    s = incode_two_sum(s, incode_dd_product(a[2], b[2], &e[2]), &g);
    r.hi = incode_two_sum(s, (f + g) + (e[0] + e[1] + e[2]), &r.lo);
    return r;
}

#endif
