#include "close_candidates.h"

#include <float.h>

#include "lanes.h"
#include "sphere.h"

/* In coordinates relative to v: with n = b x c, w = |b|^2 c - |c|^2 b and
 * m = w x n, the face's circle has the centre m / 2 |n|^2, and the sphere of
 * the pencil through r lies at
 *
 *     A / B = (|n|^2 |r|^2 - m . r) / (n . r)
 *
 * times a positive number.  Errors of the numerator are below FINE times the
 * products of the lengths that its terms have, and of the denominator likewise:
 * fewer than 1000 roundings of 2^-104. */
#define FINE 1e-27
#define TINY 1e-250

bool incode_close_add(struct incode_close_candidates *f, const double p[3]) {
    if (f->count == INCODE_CLOSE_MAX)
        return false;
    for (int d = 0; d < 3; d++)
        f->p[d][f->count] = p[d];
    f->count++;
    return true;
}

struct face {
    struct incode_dd_vector n, m;
    struct incode_dd nn;
    double numerator[2]; /* errors over |r| and |r|^2 */
    double denominator;  /* over |r| */
};

bool incode_close_may_tell(const double b[3], const double c[3]) {
    bool exact = true;
    for (int k = 0; k < 3; k++) {
        double e, f;
        (void)incode_two_product(b[k], c[(k + 1) % 3], &e);
        (void)incode_two_product(b[(k + 1) % 3], c[k], &f);
        exact = exact && e == 0 && f == 0;
    }
    return !exact;
}

static void set_face(struct face *f, const double v[3], const double pb[3],
                     const double pc[3], double scale) {
    struct incode_dd_vector b = incode_dd_relative(pb, v, scale);
    struct incode_dd_vector c = incode_dd_relative(pc, v, scale);
    struct incode_dd w[3];
    f->n = incode_dd_vector_product(b.d, c.d);
    struct incode_dd bb = incode_dd_dot(b.d, b.d);
    struct incode_dd cc = incode_dd_dot(c.d, c.d);
    for (int k = 0; k < 3; k++)
        w[k] = incode_dd_cross(bb, c.d[k], cc, b.d[k]);
    f->m = incode_dd_vector_product(w, f->n.d);
    f->nn = incode_dd_dot(f->n.d, f->n.d);
    double lb = incode_dd_max_norm(b.d), lc = incode_dd_max_norm(c.d),
           area = lb * lc;
    f->denominator = FINE * area;
    f->numerator[0] = FINE * area * area * (lb + lc);
    f->numerator[1] = FINE * area * area;
}

/* Places of candidates in the pencil: hi + lo, and its error, infinite for one
 * in doubt about the face; hi is infinite for one that is not beyond it. */
struct places {
    alignas(64) double hi[INCODE_CLOSE_MAX];
    alignas(64) double lo[INCODE_CLOSE_MAX];
    alignas(64) double error[INCODE_CLOSE_MAX];
};

/* Those of a vector of candidates; which are in doubt, one bit each. */
INCODE_INLINE uint32_t place(struct places *out, uint32_t i,
                             const struct face *f,
                             const struct incode_close_candidates *close,
                             const double v[3], double scale) {
    struct incode_lanes r[3], n[3], m[3];
    incode_vd size = incode_vd_all(0), tiny = incode_vd_all(TINY);
    for (int d = 0; d < 3; d++) {
        r[d] = incode_lanes_difference(incode_vd_load(close->p[d] + i), v[d],
                                       scale);
        n[d] = incode_lanes_all(f->n.d[d]);
        m[d] = incode_lanes_all(f->m.d[d]);
        size = incode_vd_max(size, incode_vd_abs(r[d].hi));
    }
    struct incode_lanes above = incode_lanes_dot(n, r),
                        nn = incode_lanes_all(f->nn);
    struct incode_lanes power = incode_lanes_minus(
        incode_lanes_times(nn, incode_lanes_dot(r, r)), incode_lanes_dot(m, r));
    incode_vd level = size * incode_vd_all(f->denominator) + tiny;
    incode_vd error = (incode_vd_all(f->numerator[0]) +
                       incode_vd_all(f->numerator[1]) * size) *
                          size +
                      tiny;
    incode_vd hi = power.hi / above.hi;
    incode_vd rest, back = incode_vd_two_product(hi, above.hi, &rest);
    incode_vd lo =
        ((power.hi - back) - rest + power.lo - hi * above.lo) / above.hi;
    error = (error + incode_vd_abs(hi) * level) / above.hi +
            incode_vd_abs(hi) * incode_vd_all(FINE);
    incode_vd zero = incode_vd_all(0),
              infinite = incode_vd_all(__builtin_inf());
    incode_vl none =
        (above.hi < -level) |
        (incode_vd_all(i) + incode_vd_count() >= incode_vd_all(close->count));
    error = incode_vd_select(above.hi > level + level, error, infinite);
    *(incode_vd *)(out->hi + i) = incode_vd_select(none, infinite, hi);
    *(incode_vd *)(out->lo + i) = incode_vd_select(none, zero, lo);
    error = incode_vd_select(none, zero, error);
    *(incode_vd *)(out->error + i) = error;
    return incode_vd_mask(error > incode_vd_all(DBL_MAX));
}

static bool is_beyond(const struct incode_close_candidates *f, uint32_t i,
                      const double v[3], const double b[3], const double c[3],
                      struct incode_tally *tally) {
    const double p[3] = {f->p[0][i], f->p[1][i], f->p[2][i]};
    return incode_orient3d(tally, v, b, c, p) > 0;
}

/* The first of them, if it is certain, without a branch on which it is. */
static uint32_t first_of(const struct places *at, uint32_t count) {
    incode_vd infinite = incode_vd_all(__builtin_inf()), least = infinite;
    alignas(64) double gap[INCODE_CLOSE_MAX];
    uint32_t best = 0, near = 0;
    for (uint32_t i = 0; i < count; i += INCODE_VD_LANES)
        least = incode_vd_min(incode_vd_load(at->hi + i), least);
    incode_vd hi = incode_vd_all(incode_vd_least_of(least));
    least = infinite;
    for (uint32_t i = 0; i < count; i += INCODE_VD_LANES) {
        incode_vd g =
            (incode_vd_load(at->hi + i) - hi) + incode_vd_load(at->lo + i);
        *(incode_vd *)(gap + i) = g;
        least = incode_vd_min(g, least);
    }
    incode_vd first = incode_vd_all(incode_vd_least_of(least));
    for (uint32_t i = 0; i < count; i += INCODE_VD_LANES)
        best |= incode_vd_mask(incode_vd_load(gap + i) == first) << i;
    if (best == 0)
        return INCODE_CLOSE_NONE;
    best = (uint32_t)__builtin_ctz(best);
    incode_vd error = incode_vd_all(at->error[best]);
    for (uint32_t i = 0; i < count; i += INCODE_VD_LANES) {
        incode_vd sum = incode_vd_load(at->error + i) + error;
        incode_vl far = incode_vd_load(gap + i) - first > sum + sum;
        near |= (~incode_vd_mask(far) & INCODE_VD_ALL) << i;
    }
    return (near & (near - 1)) == 0 ? best : INCODE_CLOSE_NONE;
}

uint32_t incode_close_first(struct incode_close_candidates *f,
                            const double v[3], const double b[3],
                            const double c[3], double scale,
                            struct incode_tally *tally) {
    struct face face;
    struct places at;
    uint32_t doubt = 0;
    if (f->count == 0)
        return INCODE_CLOSE_NONE;
    set_face(&face, v, b, c, scale);
    for (uint32_t i = f->count; i % INCODE_VD_LANES != 0; i++)
        for (int d = 0; d < 3; d++)
            f->p[d][i] = f->p[d][0];
    for (uint32_t i = 0; i < f->count; i += INCODE_VD_LANES)
        doubt |= place(&at, i, &face, f, v, scale) << i;
    for (; doubt != 0; doubt &= doubt - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(doubt);
        if (is_beyond(f, i, v, b, c, tally))
            return INCODE_CLOSE_NONE;
        at.hi[i] = __builtin_inf();
        at.lo[i] = at.error[i] = 0;
    }
    return first_of(&at, f->count);
}
