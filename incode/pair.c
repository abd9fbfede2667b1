#include "pair.h"

#include "scale.h"
#include "two_product.h"

/* hi + lo, |lo| at most half a unit in the last place of hi. */
struct pair {
    double hi, lo;
};

/* Relative error at most 4 * 2^-106 (AccurateDWPlusDW in Joldes, Muller and
 * Popescu, ACM TOMS 44:15, 2017). */
static struct pair plus(struct pair a, struct pair b)
{
    struct pair r;
    double e, f, s = incode_two_sum(a.hi, b.hi, &e);
    double t = incode_two_sum(a.lo, b.lo, &f);
    s = incode_fast_two_sum(s, e + t, &e);
    r.hi = incode_fast_two_sum(s, e + f, &r.lo);
    return r;
}

static struct pair minus(struct pair a, struct pair b)
{
    struct pair negative = {-b.hi, -b.lo};
    return plus(a, negative);
}

/* Relative error at most 7 * 2^-106 (DWTimesDW1, as above). */
static struct pair times(struct pair a, struct pair b)
{
    struct pair r;
    double e, x = incode_two_product(a.hi, b.hi, &e);
    r.hi = incode_fast_two_sum(x, e + (a.hi * b.lo + a.lo * b.hi), &r.lo);
    return r;
}

/* a b - c d */
static struct pair cross(struct pair a, struct pair b, struct pair c,
                         struct pair d)
{
    return minus(times(a, b), times(c, d));
}

/* Bounds of the error, in units of the products of the largest entries: as
 * for plain doubles, 46 (orient3d) or 1,104 (in_sphere) times that of one
 * operation, 8 * 2^-106; rounded up.  What underflows is below the other term,
 * since every factor is below 2^61. */
#define ORIENT3D_BOUND 0x1p-96
#define IN_SPHERE_BOUND 0x1p-92
#define UNDERFLOW_BOUND 0x1p-600

static bool decide(struct pair det, double bound, int *sign)
{
    *sign = det.hi > 0 ? 1 : -1;
    return __builtin_fabs(det.hi) > bound + UNDERFLOW_BOUND;
}

/* d = (p[i] - origin) * 2^k; m = the largest of each column, plus a little. */
static bool differences(struct pair d[][3], double m[3],
                        const double *const p[], int count,
                        const double *origin, double most)
{
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

static struct pair minor3(const struct pair a[3], const struct pair b[3],
                          const struct pair c[3])
{
    struct pair bc = times(cross(b[0], c[1], c[0], b[1]), a[2]);
    struct pair ca = times(cross(c[0], a[1], a[0], c[1]), b[2]);
    struct pair ab = times(cross(a[0], b[1], b[0], a[1]), c[2]);
    return plus(plus(bc, ca), ab);
}

static struct pair norm(const struct pair a[3])
{
    return plus(plus(times(a[0], a[0]), times(a[1], a[1])), times(a[2], a[2]));
}

bool incode_pair_orient3d(const double *const p[4], double most, int *sign)
{
    struct pair d[3][3];
    double m[3];
    if (!differences(d, m, p + 1, 3, p[0], most))
        return false;
    return decide(minor3(d[0], d[1], d[2]), ORIENT3D_BOUND * m[0] * m[1] * m[2],
                  sign);
}

bool incode_pair_in_sphere(const double *const p[5], double most, int *sign)
{
    struct pair d[4][3];
    double m[3];
    if (!differences(d, m, p, 4, p[4], most))
        return false;
    struct pair a = times(norm(d[0]), minor3(d[1], d[2], d[3]));
    struct pair b = times(norm(d[1]), minor3(d[0], d[2], d[3]));
    struct pair c = times(norm(d[2]), minor3(d[0], d[1], d[3]));
    struct pair e = times(norm(d[3]), minor3(d[0], d[1], d[2]));
    double w = m[0] > m[1] ? m[0] : m[1];
    w = m[2] > w ? m[2] : w;
    return decide(plus(minus(a, b), minus(c, e)),
                  IN_SPHERE_BOUND * m[0] * m[1] * m[2] * (w * w), sign);
}
