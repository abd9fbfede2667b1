/* Sums and products of doubles without error: the rounded result and what
 * rounding took away (Knuth; Dekker, Numer. Math. 18:224-242, 1971).
 *
 * Memory: none.  Work: 6 operations a sum; a product 2 by a fused multiply-add,
 * which is exact by definition where the processor has one for doubles, 17 by
 * Dekker's splitting elsewhere (never a library's fma: newlib's on a Cortex-M3
 * is just x * y + z).  Both give the same bits as long as no part of the
 * product falls below 2^-1022 and no factor exceeds 2^995.
 *
 *     double error, p = incode_two_product(a, b, &error);   // a b = p + error
 */
#ifndef INCODE_TWO_PRODUCT_H
#define INCODE_TWO_PRODUCT_H

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

#endif
