#include "predicates.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "yield.h"
#include "check.h"
#include "exact.h"
#include "tie.h"

enum { FILLED = 8192, FILLED_UNITS = 16 }; /* bytes at once, and their work */

void incode_yield_poll(struct incode_yield *yield) {
    uint32_t units = INCODE_YIELD_UNITS_MAX;
    if (yield->poll != NULL)
        units = yield->poll(yield->context);
    INCODE_ASSERT(units >= 1 && units <= INCODE_YIELD_UNITS_MAX);
    yield->left = (int32_t)units;
}

void incode_yield_fill(struct incode_yield *yield, void *memory, int byte,
                       size_t bytes) {
    uint8_t *at = memory;
    for (size_t done; bytes > 0; at += done, bytes -= done) {
        done = bytes < FILLED ? bytes : FILLED;
        incode_yield_after(yield, FILLED_UNITS);
        memset(at, byte, done);
    }
}

/* --- predicates ----------------------------------------------------------- */

/* Each sign comes from the first stage that is sure of it:
 *   the rounded determinant and a bound on its error (static filter);
 *   integers of one common scale (fixed.h), which also settle true zeros;
 *   numbers of two doubles and a bound on their error (exact.h);
 *   doubles scaled axis by axis and row by row, with the bound of their own
 *   terms (exact.h): tried before pairs where the axes' differences are uneven;
 *   the polynomial itself, without rounding (exact.h).
 * Stack: below INCODE_EXACT_STACK + 1024 bytes. */

/* Units of work, as yield.h counts them, of what no filter decides, at the
 * most: fixed.h and pair.h, then exact.h, which counts in_sphere itself. */
enum {
    ORIENT3D_UNITS = 10,
    IN_SPHERE_UNITS = 32,
    SCALED_ORIENT3D_UNITS = 10,
    SCALED_IN_SPHERE_UNITS = 32,
    EXACT_ORIENT3D_UNITS = 64
};

/* Of the largest difference, the largest of another axis: with less, the bounds
 * of products of the largest are far too much. */
#define UNEVEN 0x1p-20

static double magnitude(double a) {
    return __builtin_fabs(a);
}

static double larger(double a, double b) {
    return a > b ? a : b;
}

static double largest3(double a, double b, double c) {
    return larger(magnitude(a), larger(magnitude(b), magnitude(c)));
}

static bool scaled_orient3d(struct incode_tally *tally,
                            const double *const p[4], double most, int *sign) {
    incode_yield_after(&tally->yield, SCALED_ORIENT3D_UNITS);
    return incode_scaled_orient3d(p, most, sign);
}

static bool scaled_in_sphere(struct incode_tally *tally,
                             const double *const p[5], double most, int *sign) {
    incode_yield_after(&tally->yield, SCALED_IN_SPHERE_UNITS);
    return incode_scaled_in_sphere(p, most, sign);
}

int incode_orient3d(struct incode_tally *tally, const double a[3],
                    const double b[3], const double c[3], const double d[3]) {
    double bx = b[0] - a[0], by = b[1] - a[1], bz = b[2] - a[2];
    double cx = c[0] - a[0], cy = c[1] - a[1], cz = c[2] - a[2];
    double dx = d[0] - a[0], dy = d[1] - a[1], dz = d[2] - a[2];
    double mx = largest3(bx, cx, dx), my = largest3(by, cy, dy);
    double mz = largest3(bz, cz, dz);
    double det = (bx * cy - by * cx) * dz + (by * cz - bz * cy) * dx +
                 (bz * cx - bx * cz) * dy;
    double least = mx < my ? mx : my, most = larger(mx, larger(my, mz));
    least = least < mz ? least : mz;
    if (least > INCODE_ORIENT3D_LEAST && most < INCODE_ORIENT3D_MOST) {
        double bound = INCODE_ORIENT3D_BOUND * mx * my * mz;
        if (det > bound)
            return 1;
        if (det < -bound)
            return -1;
    }
    tally->exact_orient3d++;
    incode_yield_after(&tally->yield, ORIENT3D_UNITS);
    const double *p[4] = {a, b, c, d};
    int64_t n[3][3];
    if (incode_fixed_differences(n, p + 1, 3, a, most))
        return incode_fixed_orient3d((const int64_t(*)[3])n);
    int sign;
    bool uneven = least < UNEVEN * most;
    if ((uneven && scaled_orient3d(tally, p, most, &sign)) ||
        incode_pair_orient3d(p, most, &sign) ||
        (!uneven && scaled_orient3d(tally, p, most, &sign)))
        return sign;
    incode_yield_after(&tally->yield, EXACT_ORIENT3D_UNITS);
    return incode_exact_orient3d(p);
}

/* Whether a is above b in the order of (x, y, z), without a branch. */
static inline bool higher(const double a[3], const double b[3]) {
    return (a[0] > b[0]) | ((a[0] >= b[0]) &
                            ((a[1] > b[1]) | ((a[1] >= b[1]) & (a[2] > b[2]))));
}

int incode_lexicographic(const double a[3], const double b[3]) {
    return higher(a, b) - higher(b, a);
}

/* Five cospherical points where no stage has told on the way: see tie.h. */
static int in_sphere_tie(struct incode_tally *tally, const double *const p[5]) {
    uint32_t above = 0;
    int cofactor[5];
    for (int i = 0; i < 5; i++)
        for (int j = i + 1; j < 5; j++)
            above += INCODE_TIE_ABOVE(i, j, higher(p[i], p[j]));
    for (int i = 0; i < 4; i++) {
        const double *q[4] = {p[0], p[1], p[2], p[3]};
        q[i] = p[4];
        cofactor[i] = incode_orient3d(tally, q[0], q[1], q[2], q[3]);
    }
    cofactor[4] = -1;
    return incode_tie(above, cofactor);
}

/* p[4] is the query, `near_zero` as in fixed.h. */
static int in_sphere_exact(struct incode_tally *tally, const double *const p[5],
                           bool uneven, double most, bool near_zero) {
    int64_t n[4][3];
    int sign;
    tally->exact_in_sphere++;
    incode_yield_after(&tally->yield, IN_SPHERE_UNITS);
    if (incode_fixed_differences(n, p, 4, p[4], most))
        return incode_fixed_in_sphere((const int64_t(*)[3])n, near_zero);
    if ((uneven && scaled_in_sphere(tally, p, most, &sign)) ||
        incode_pair_in_sphere(p, most, &sign) ||
        (!uneven && scaled_in_sphere(tally, p, most, &sign)))
        return sign;
    sign = incode_exact_in_sphere(p, &tally->yield);
    return sign != 0 ? sign : in_sphere_tie(tally, p);
}

int incode_in_sphere(struct incode_tally *tally, const double a[3],
                     const double b[3], const double c[3], const double d[3],
                     const double e[3]) {
    double ax = a[0] - e[0], ay = a[1] - e[1], az = a[2] - e[2];
    double bx = b[0] - e[0], by = b[1] - e[1], bz = b[2] - e[2];
    double cx = c[0] - e[0], cy = c[1] - e[1], cz = c[2] - e[2];
    double dx = d[0] - e[0], dy = d[1] - e[1], dz = d[2] - e[2];
    double mx = larger(largest3(ax, bx, cx), magnitude(dx));
    double my = larger(largest3(ay, by, cy), magnitude(dy));
    double mz = larger(largest3(az, bz, cz), magnitude(dz));
    double ab = ax * by - bx * ay, ac = ax * cy - cx * ay;
    double ad = ax * dy - dx * ay, bc = bx * cy - cx * by;
    double bd = bx * dy - dx * by, cd = cx * dy - dx * cy;
    double abc = ab * cz - ac * bz + bc * az;
    double abd = ab * dz - ad * bz + bd * az;
    double acd = ac * dz - ad * cz + cd * az;
    double bcd = bc * dz - bd * cz + cd * bz;
    double aw = ax * ax + ay * ay + az * az, bw = bx * bx + by * by + bz * bz;
    double cw = cx * cx + cy * cy + cz * cz, dw = dx * dx + dy * dy + dz * dz;
    double det = aw * bcd - bw * acd + (cw * abd - dw * abc);
    double least = mx < my ? mx : my, most = larger(mx, larger(my, mz));
    least = least < mz ? least : mz;
    bool in_range =
        least > INCODE_IN_SPHERE_LEAST && most < INCODE_IN_SPHERE_MOST;
    if (in_range) {
        double bound = INCODE_IN_SPHERE_BOUND * mx * my * mz * (most * most);
        if (det > bound)
            return 1;
        if (det < -bound)
            return -1;
    }
    const double *p[5] = {a, b, c, d, e};
    return in_sphere_exact(tally, p, least < UNEVEN * most, most, in_range);
}

/* Differences of two points from the third, as rounded, and the largest. */
static double differences2(double a[3], double b[3], const double *const p[2],
                           const double origin[3]) {
    double most = 0;
    for (int k = 0; k < 3; k++) {
        a[k] = p[0][k] - origin[k];
        b[k] = p[1][k] - origin[k];
        most = larger(most, larger(magnitude(a[k]), magnitude(b[k])));
    }
    return most;
}

/* Eight roundings at most stand between a sum of products and the exact one;
 * above the least sum here underflow is nothing beside them. */
static const double rounding_bound = 8 * 0x1p-53;
static const double least_sum = 1e-290, most_sum = 1e290;

int incode_compare_distance(const double p[3], const double a[3],
                            const double b[3]) {
    const double *q[3] = {p, a, b};
    double u[3], v[3], most = differences2(u, v, q + 1, p);
    double s = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    double t = v[0] * v[0] + v[1] * v[1] + v[2] * v[2], sum = s + t;
    if (sum > least_sum && sum < most_sum) {
        if (s - t > rounding_bound * sum)
            return 1;
        if (t - s > rounding_bound * sum)
            return -1;
    }
    int64_t n[2][3];
    if (incode_fixed_differences(n, q + 1, 2, p, most))
        return incode_fixed_compare_norm((const int64_t(*)[3])n);
    return incode_exact_compare_distance(q);
}

bool incode_collinear(const double a[3], const double b[3], const double c[3]) {
    const double *q[3] = {a, b, c};
    double u[3], v[3], most = differences2(u, v, q + 1, a);
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        double s = u[i] * v[j], t = v[i] * u[j];
        double sum = magnitude(s) + magnitude(t);
        if (sum > least_sum && sum < most_sum &&
            magnitude(s - t) > rounding_bound * sum)
            return false;
    }
    int64_t n[2][3];
    if (incode_fixed_differences(n, q + 1, 2, a, most))
        return incode_fixed_parallel((const int64_t(*)[3])n);
    return incode_exact_collinear(q);
}
