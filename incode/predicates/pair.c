#include "pair.h"

#include "double_double.h"
#include "scale.h"

/* Bounds of the error, in units of the products of the largest entries: 210
 * (orient3d) and 6,100 (in_sphere) times 2^-106 by those of double_double.h,
 * rounded up.  What underflows is below the other term,
 * since every factor is below 2^61. */
#define ORIENT3D_BOUND 0x1p-96
#define IN_SPHERE_BOUND 0x1p-92
#define UNDERFLOW_BOUND 0x1p-600

static bool decide(struct incode_dd det, double bound, int *sign) {
    *sign = det.hi > 0 ? 1 : -1;
    return __builtin_fabs(det.hi) > bound + UNDERFLOW_BOUND;
}

/* d = (p[i] - origin) * 2^k; m = the largest of each column, plus a little. */
static bool differences(struct incode_dd d[][3], double m[3],
                        const double *const p[], int count,
                        const double *origin, double most) {
    struct incode_scale s;
    if (!incode_scale_init(&s, most))
        return false;
    for (int k = 0; k < 3; k++) {
        m[k] = 0;
        for (int i = 0; i < count; i++) {
            double e, x = incode_two_sum(p[i][k], -origin[k], &e);
            x = x * s.up1 * s.up2;
            d[i][k].hi = x;
            d[i][k].lo = e * s.up1 * s.up2;
            x = __builtin_fabs(x) * 0x1.0000000000002p0;
            m[k] = x > m[k] ? x : m[k];
        }
    }
    return true;
}

static struct incode_dd minor3(const struct incode_dd a[3],
                               const struct incode_dd b[3],
                               const struct incode_dd c[3]) {
    struct incode_dd bc =
        incode_dd_times(incode_dd_cross(b[0], c[1], c[0], b[1]), a[2]);
    struct incode_dd ca =
        incode_dd_times(incode_dd_cross(c[0], a[1], a[0], c[1]), b[2]);
    struct incode_dd ab =
        incode_dd_times(incode_dd_cross(a[0], b[1], b[0], a[1]), c[2]);
    return incode_dd_plus(incode_dd_plus(bc, ca), ab);
}

bool incode_pair_orient3d(const double *const p[4], double most, int *sign) {
    struct incode_dd d[3][3];
    double m[3];
    if (!differences(d, m, p + 1, 3, p[0], most))
        return false;
    return decide(minor3(d[0], d[1], d[2]), ORIENT3D_BOUND * m[0] * m[1] * m[2],
                  sign);
}

bool incode_pair_in_sphere(const double *const p[5], double most, int *sign) {
    struct incode_dd d[4][3];
    double m[3];
    if (!differences(d, m, p, 4, p[4], most))
        return false;
    struct incode_dd a =
        incode_dd_times(incode_dd_dot(d[0], d[0]), minor3(d[1], d[2], d[3]));
    struct incode_dd b =
        incode_dd_times(incode_dd_dot(d[1], d[1]), minor3(d[0], d[2], d[3]));
    struct incode_dd c =
        incode_dd_times(incode_dd_dot(d[2], d[2]), minor3(d[0], d[1], d[3]));
    struct incode_dd e =
        incode_dd_times(incode_dd_dot(d[3], d[3]), minor3(d[0], d[1], d[2]));
    double w = m[0] > m[1] ? m[0] : m[1];
    w = m[2] > w ? m[2] : w;
    return decide(incode_dd_plus(incode_dd_minus(a, b), incode_dd_minus(c, e)),
                  IN_SPHERE_BOUND * m[0] * m[1] * m[2] * (w * w), sign);
}
