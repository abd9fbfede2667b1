#include "lift.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "host/base/parallel.h"
#include "incode/predicates/simd.h"

/* ---- lumps ---- */

/* Sums are of 8 parts, whatever the width of the registers, so that pages do
 * not depend on it. */
enum { PARTS = 8, GROUPS = PARTS / INCODE_VD_LANES, SUMS = 13 };

/* Of y with w = |y|^2: y, yy, w^2, wy. */
static void sum_brick(const struct host_lump *lump,
                      const struct incode_brick *brick, double total[SUMS]) {
    const double *axis[3] = {brick->x, brick->y, brick->z};
    incode_vd inverse = incode_vd_all(1 / lump->unit);
    incode_vd sum[SUMS][GROUPS] = {0};
    for (int i = 0; i < INCODE_BRICK_POINTS; i += PARTS) {
        for (int g = 0; g < GROUPS; g++) {
            incode_vd y[3];
            for (int d = 0; d < 3; d++) {
                incode_vd p = incode_vd_load(axis[d] + i + g * INCODE_VD_LANES);
                y[d] = (p - incode_vd_all(lump->origin[d])) * inverse;
            }
            incode_vd square[3] = {y[0] * y[0], y[1] * y[1], y[2] * y[2]};
            incode_vd w = square[0] + square[1] + square[2];
            for (int d = 0; d < 3; d++) {
                sum[d][g] += y[d];
                sum[3 + d][g] += square[d];
                sum[6 + d][g] += y[(d + 1) % 3] * y[(d + 2) % 3];
                sum[10 + d][g] += w * y[d];
            }
            sum[9][g] += w * w;
        }
    }
    for (int s = 0; s < SUMS; s++) {
        double part[PARTS];
        memcpy(part, sum[s], sizeof part);
        total[s] = ((part[0] + part[1]) + (part[2] + part[3])) +
                   ((part[4] + part[5]) + (part[6] + part[7]));
    }
}

void host_lump_brick(struct host_lump *lump, const struct incode_brick *brick) {
    const double *axis[3] = {brick->x, brick->y, brick->z};
    double total[SUMS];
    for (int d = 0; d < 3; d++) {
        incode_vd lo = incode_vd_load(axis[d]), hi = lo;
        for (int i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VD_LANES) {
            incode_vd p = incode_vd_load(axis[d] + i);
            lo = incode_vd_min(lo, p);
            hi = incode_vd_max(hi, p);
        }
        lump->lo[d] = incode_vd_least_of(lo);
        lump->hi[d] = -incode_vd_least_of(-hi);
    }
    incode_boxes_frame(lump->lo, lump->hi, lump->origin, &lump->unit);
    sum_brick(lump, brick, total);
    lump->count = INCODE_BRICK_POINTS;
    memcpy(lump->y, total, sizeof lump->y);
    memcpy(lump->yy, total + 3, sizeof lump->yy);
    lump->y_square = total[9];
    memcpy(lump->y_cube, total + 10, sizeof lump->y_cube);
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* A symmetric matrix as it is stored, times a vector. */
static void times(double out[3], const double m[6], const double a[3]) {
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = m[i] * a[i] + m[3 + k] * a[j] + m[3 + j] * a[k];
    }
}

/* Adds the sums of a lump of another frame: its y is here k y + d. */
static void add(struct host_lump *to, const struct host_lump *from) {
    double k = from->unit / to->unit, n = from->count, d[3], yyd[3];
    for (int i = 0; i < 3; i++)
        d[i] = (from->origin[i] - to->origin[i]) / to->unit;
    times(yyd, from->yy, d);
    double dd = dot(d, d), yd = k * dot(from->y, d);
    double w = k * k * (from->yy[0] + from->yy[1] + from->yy[2]);
    to->count += n;
    for (int i = 0; i < 3; i++) {
        int a = (i + 1) % 3, b = (i + 2) % 3;
        double y = k * from->y[i];
        to->y[i] += y + n * d[i];
        to->yy[i] += k * k * from->yy[i] + 2 * y * d[i] + n * d[i] * d[i];
        to->yy[3 + i] += k * k * from->yy[3 + i] +
                         k * (from->y[a] * d[b] + from->y[b] * d[a]) +
                         n * d[a] * d[b];
        to->y_cube[i] += k * k * k * from->y_cube[i] + 2 * k * k * yyd[i] +
                         dd * y + d[i] * (w + 2 * yd + n * dd);
    }
    to->y_square +=
        k * k * k * (k * from->y_square + 4 * dot(from->y_cube, d)) +
        2 * dd * w + 4 * k * k * dot(yyd, d) + dd * (4 * yd + n * dd);
}

void host_lump_join(struct host_lump *lump, const struct host_lump *of,
                    uint32_t count) {
    struct host_lump all = {.count = 0};
    for (int d = 0; d < 3; d++) {
        all.lo[d] = of[0].lo[d];
        all.hi[d] = of[0].hi[d];
        for (uint32_t i = 1; i < count; i++) {
            all.lo[d] = fmin(all.lo[d], of[i].lo[d]);
            all.hi[d] = fmax(all.hi[d], of[i].hi[d]);
        }
    }
    incode_boxes_frame(all.lo, all.hi, all.origin, &all.unit);
    for (uint32_t i = 0; i < count; i++)
        add(&all, &of[i]);
    *lump = all;
}

/* ---- what a lump is like ---- */

/* So much of volume or deviation is less. */
#define VOLUME 0.5
#define FIT 0.25

struct shape {
    double spread[6]; /* variances of y */
    double fit[3];    /* gradient of |y|^2, fitted to be linear */
    bool round;       /* it fits */
    bool flat;        /* or there is a plane or a line near all points */
};

/* m x = b by Cholesky's factors, with a part in 2^40 of its trace added to m,
 * which bounds x where the points leave it open. */
static void solve(double x[3], const double m[6], const double b[3]) {
    double more = (m[0] + m[1] + m[2]) * 0x1p-40 + 0x1p-900;
    double l00 = sqrt(m[0] + more), l10 = m[5] / l00, l20 = m[4] / l00;
    double l11 = sqrt(fmax(m[1] + more - l10 * l10, more));
    double l21 = (m[3] - l20 * l10) / l11;
    double l22 = sqrt(fmax(m[2] + more - l20 * l20 - l21 * l21, more));
    double y0 = b[0] / l00, y1 = (b[1] - l10 * y0) / l11;
    double y2 = (b[2] - l20 * y0 - l21 * y1) / l22;
    x[2] = y2 / l22;
    x[1] = (y1 - l21 * x[2]) / l11;
    x[0] = (y0 - l10 * x[1] - l20 * x[2]) / l00;
}

/* Turning a box with sides as the deviations of its points saves volume as the
 * determinant of their variances is less than the product of the diagonal
 * (Hadamard's inequality); sides are thickened by 1/4096.  Points spread evenly
 * over a box with half sides h have the variances h^2 / 3, and |y|^2 has 4/45
 * of the sum of all h^4; so much less, as what a linear fit leaves, is flat. */
static void set_flatness(struct shape *shape, const double spread[6],
                         double residual) {
    double thin = (spread[0] + spread[1] + spread[2]) * 0x1p-24;
    double a = spread[0] + thin, b = spread[1] + thin, c = spread[2] + thin;
    double f = spread[3], g = spread[4], h = spread[5];
    double turned =
        a * (b * c - f * f) - h * (h * c - f * g) + g * (h * f - b * g);
    double even = a * a + b * b + c * c + 2 * (f * f + g * g + h * h);
    shape->round = residual < FIT * FIT * (4. / 5) * even;
    shape->flat = turned < VOLUME * VOLUME * a * b * c;
}

static void find_shape(struct shape *shape, const struct host_lump *lump) {
    double n = lump->count, mean[3], w = 0, along[3];
    for (int d = 0; d < 3; d++) {
        mean[d] = lump->y[d] / n;
        w += lump->yy[d] / n;
    }
    for (int d = 0; d < 3; d++) {
        int a = (d + 1) % 3, b = (d + 2) % 3;
        shape->spread[d] = lump->yy[d] / n - mean[d] * mean[d];
        shape->spread[3 + d] = lump->yy[3 + d] / n - mean[a] * mean[b];
        along[d] = lump->y_cube[d] / n - w * mean[d];
    }
    solve(shape->fit, shape->spread, along);
    double residual = lump->y_square / n - w * w - dot(shape->fit, along);
    set_flatness(shape, shape->spread, residual);
}

/* ---- axes ---- */

/* Turns the plane of axes i and j until m has nothing off its diagonal there:
 * one rotation of Jacobi's. */
static void rotate(double m[3][3], double axis[3][3], int i, int j) {
    if (m[i][j] == 0)
        return;
    double theta = (m[j][j] - m[i][i]) / (2 * m[i][j]);
    double t = 1 / (fabs(theta) + sqrt(theta * theta + 1));
    t = theta < 0 ? -t : t;
    double c = 1 / sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < 3; k++) {
        double a = m[k][i], b = m[k][j];
        m[k][i] = c * a - s * b;
        m[k][j] = s * a + c * b;
    }
    for (int k = 0; k < 3; k++) {
        double a = m[i][k], b = m[j][k];
        m[i][k] = c * a - s * b;
        m[j][k] = s * a + c * b;
        a = axis[i][k], b = axis[j][k];
        axis[i][k] = c * a - s * b;
        axis[j][k] = s * a + c * b;
    }
}

enum { SWEEPS = 4 };

/* About the principal axes: any will do. */
static void principal_axes(double axis[3][3], const double spread[6]) {
    double m[3][3] = {{spread[0], spread[5], spread[4]},
                      {spread[5], spread[1], spread[3]},
                      {spread[4], spread[3], spread[2]}};
    double trace = spread[0] + spread[1] + spread[2];
    memset(axis, 0, 9 * sizeof axis[0][0]);
    axis[0][0] = axis[1][1] = axis[2][2] = 1;
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        double off = fabs(m[0][1]) + fabs(m[1][2]) + fabs(m[2][0]);
        if (!(off > trace * 0x1p-20))
            return;
        rotate(m, axis, 0, 1);
        rotate(m, axis, 1, 2);
        rotate(m, axis, 0, 2);
    }
}

/* Of the 24 rotations that give the same box, the least: where w is far from 0
 * (here 0.85 at least), what x, y and z lose by being rounded does not matter.
 */
static void least_turn(double turned[3][3], double axis[3][3]) {
    static const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                    {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    double most = -1;
    memcpy(turned, axis, 9 * sizeof axis[0][0]);
    for (int p = 0; p < 6; p++) {
        double a[3][3], trace = 0;
        bool mirrored = p >= 3;
        int least = 0;
        for (int k = 0; k < 3; k++) {
            const double *from = axis[order[p][k]];
            double sign = from[k] < 0 ? -1 : 1;
            mirrored ^= sign < 0;
            for (int d = 0; d < 3; d++)
                a[k][d] = sign * from[d];
            trace += a[k][k];
            least = a[k][k] < a[least][least] ? k : least;
        }
        trace -= mirrored ? 2 * a[least][least] : 0;
        for (int d = 0; d < 3 && mirrored; d++)
            a[least][d] = -a[least][d];
        if (trace > most) {
            most = trace;
            memcpy(turned, a, sizeof a);
        }
    }
}

static void set_turn(struct incode_boxes *boxes, unsigned child,
                     double axis[3][3]) {
    double a[3][3], q[3];
    least_turn(a, axis);
    double w4 = 2 * sqrt(1 + a[0][0] + a[1][1] + a[2][2]);
    q[0] = (a[1][2] - a[2][1]) / w4;
    q[1] = (a[2][0] - a[0][2]) / w4;
    q[2] = (a[0][1] - a[1][0]) / w4;
    for (int d = 0; d < 3; d++)
        boxes->turn[d][child] = (int16_t)rint(32767 * q[d]);
}

/* ---- encoding ---- */

/* The least number of half precision that is not less; a is below 2^15. */
static uint16_t half_rounded_up(double a) {
    int exponent;
    (void)frexp(a, &exponent); /* a < 2^exponent */
    exponent = exponent < -13 ? -13 : exponent;
    uint32_t bits = (uint32_t)ceil(ldexp(a, 11 - exponent));
    /* Bits of the fraction that overflow raise the exponent. */
    return (uint16_t)(bits + ((uint32_t)(exponent + 13) << 10));
}

/* A lump's points in the frame of its page. */
struct cloud {
    const struct incode_brick *brick;
    uint32_t bricks;
    double origin[3], inverse;
    double far; /* the largest coordinate, at most 1 */
};

INCODE_INLINE void relative(const struct cloud *cloud,
                            const struct incode_brick *brick, int i,
                            const double from[3], incode_vd t[3]) {
    const double *axis[3] = {brick->x, brick->y, brick->z};
    for (int d = 0; d < 3; d++)
        t[d] = (incode_vd_load(axis[d] + i) - incode_vd_all(cloud->origin[d])) *
                   incode_vd_all(cloud->inverse) -
               incode_vd_all(from[d]);
}

/* How far the points reach along each axis from a point on. */
static void extents(const struct cloud *cloud, const double from[3],
                    double axis[3][3], double lo[3], double hi[3]) {
    incode_vd least[3], most[3];
    for (int k = 0; k < 3; k++) {
        least[k] = incode_vd_all(INFINITY);
        most[k] = -least[k];
    }
    for (uint32_t b = 0; b < cloud->bricks; b++) {
        host_call_trim(sizeof cloud->brick[b]);
        for (int i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VD_LANES) {
            incode_vd t[3];
            relative(cloud, &cloud->brick[b], i, from, t);
            for (int k = 0; k < 3; k++) {
                incode_vd s = t[0] * incode_vd_all(axis[k][0]) +
                              t[1] * incode_vd_all(axis[k][1]) +
                              t[2] * incode_vd_all(axis[k][2]);
                least[k] = incode_vd_min(least[k], s);
                most[k] = incode_vd_max(most[k], s);
            }
        }
    }
    for (int k = 0; k < 3; k++) {
        lo[k] = incode_vd_least_of(least[k]);
        hi[k] = -incode_vd_least_of(-most[k]);
    }
}

/* The least of |p - o|^2 - q . (p - o). */
static double least_above(const struct cloud *cloud, const double o[3],
                          const double q[3]) {
    incode_vd least = incode_vd_all(INFINITY);
    for (uint32_t b = 0; b < cloud->bricks; b++) {
        host_call_trim(sizeof cloud->brick[b]);
        for (int i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VD_LANES) {
            incode_vd t[3];
            relative(cloud, &cloud->brick[b], i, o, t);
            incode_vd square = t[0] * t[0] + t[1] * t[1] + t[2] * t[2];
            incode_vd along = t[0] * incode_vd_all(q[0]) +
                              t[1] * incode_vd_all(q[1]) +
                              t[2] * incode_vd_all(q[2]);
            least = incode_vd_min(least, square - along);
        }
    }
    return incode_vd_least_of(least);
}

static double clamped(double a, double most) {
    return rint(a > most ? most : a > -most ? a : -most);
}

/* Rounding of what is projected on an axis, with |x|, |m| and |o| <= 2 a
 * coordinate, in units u = 2^-53: 2 a coordinate for x (the difference, for the
 * division is exact) and 4 for x - m, so 6 sqrt 3 along an axis; 3 |x - m| <=
 * 21 for the products and sums; as much and less for o - m; 14 for the last
 * difference.  Of a child within `far` of the origin, |o| <= 2 far, and each of
 * these is less by that factor. */
#define SLACK 0x1p-46

/* Times far: below that it would be larger than what the turn loses. */
#define E_LEAST 0x1p-32

/* Centre and half axes from the extents along the axes. */
static void set_halves(struct incode_boxes *boxes, unsigned child,
                       const struct cloud *cloud, double e) {
    struct incode_lifted middle;
    double axis[3][3], lo[3], hi[3], o[3];
    (void)incode_boxes_lifted(boxes, child, &middle); /* o is m as yet */
    incode_boxes_turned(boxes, child, axis);
    memcpy(o, middle.o, sizeof o);
    extents(cloud, o, axis, lo, hi);
    for (int d = 0; d < 3; d++) {
        double c = 0;
        for (int k = 0; k < 3; k++)
            c += 0.5 * (lo[k] + hi[k]) * axis[k][d];
        boxes->centre[d][child] = (int16_t)clamped(c / e * 32767, 32767);
    }
    (void)incode_boxes_lifted(boxes, child, &middle);
    for (int d = 0; d < 3; d++)
        o[d] = middle.o[d] - o[d];
    for (int k = 0; k < 3; k++) {
        double at = dot(axis[k], o);
        double half = fmax(hi[k] - at, at - lo[k]) + SLACK * cloud->far;
        boxes->half[k][child] = half_rounded_up(half / e * (1 + 0x1p-50));
    }
}

/* Slopes of the half axes, from what |y|^2 is fitted by in the lump's frame. */
static void set_slopes(struct incode_boxes *boxes, unsigned child,
                       const struct host_lump *lump, const struct shape *shape,
                       double e) {
    struct incode_lifted l;
    (void)incode_boxes_lifted(boxes, child, &l);
    double ratio = lump->unit / boxes->unit;
    for (int k = 0; k < 3; k++) {
        double slope = 0;
        for (int d = 0; d < 3; d++) {
            double at = (lump->origin[d] - boxes->origin[d]) / boxes->unit;
            slope += (ratio * shape->fit[d] + 2 * (at - l.o[d])) * l.a[k][d];
        }
        /* An axis that is all rounding has none; nor has a long one, where
         * the points' own |y|^2 is least within. */
        double square = dot(l.a[k], l.a[k]);
        bool none = square < 0x1p-72 || (!shape->round && 16 * square > e * e);
        boxes->slope[k][child] =
            (int8_t)clamped(none ? 0 : slope / e / e * 32, 127);
    }
}

/* The lid, below all points.  Rounding: with u = 2^-53, x - o has 10 u far a
 * coordinate, so 18 u far in length; r bounds it, and c the length of the
 * gradient q.  |x - o|^2 is wrong by 36 u far r + 3 u r^2, q . (x - o) by
 * 18 u far c + 12 u c r, with the rounding of q's own terms, and the difference
 * by u (r^2 + c r).  False: it is too low to be told. */
static bool set_lid(struct incode_boxes *boxes, unsigned child,
                    const struct cloud *cloud, double e) {
    struct incode_lifted l;
    double q[3] = {0}, c = 0;
    (void)incode_boxes_lifted(boxes, child, &l);
    for (int k = 0; k < 3; k++) {
        double square = dot(l.a[k], l.a[k]);
        for (int d = 0; d < 3; d++)
            q[d] += l.slope[k] * l.a[k][d] / square;
        c += fabs(l.slope[k]) / sqrt(square);
    }
    double lid = least_above(cloud, l.o, q);
    lid -= (cloud->far + l.radius) * (l.radius + c) * 0x1p-46;
    double units = floor(lid / e / e * 8192);
    boxes->lid[child] = (int16_t)fmin(units, 32767);
    return units >= -32767;
}

void host_lift(struct incode_boxes *boxes, unsigned child,
               const struct host_lump *lump, const struct incode_brick *brick,
               uint32_t bricks) {
    struct shape shape;
    double axis[3][3], e = 0, far = 0;
    find_shape(&shape, lump);
    for (int d = 0; d < 3; d++) {
        double lo = boxes->lo[d][child], hi = boxes->hi[d][child];
        e = fmax(e, 0.5 * (hi - lo));
        far = fmax(far, fmax(-lo, hi));
    }
    far = fmin(far, 1);
    if (!(shape.flat || shape.round) || !(e > E_LEAST * far))
        return;
    struct cloud cloud = {.brick = brick,
                          .bricks = bricks,
                          .inverse = 1 / boxes->unit,
                          .far = far};
    memcpy(cloud.origin, boxes->origin, sizeof cloud.origin);
    principal_axes(axis, shape.spread);
    set_turn(boxes, child, axis);
    boxes->is_lifted[child] = 1;
    set_halves(boxes, child, &cloud, e);
    set_slopes(boxes, child, lump, &shape, e);
    boxes->is_lifted[child] = set_lid(boxes, child, &cloud, e);
}
