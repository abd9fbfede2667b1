/* The error bounds of planes and spheres against rational numbers, where the
 * axes' scales differ and where they do not. */
#define TEST_OWN_MAIN
#include <math.h>

#include "tests/unit/test.h"
#include <gmp.h>

#include "incode/apex/query.h"
#include "tests/unit/emulated.h"

static uint64_t state = 1;

static double even(void) {
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-52 - 1;
}

/* ---- exact values ---- */

enum { POINTS = 5 }; /* v, b, c, a and p */

static mpq_t point[POINTS][3], square[POINTS], sum, term, part;

static void start(void) {
    for (int i = 0; i < POINTS; i++) {
        mpq_init(square[i]);
        for (int d = 0; d < 3; d++)
            mpq_init(point[i][d]);
    }
    mpq_inits(sum, term, part, NULL);
}

static void stop(void) {
    for (int i = 0; i < POINTS; i++) {
        mpq_clear(square[i]);
        for (int d = 0; d < 3; d++)
            mpq_clear(point[i][d]);
    }
    mpq_clears(sum, term, part, NULL);
}

/* Relative to the first, and scaled. */
static void load(double p[POINTS][3], double scale) {
    for (int i = POINTS - 1; i >= 0; i--) {
        mpq_set_ui(square[i], 0, 1);
        for (int d = 0; d < 3; d++) {
            mpq_set_d(point[i][d], p[i][d]);
            mpq_set_d(term, p[0][d]);
            mpq_sub(point[i][d], point[i][d], term);
            mpq_set_d(term, scale);
            mpq_mul(point[i][d], point[i][d], term);
            mpq_mul(term, point[i][d], point[i][d]);
            mpq_add(square[i], square[i], term);
        }
    }
}

/* term = i . (j x k) */
static void set_product(int i, int j, int k) {
    mpq_set_ui(term, 0, 1);
    for (int d = 0; d < 6; d++) {
        int x = d % 3, y = (x + 1 + d / 3) % 3, z = 3 - x - y;
        mpq_mul(part, point[i][x], point[j][y]);
        mpq_mul(part, part, point[k][z]);
        (d < 3 ? mpq_add : mpq_sub)(term, term, part);
    }
}

/* sum += sign * square[s] times a product. */
static void add(int sign, int s, int i, int j, int k) {
    set_product(i, j, k);
    mpq_mul(term, term, square[s]);
    (sign > 0 ? mpq_add : mpq_sub)(sum, sum, term);
}

/* m . p - det |p|^2 */
static void set_sphere(void) {
    mpq_set_ui(sum, 0, 1);
    add(1, 1, 4, 2, 3);
    add(1, 2, 4, 3, 1);
    add(1, 3, 4, 1, 2);
    add(-1, 4, 3, 1, 2);
}

/* n . p */
static void set_plane(void) {
    set_product(4, 1, 2);
    mpq_set(sum, term);
}

/* |value - sum| <= bound */
static bool holds(double value, double bound) {
    mpq_set_d(term, value);
    mpq_sub(term, term, sum);
    mpq_abs(term, term);
    mpq_set_d(part, bound);
    return mpq_cmp(term, part) <= 0;
}

/* ---- faces and points ---- */

/* Returns how much smaller the sphere's bound becomes without twice the
 * precision, which leaves no more of a bound than the value. */
static double check(double p[POINTS][3]) {
    struct incode_sphere s;
    double r[POINTS][3], extent = 0;
    for (int i = 1; i < POINTS; i++)
        for (int d = 0; d < 3; d++)
            extent = fmax(extent, fabs(p[i][d] - p[0][d]));
    double scale = incode_scale_for(extent);
    for (int i = 0; i < POINTS; i++)
        for (int d = 0; d < 3; d++)
            r[i][d] = (p[i][d] - p[0][d]) * scale;
    load(p, scale);
    incode_sphere_plane(&s, r[1], r[2]);
    incode_sphere_refine(&s, p[0], p[1], p[2], NULL, scale);
    set_plane();
    assert_true(holds(incode_dot(s.n, r[4]), incode_plane_error(&s, r[4])));
    incode_sphere_apex(&s, r[1], r[2], r[3]);
    double before = incode_sphere_error(&s, r[4]);
    set_sphere();
    assert_true(holds(incode_sphere_value(&s, r[4]), before));
    incode_sphere_refine(&s, p[0], p[1], p[2], p[3], scale);
    double after = incode_sphere_error(&s, r[4]);
    assert_true(holds(incode_sphere_value(&s, r[4]), after));
    assert_true(after < before * 1.01);
    return s.pdet > 1.01 * fabs(s.det) ? before / after : 1;
}

/* Points of all kinds: drawn freely, or close to the face's vertices and to
 * each other, the last now and then far off.  Returns the share of the former
 * whose bounds become much smaller. */
static double check_scales(const double axis[3], double offset) {
    const int all = emulated() ? 300 : 1500;
    int sharper = 0;
    for (int tries = 0; tries < all; tries++) {
        double p[POINTS][3], bend = ldexp(1, -(tries % 5) * 13);
        for (int i = 0; i < POINTS; i++)
            for (int d = 0; d < 3; d++)
                p[i][d] = i < 3 || tries % 3 == 0
                              ? even()
                              : p[0][d] + even() * bend +
                                    (p[i - 2][d] - p[0][d]) * (tries % 3 - 1);
        for (int d = 0; tries % 7 == 0 && d < 3; d++)
            p[4][d] *= 0x1p30;
        for (int i = 0; i < POINTS; i++)
            for (int d = 0; d < 3; d++)
                p[i][d] = (p[i][d] + offset) * axis[d];
        double gain = check(p);
        sharper += tries % 3 == 0 && gain > 1e3;
    }
    return 3. * sharper / all;
}

TEST(bounds_hold) {
    static const double axes[][3] = {{1, 1, 1},       {1e6, 1, 1},
                                     {1e6, 1e6, 1},   {1e3, 1, 1e-3},
                                     {1, 1e-6, 1e-6}, {1e-3, 1e-3, 1e3}};
    static const double offsets[] = {0, 3, 1e5};
    for (size_t i = 0; i < sizeof axes / sizeof *axes; i++) {
        for (size_t k = 0; k < sizeof offsets / sizeof *offsets; k++) {
            double share = check_scales(axes[i], offsets[k]);
            assert_true(i == 0 ? share < 0.1 : share > 0.8);
        }
    }
}

int main(void) {
    start();
    int failed = test_run();
    stop();
    return failed;
}
