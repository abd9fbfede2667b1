#include "boxes.h"

#include <assert.h>
#include <float.h>
#include <string.h>

#include "incode/predicates/scale.h"

static_assert(sizeof(struct incode_boxes) == 1568, "the layout of a page");

static double larger(double a, double b) {
    return a > b ? a : b;
}

/* ---- along the axes ---- */

void incode_boxes_frame(const double lo[3], const double hi[3],
                        double origin[3], double *unit) {
    double half = 0;
    for (int d = 0; d < 3; d++) {
        half = larger(half, 0.5 * hi[d] - 0.5 * lo[d]);
        origin[d] = 0.5 * lo[d] + 0.5 * hi[d];
    }
    uint64_t bits;
    memcpy(&bits, &half, sizeof bits);
    int32_t e = (int32_t)(bits >> 52) - 1022; /* half < 2^e */
    if (e > 1022) {
        /* Differences could overflow, and need not be made. */
        memset(origin, 0, 3 * sizeof origin[0]);
        e = 1023;
    }
    *unit = incode_power_of_two(e);
}

void incode_boxes_init(struct incode_boxes *boxes, const double lo[3],
                       const double hi[3]) {
    memset(boxes, 0, sizeof *boxes);
    incode_boxes_frame(lo, hi, boxes->origin, &boxes->unit);
    for (int d = 0; d < 3; d++) {
        for (int i = 0; i < INCODE_FANOUT; i++) {
            boxes->lo[d][i] = __builtin_inff();
            boxes->hi[d][i] = -__builtin_inff();
        }
    }
}

/* The next number below one that is normal or not 0. */
static float below(float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    bits += x > 0 ? UINT32_MAX : 1;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* The largest number of single precision, 0 or normal, that does not exceed
 * (p - origin) / unit.  What is lost in the difference is computed, too
 * (Knuth's sum of two), so that the comparison is exact. */
static float rounded_down(double p, double origin, double unit) {
    double sum = p - origin, back = p - sum;
    double lost = (p - (sum + back)) + (back - origin);
    double x = sum * (1 / unit);
    if (x < FLT_MIN && x > -FLT_MIN)
        return sum < 0 ? -FLT_MIN : 0;
    float f = (float)x;
    return (double)f > x || ((double)f == x && lost < 0) ? below(f) : f;
}

void incode_boxes_set(struct incode_boxes *boxes, unsigned child,
                      const double lo[3], const double hi[3]) {
    for (int d = 0; d < 3; d++) {
        double origin = boxes->origin[d], unit = boxes->unit;
        boxes->lo[d][child] = rounded_down(lo[d], origin, unit);
        boxes->hi[d][child] = -rounded_down(-hi[d], -origin, unit);
    }
    boxes->is_lifted[child] = 0;
}

/* What was set is beyond origin + unit x in real arithmetic, and a double, so
 * that rounding, which is monotone, does not pass it; nor does a limit to
 * finite numbers. */
void incode_boxes_axes(const struct incode_boxes *boxes,
                       double lo[3][INCODE_FANOUT],
                       double hi[3][INCODE_FANOUT]) {
    for (int d = 0; d < 3; d++) {
        double origin = boxes->origin[d], unit = boxes->unit;
        for (int i = 0; i < INCODE_FANOUT; i++) {
            double a = origin + unit * (double)boxes->lo[d][i];
            double b = origin + unit * (double)boxes->hi[d][i];
            lo[d][i] = a > -DBL_MAX ? a : -DBL_MAX;
            hi[d][i] = b < DBL_MAX ? b : DBL_MAX;
        }
    }
}

/* ---- lifted ---- */

enum { ONE = 32767 };

void incode_boxes_turned(const struct incode_boxes *boxes, unsigned child,
                         double axis[3][3]) {
    int64_t square = (int64_t)ONE * ONE;
    double q[3];
    for (int d = 0; d < 3; d++) {
        int64_t turn = boxes->turn[d][child];
        square -= turn * turn;
        q[d] = (double)turn / ONE;
    }
    double w = __builtin_sqrt(square > 0 ? (double)square : 0) / ONE;
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        axis[k][k] = 1 - 2 * (q[i] * q[i] + q[j] * q[j]);
        axis[k][i] = 2 * (q[k] * q[i] + w * q[j]);
        axis[k][j] = 2 * (q[k] * q[j] - w * q[i]);
    }
}

/* Of binary16, as if there were numbers beyond its largest. */
static double half_precision(uint16_t bits) {
    int32_t exponent = bits >> 10 & 31, fraction = bits & 1023;
    return exponent == 0
               ? fraction * 0x1p-24
               : (1024 + fraction) * incode_power_of_two(exponent - 25);
}

bool incode_boxes_lifted(const struct incode_boxes *boxes, unsigned child,
                         struct incode_lifted *lifted) {
    if (!boxes->is_lifted[child])
        return false;
    double e = 0, square = 0;
    for (int d = 0; d < 3; d++) {
        double lo = (double)boxes->lo[d][child];
        double hi = (double)boxes->hi[d][child];
        lifted->o[d] = 0.5 * (lo + hi);
        e = larger(e, 0.5 * (hi - lo));
    }
    incode_boxes_turned(boxes, child, lifted->a);
    for (int k = 0; k < 3; k++) {
        double half = half_precision(boxes->half[k][child]) * e;
        lifted->o[k] += boxes->centre[k][child] * (e / ONE);
        lifted->slope[k] = boxes->slope[k][child] * (e * e * 0x1p-5);
        for (int d = 0; d < 3; d++)
            lifted->a[k][d] *= half;
        square += half * half;
    }
    lifted->lid = boxes->lid[child] * (e * e * 0x1p-13);
    lifted->radius = __builtin_sqrt(square) * (1 + 0x1p-20);
    return true;
}
