/* The predicates as their definitions say, on integers of any length: the
 * reference of tests.  Ties are settled by perturbing the lifts with actual
 * numbers, small enough and far enough apart, not by a rule about signs.
 *
 * Work: tens of products of a few hundred to 10,000 bits. */
#ifndef TESTS_UNIT_EXACT_REFERENCE_H
#define TESTS_UNIT_EXACT_REFERENCE_H

#include <gmp.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

enum { REFERENCE_POINTS = 5 };

static mpz_t reference_p[REFERENCE_POINTS][5], reference_t[12];

static void reference_start(void) {
    for (int i = 0; i < REFERENCE_POINTS; i++)
        for (int k = 0; k < 5; k++)
            mpz_init(reference_p[i][k]);
    for (int i = 0; i < 12; i++)
        mpz_init(reference_t[i]);
}

static void reference_stop(void) {
    for (int i = 0; i < REFERENCE_POINTS; i++)
        for (int k = 0; k < 5; k++)
            mpz_clear(reference_p[i][k]);
    for (int i = 0; i < 12; i++)
        mpz_clear(reference_t[i]);
}

/* The points as integers of one scale, less the origin where there is one. */
static void reference_load(double (*p)[3], int n, const double *origin) {
    int least = INT32_MAX, e;
    for (int i = 0; i <= n; i++) {
        const double *q = i < n ? p[i] : origin;
        for (int k = 0; q != NULL && k < 3; k++) {
            if (q[k] != 0) {
                (void)frexp(q[k], &e);
                least = e < least ? e : least;
            }
        }
    }
    for (int i = 0; i <= n; i++) {
        const double *q = i < n ? p[i] : origin;
        for (int k = 0; q != NULL && k < 3; k++) {
            mpz_t *to = i < n ? &reference_p[i][k] : &reference_t[k];
            double m = frexp(q[k], &e);
            mpz_set_d(*to, m * 0x1p53);
            if (q[k] != 0)
                mpz_mul_2exp(*to, *to, (mp_bitcnt_t)(e - least));
        }
    }
    for (int i = 0; origin != NULL && i < n; i++)
        for (int k = 0; k < 3; k++)
            mpz_sub(reference_p[i][k], reference_p[i][k], reference_t[k]);
}

/* r = determinant of rows i, j, k of the loaded points; uses t[10]. */
static void reference_det3(mpz_t r, int i, int j, int k) {
    static const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                    {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
    mpz_set_ui(r, 0);
    for (int o = 0; o < 6; o++) {
        mpz_mul(reference_t[10], reference_p[i][order[o][0]],
                reference_p[j][order[o][1]]);
        (o < 3 ? mpz_addmul : mpz_submul)(r, reference_t[10],
                                          reference_p[k][order[o][2]]);
    }
}

/* r = |row i|^2 */
static void reference_lift(mpz_t r, int i) {
    mpz_set_ui(r, 0);
    for (int k = 0; k < 3; k++)
        mpz_addmul(r, reference_p[i][k], reference_p[i][k]);
}

static int reference_orient3d(double (*p)[3]) {
    reference_load(p + 1, 3, p[0]);
    reference_det3(reference_t[0], 0, 1, 2);
    return mpz_sgn(reference_t[0]);
}

static bool reference_above(const double *a, const double *b) {
    for (int k = 0; k < 3; k++)
        if (a[k] != b[k])
            return a[k] > b[k];
    return false;
}

/* r = determinant of the loaded rows in columns [column, 5), rows not in
 * `used`: by the first of these columns. */
static void reference_laplace(mpz_t r, int column, unsigned used) {
    mpz_t minor;
    int sign = 1;
    mpz_set_ui(r, column == 5);
    if (column == 5)
        return;
    mpz_init(minor);
    for (int i = 0; i < REFERENCE_POINTS; i++) {
        if ((used >> i & 1) != 0)
            continue;
        reference_laplace(minor, column + 1, used | 1u << i);
        (sign > 0 ? mpz_addmul : mpz_submul)(r, minor, reference_p[i][column]);
        sign = -sign;
    }
    mpz_clear(minor);
}

/* The tie: lifts S |p|^2 + B^rank, S and B so large that no lower power nor
 * the rounding of anything can matter; -det with rows (x, y, z, lift, 1). */
static int reference_tie(double (*p)[3]) {
    mp_bitcnt_t bits = 1;
    reference_load(p, 5, NULL);
    for (int i = 0; i < 5; i++) {
        for (int k = 0; k < 3; k++) {
            mp_bitcnt_t size = mpz_sizeinbase(reference_p[i][k], 2);
            bits = size > bits ? size : bits;
        }
    }
    mp_bitcnt_t b = 3 * bits + 8, s = 5 * b + 3 * bits + 10;
    for (int i = 0; i < 5; i++) {
        mp_bitcnt_t rank = 0;
        for (int j = 0; j < 5; j++)
            rank += reference_above(p[i], p[j]);
        reference_lift(reference_t[0], i);
        mpz_mul_2exp(reference_t[0], reference_t[0], s);
        mpz_set_ui(reference_t[1], 0);
        mpz_setbit(reference_t[1], b * rank);
        mpz_add(reference_p[i][3], reference_t[0], reference_t[1]);
        mpz_set_ui(reference_p[i][4], 1);
    }
    reference_laplace(reference_t[0], 0, 0);
    return -mpz_sgn(reference_t[0]);
}

/* With `perturbed`, never 0 where p0..p3 span space and all differ. */
static int reference_in_sphere(double (*p)[3], bool perturbed) {
    static const int rest[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    reference_load(p, 4, p[4]);
    mpz_set_ui(reference_t[0], 0);
    for (int i = 0; i < 4; i++) {
        reference_lift(reference_t[1], i);
        reference_det3(reference_t[2], rest[i][0], rest[i][1], rest[i][2]);
        mpz_addmul(reference_t[0], reference_t[1], reference_t[2]);
    }
    int sign = mpz_sgn(reference_t[0]);
    return sign == 0 && perturbed ? reference_tie(p) : sign;
}

static int reference_compare_distance(double (*p)[3]) {
    reference_load(p + 1, 2, p[0]);
    reference_lift(reference_t[0], 0);
    reference_lift(reference_t[1], 1);
    int sign = mpz_cmp(reference_t[0], reference_t[1]);
    return (sign > 0) - (sign < 0);
}

static bool reference_collinear(double (*p)[3]) {
    reference_load(p + 1, 2, p[0]);
    for (int k = 0; k < 3; k++) {
        int u = (k + 1) % 3, v = (k + 2) % 3;
        mpz_mul(reference_t[0], reference_p[0][u], reference_p[1][v]);
        mpz_submul(reference_t[0], reference_p[1][u], reference_p[0][v]);
        if (mpz_sgn(reference_t[0]) != 0)
            return false;
    }
    return true;
}

#endif
