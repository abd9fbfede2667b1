#include "gather.h"

#include <string.h>

#include "check.h"
#include "simd.h"

#define INFINITE __builtin_inff()

void incode_gather_reset(struct incode_gather *g)
{
    g->leaf = INCODE_NONE;
    g->around = g->count = 0;
    g->inner = 0;
    g->outer = INCODE_OUTER;
}

/* ---- around a leaf ---- */

static bool copy_leaves(struct incode_walker *walker, struct incode_query *q,
                        const struct incode_frame *frame, uint32_t brick,
                        uint32_t leaves, void *context)
{
    struct incode_gather *g = context;
    (void)walker;
    const struct incode_brick *b = &frame->page.brick;
    for (; leaves != 0; leaves &= leaves - 1) {
        uint32_t slot = (uint32_t)__builtin_ctz(leaves) * INCODE_LEAF_POINTS;
        uint32_t n = frame->count - slot;
        if (g->around + INCODE_LEAF_POINTS > INCODE_AROUND_POINTS)
            return false;
        incode_vd x = incode_vd_load(b->x + slot),
                  y = incode_vd_load(b->y + slot),
                  z = incode_vd_load(b->z + slot);
        uint32_t in = incode_vd_mask(
            (x >= incode_vd_all(q->lo[0])) & (x <= incode_vd_all(q->hi[0])) &
            (y >= incode_vd_all(q->lo[1])) & (y <= incode_vd_all(q->hi[1])) &
            (z >= incode_vd_all(q->lo[2])) & (z <= incode_vd_all(q->hi[2])));
        if (n < INCODE_LEAF_POINTS)
            in &= (UINT32_C(1) << n) - 1;
        incode_vd_pack(g->p[0] + g->around, in, x);
        incode_vd_pack(g->p[1] + g->around, in, y);
        incode_vd_pack(g->p[2] + g->around, in, z);
        incode_pack_count(g->id + g->around, in,
                          brick * INCODE_BRICK_POINTS + slot);
        g->around += (uint32_t)__builtin_popcount(in);
    }
    return true;
}

enum incode_gathered incode_gather_around(struct incode_gather *g,
                                          struct incode_walker *walker,
                                          uint32_t leaf, const double lo[3],
                                          const double hi[3], double radius)
{
    struct incode_query *q = &g->query;
    memset(q, 0, sizeof *q);
    q->question = INCODE_QUERY_BOX;
    q->boxed = true;
    q->pages_max = g->pages_max; /* all must be resident at once */
    g->leaf = INCODE_NONE;
    g->around = 0;
    g->radius = radius;
    for (int d = 0; d < 3; d++) {
        q->lo[d] = g->around_lo[d] = lo[d] - radius;
        q->hi[d] = g->around_hi[d] = hi[d] + radius;
    }
    enum incode_walk r = incode_walk(walker, q, copy_leaves, g);
    g->count = g->around;
    if (r == INCODE_WALK_WAIT)
        return INCODE_GATHER_WAIT;
    g->leaf = leaf;
    if (r == INCODE_WALK_DONE)
        return INCODE_GATHER_READY;
    /* Not the whole box: what was copied serves, but certifies nothing. */
    for (int d = 0; d < 3; d++) {
        g->around_lo[d] = __builtin_inf();
        g->around_hi[d] = -__builtin_inf();
    }
    return INCODE_GATHER_CROWDED;
}

/* ---- around a vertex ---- */

/* w and l of points [first, end), and padding that no scan mistakes for a
 * point: up to two vectors, with l infinite. */
static void set_lengths(struct incode_gather *g, uint32_t first, uint32_t end)
{
    incode_vi lane = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    incode_vf zero = incode_vf_all(0), infinite = incode_vf_all(INFINITE);
    for (uint32_t i = first & ~15U; i < end + INCODE_VF_LANES;
         i += INCODE_VF_LANES) {
        int32_t n = (int32_t)(end - i);
        incode_vi in =
            lane < (incode_vi){n, n, n, n, n, n, n, n, n, n, n, n, n, n, n, n};
        incode_vf x = incode_vf_select(in, incode_vf_load(g->x + i), zero),
                  y = incode_vf_select(in, incode_vf_load(g->y + i), zero),
                  z = incode_vf_select(in, incode_vf_load(g->z + i), zero);
        incode_vf l = incode_vf_select(x < zero, -x, x) +
                      incode_vf_select(y < zero, -y, y) +
                      incode_vf_select(z < zero, -z, z);
        *(incode_vf *)(g->x + i) = x;
        *(incode_vf *)(g->y + i) = y;
        *(incode_vf *)(g->z + i) = z;
        *(incode_vf *)(g->w + i) =
            incode_vf_fma(x, x, incode_vf_fma(y, y, z * z));
        *(incode_vf *)(g->l + i) = incode_vf_select(in, l, infinite);
    }
}

struct span {
    incode_vf lo[3], hi[3];
};

/* Rounding is monotone: a point within the box is within it after rounding
 * point and box alike. */
static void set_span(struct span *span, const struct incode_gather *g,
                     const double lo[3], const double hi[3])
{
    for (int d = 0; d < 3; d++) {
        span->lo[d] = incode_vf_all((float)((lo[d] - g->p0[d]) * g->scale));
        span->hi[d] = incode_vf_all((float)((hi[d] - g->p0[d]) * g->scale));
    }
}

INCODE_INLINE uint32_t within(const struct span *span, const incode_vf r[3])
{
    incode_vm out =
        incode_vf_less(r[0], span->lo[0]) | incode_vf_less(span->hi[0], r[0]) |
        incode_vf_less(r[1], span->lo[1]) | incode_vf_less(span->hi[1], r[1]) |
        incode_vf_less(r[2], span->lo[2]) | incode_vf_less(span->hi[2], r[2]);
    return ~incode_vm_bits(out) & 0xffff;
}

INCODE_INLINE void pack(struct incode_gather *g, uint32_t to, uint32_t in,
                        const incode_vf r[3], incode_vi at)
{
    incode_vf_pack(g->x + to, in, r[0]);
    incode_vf_pack(g->y + to, in, r[1]);
    incode_vf_pack(g->z + to, in, r[2]);
    incode_vi_pack(g->at + to, in, at);
}

/* Packs what lies in the inner box and what lies in the outer alone; false:
 * too many. */
static bool select_near(struct incode_gather *g)
{
    incode_vd scale = incode_vd_all(g->scale), p0[3];
    incode_vi at = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    incode_vi step = {16, 16, 16, 16, 16, 16, 16, 16,
                      16, 16, 16, 16, 16, 16, 16, 16};
    struct span outer, inner;
    set_span(&outer, g, g->lo, g->hi);
    set_span(&inner, g, g->inner_lo, g->inner_hi);
    for (int d = 0; d < 3; d++)
        p0[d] = incode_vd_all(g->p0[d]);
    uint32_t n = 0, m = INCODE_OUTER;
    for (uint32_t i = 0; i < g->around; i += INCODE_VF_LANES) {
        incode_vf r[3];
        for (int d = 0; d < 3; d++)
            r[d] = incode_vf_relative(g->p[d] + i, p0[d], scale);
        uint32_t in = within(&outer, r);
        if (g->around - i < INCODE_VF_LANES)
            in &= (UINT32_C(1) << (g->around - i)) - 1;
        uint32_t near = in & within(&inner, r);
        in ^= near;
        pack(g, n, near, r, at);
        pack(g, m, in, r, at);
        at += step;
        n += (uint32_t)__builtin_popcount(near);
        m += (uint32_t)__builtin_popcount(in);
        if (n > INCODE_INNER_POINTS ||
            m > INCODE_OUTER_END - INCODE_AROUND_EXTRA)
            return false;
    }
    g->inner = n;
    g->outer = m;
    set_lengths(g, 0, n);
    set_lengths(g, INCODE_OUTER, m);
    return true;
}

#define INNER_SHARE 0.69 /* of the radius: a third of the points */

/* One side of a box: the wall at `wall` of its direction `sign`, relative. */
static double side(const struct incode_gather *g, int d, double wall,
                   double end, double sign)
{
    bool beyond = sign > 0 ? wall >= end : wall <= end;
    return beyond ? sign * __builtin_inf() : (wall - g->p0[d]) * g->scale;
}

static void set_box(struct incode_gather *g, double radius,
                    const double domain_lo[3], const double domain_hi[3])
{
    g->radius = radius;
    g->scale = incode_scale_for(radius);
    for (int d = 0; d < 3; d++) {
        double lo = g->p0[d] - radius, hi = g->p0[d] + radius;
        double short_lo = g->p0[d] - radius * INNER_SHARE;
        double short_hi = g->p0[d] + radius * INNER_SHARE;
        lo = lo > g->around_lo[d] ? lo : g->around_lo[d];
        hi = hi < g->around_hi[d] ? hi : g->around_hi[d];
        short_lo = short_lo > lo ? short_lo : lo;
        short_hi = short_hi < hi ? short_hi : hi;
        g->lo[d] = lo;
        g->hi[d] = hi;
        g->inner_lo[d] = short_lo;
        g->inner_hi[d] = short_hi;
        g->rlo[d] = side(g, d, lo, domain_lo[d], -1);
        g->rhi[d] = side(g, d, hi, domain_hi[d], 1);
    }
}

void incode_gather_centre(struct incode_gather *g, uint32_t vertex,
                          const double p[3], double radius,
                          const double domain_lo[3], const double domain_hi[3])
{
    g->vertex = vertex;
    memcpy(g->p0, p, sizeof g->p0);
    g->count = g->around; /* far vertices of the last one go */
    set_box(g, radius, domain_lo, domain_hi);
    while (!select_near(g)) {
        radius *= 0.8;
        set_box(g, radius, domain_lo, domain_hi);
    }
    for (int d = 0; d < 3; d++) {
        g->inner_lo[d] = side(g, d, g->inner_lo[d], domain_lo[d], -1);
        g->inner_hi[d] = side(g, d, g->inner_hi[d], domain_hi[d], 1);
    }
    g->self = incode_gather_find(g, vertex);
}

uint32_t incode_gather_find(const struct incode_gather *g, uint32_t id)
{
    int32_t a = (int32_t)id;
    incode_vi all = {a, a, a, a, a, a, a, a, a, a, a, a, a, a, a, a};
    for (uint32_t i = 0; i < g->count; i += INCODE_VF_LANES) {
        uint32_t m = incode_vf_mask(
            *(const incode_vi *)(const void *)(g->id + i) == all);
        if (m != 0) {
            uint32_t found = i + (uint32_t)__builtin_ctz(m);
            return found < g->count ? found : INCODE_GATHER_NONE;
        }
    }
    return INCODE_GATHER_NONE;
}

uint32_t incode_gather_append(struct incode_gather *g, uint32_t id,
                              const double p[3])
{
    if (g->count == INCODE_AROUND_POINTS + INCODE_AROUND_EXTRA ||
        g->outer == INCODE_OUTER_END)
        return INCODE_GATHER_NONE;
    uint32_t i = g->count++;
    double r[3];
    g->id[i] = id;
    for (int d = 0; d < 3; d++)
        g->p[d][i] = p[d];
    incode_gather_relative(g, i, r);
    uint32_t k = g->outer++;
    g->x[k] = (float)r[0];
    g->y[k] = (float)r[1];
    g->z[k] = (float)r[2];
    g->at[k] = i;
    set_lengths(g, k, g->outer);
    return i;
}

/* ---- scans ---- */

#define PLANE_SLACK 1e-6F /* rounding of n . p, relative to |x|+|y|+|z| */

/* The best of each lane so far: numerator, denominator, index. */
struct lanes {
    incode_vf top, bottom;
    incode_vi which;
};

/* n: the plane; c: minus twice the circumcentre, and the weight of w. */
INCODE_INLINE void best_of(struct lanes *best, const struct incode_gather *g,
                           uint32_t i, const incode_vf n[3],
                           const incode_vf c[4], incode_vf slack)
{
    incode_vf x = incode_vf_load(g->x + i), y = incode_vf_load(g->y + i),
              z = incode_vf_load(g->z + i);
    incode_vf below = incode_vf_fma(n[0], x, incode_vf_fma(n[1], y, n[2] * z));
    incode_vf above = incode_vf_fma(
        c[0], x,
        incode_vf_fma(c[1], y,
                      incode_vf_fma(c[2], z, c[3] * incode_vf_load(g->w + i))));
    incode_vm better = incode_vf_less(slack * incode_vf_load(g->l + i), below) &
                       incode_vf_less(above * best->bottom, best->top * below);
    int32_t k = (int32_t)i;
    incode_vi here = {k, k, k, k, k, k, k, k, k, k, k, k, k, k, k, k};
    best->top = incode_vf_pick(better, above, best->top);
    best->bottom = incode_vf_pick(better, below, best->bottom);
    best->which = incode_vi_pick(better, here, best->which);
}

uint32_t incode_gather_first(const struct incode_gather *g, uint32_t from,
                             uint32_t to, const double n[3], const double m[3],
                             double nn)
{
    incode_vf normal[3], centre[4];
    double extent = incode_max_norm(n);
    double sn = incode_scale_for(extent), sm = incode_scale_for(nn);
    for (int d = 0; d < 3; d++) {
        normal[d] = incode_vf_all((float)(n[d] * sn));
        centre[d] = incode_vf_all((float)(-m[d] * sm));
    }
    centre[3] = incode_vf_all((float)(nn * sm));
    incode_vf slack = incode_vf_all((float)(extent * sn) * PLANE_SLACK);
    struct lanes a, b;
    a.top = b.top = incode_vf_all(0x1p60F);
    a.bottom = b.bottom = incode_vf_all(0x1p-40F);
    a.which = b.which = (incode_vi){-1, -1, -1, -1, -1, -1, -1, -1,
                                    -1, -1, -1, -1, -1, -1, -1, -1};
    for (uint32_t i = from; i < to; i += 2 * INCODE_VF_LANES) {
        best_of(&a, g, i, normal, centre, slack);
        best_of(&b, g, i + INCODE_VF_LANES, normal, centre, slack);
    }
    incode_vm better = incode_vf_less(a.top * b.bottom, b.top * a.bottom);
    incode_vf top = incode_vf_pick(better, a.top, b.top);
    incode_vf bottom = incode_vf_pick(better, a.bottom, b.bottom);
    incode_vi which = incode_vi_pick(better, a.which, b.which);
    uint32_t found = ~incode_vf_mask(which) & 0xffff;
    if (found == 0)
        return INCODE_GATHER_NONE;
    uint32_t lane = incode_vf_least(top / bottom, found);
    return g->at[(uint32_t)which[lane] + lane];
}

static float float_up(double a)
{
    return (float)a * (1 + 0x1p-22F);
}

uint32_t incode_gather_inside(const struct incode_gather *g, uint32_t from,
                              uint32_t to, const struct incode_sphere *s,
                              uint16_t out[INCODE_NEAR_ALL])
{
    /* One power of two for all coefficients keeps them in range. */
    double largest = incode_max_norm(s->m), det = __builtin_fabs(s->det);
    double scale = incode_scale_for(largest > det ? largest : det);
    /* Single precision: fewer than 16 roundings of 2^-24 on each term, beside
     * those of the coefficients themselves. */
    double slack =
        0x1p-20 * largest + INCODE_SPHERE_EPS * incode_max_norm(s->pm);
    double square = 0x1p-20 * det + INCODE_SPHERE_EPS * s->pdet - s->det;
    /* The last terms: what underflows in single precision. */
    incode_vf mx = incode_vf_all((float)(s->m[0] * scale)),
              my = incode_vf_all((float)(s->m[1] * scale)),
              mz = incode_vf_all((float)(s->m[2] * scale)),
              mw = incode_vf_all((float)(square * scale) + 1e-37F),
              ml = incode_vf_all(float_up(slack * scale) + 1e-37F),
              tiny = incode_vf_all(-1e-34F);
    uint64_t words[INCODE_NEAR_ALL / 64 + 1];
    words[from / 64] = 0;
    for (uint32_t i = from; i < to; i += INCODE_VF_LANES) {
        incode_vf value = incode_vf_fma(mx, incode_vf_load(g->x + i),
                                        my * incode_vf_load(g->y + i)) +
                          incode_vf_fma(mz, incode_vf_load(g->z + i),
                                        mw * incode_vf_load(g->w + i));
        value = incode_vf_fma(ml, incode_vf_load(g->l + i), value);
        uint64_t in = ~incode_vm_bits(incode_vf_less(value, tiny)) & 0xffff;
        if (i % 64 == 0)
            words[i / 64] = 0;
        words[i / 64] |= in << (i % 64);
    }
    uint32_t count = 0;
    for (uint32_t i = from; i < to; i += 64) {
        uint64_t word = words[i / 64];
        if (to - i < 64)
            word &= (UINT64_C(1) << (to - i)) - 1;
        for (; word != 0; word &= word - 1)
            out[count++] = (uint16_t)g->at[i + (uint32_t)__builtin_ctzll(word)];
    }
    return count;
}
