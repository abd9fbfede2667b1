#include "region.h"

#include <string.h>

#include "incode/complex/sphere.h"
#include "incode/maker/sphere.h"
#include "incode/predicates/simd.h"

static void set_ball(struct incode_region *r)
{
    double square = 0, size = 0, error = 0;
    for (int d = 0; d < 3; d++) {
        r->centre[d] = r->o[d] + 0.5 * r->x[d];
        square += r->x[d] * r->x[d];
        size += __builtin_fabs(r->o[d]);
        error += r->error[d];
    }
    /* Squares below 2^-900 may have lost digits. */
    double radius = 0.5 * __builtin_sqrt(square) + error + 0x1p-450;
    radius += 0x1p-48 * (radius + size);
    r->square = radius * radius * (1 + 0x1p-48);
}

bool incode_region_set(struct incode_region *r, const struct incode_complex *x,
                       const struct incode_cell *c)
{
    double scale = incode_sphere_scale(c);
    r->infinite = incode_sphere_is_infinite(c);
    for (int d = 0; d < 3; d++) {
        r->o[d] = x->point[c->v[3]].p[d];
        r->x[d] = incode_sphere_whole(c, d) * scale;
        r->error[d] = 0.625 * scale; /* sphere.h */
    }
    set_ball(r);
    return scale < 0x1p300;
}

void incode_region_set_all(struct incode_region *r)
{
    memset(r, 0, sizeof *r);
    for (int d = 0; d < 3; d++)
        r->error[d] = __builtin_inf();
    r->square = __builtin_inf();
}

bool incode_region_set_sharp(struct incode_region *r,
                             const struct incode_complex *x,
                             const struct incode_cell *c, double scale)
{
    struct incode_sphere s;
    const double *o = x->point[c->v[3]].p;
    double p[3][3];
    unsigned k = incode_cell_index(c, INCODE_COMPLEX_INFINITE);
    r->infinite = k < 4;
    /* As seen from v[3]: the three others in their order, or the two finite
     * ones, so that orient3d is positive with the last or the infinite one. */
    static const uint8_t ORDER[4][3] = {
        {2, 1, 0}, {0, 2, 1}, {1, 0, 2}, {1, 0, 2}};
    for (unsigned i = 0; i < 3; i++) {
        const double *q = x->point[c->v[ORDER[k < 4 ? k : 3][i]]].p;
        for (int d = 0; d < 3; d++)
            p[i][d] = (q[d] - o[d]) * scale;
    }
    incode_sphere_plane(&s, p[0], p[1]);
    if (r->infinite && incode_plane_is_ill_conditioned(&s))
        incode_sphere_refine(&s, o, x->point[c->v[ORDER[k][0]]].p,
                             x->point[c->v[ORDER[k][1]]].p, NULL, scale);
    if (!r->infinite) {
        incode_sphere_apex(&s, p[0], p[1], p[2]);
        if (incode_sphere_is_ill_conditioned(&s))
            incode_sphere_refine(&s, o, x->point[c->v[ORDER[3][0]]].p,
                                 x->point[c->v[ORDER[3][1]]].p,
                                 x->point[c->v[ORDER[3][2]]].p, scale);
    }
    double det = r->infinite ? 1 : s.det, unit = 1 / (det * scale);
    double lost = r->infinite ? 0 : INCODE_SPHERE_EPS * s.pdet / det;
    if (!(det > 0) || !(lost < 0x1p-10) || !(scale < 0x1p400) ||
        !(scale > 0x1p-400))
        return false; /* or products and squares overflow */
    for (int d = 0; d < 3; d++) {
        double m = r->infinite ? s.n[d] : s.m[d];
        double bound = r->infinite ? s.pn[d] : s.pm[d];
        r->o[d] = o[d];
        r->x[d] = m * unit;
        r->error[d] =
            (INCODE_SPHERE_EPS * bound + 2 * lost * __builtin_fabs(m) +
             0x1p-50 * __builtin_fabs(m)) *
            unit;
    }
    set_ball(r);
    return true;
}

bool incode_region_is_behind(const struct incode_region *r, const double lo[3],
                             const double hi[3])
{
    double most = 0, doubt = 0x1p-900; /* more than what underflows */
    for (int d = 0; d < 3; d++) {
        double a = lo[d] - r->o[d], b = hi[d] - r->o[d];
        most += r->x[d] > 0 ? r->x[d] * b : r->x[d] * a;
        a = __builtin_fabs(a);
        b = __builtin_fabs(b);
        doubt +=
            (r->error[d] + 0x1p-48 * __builtin_fabs(r->x[d])) * (a > b ? a : b);
    }
    return !(most < -doubt);
}

void incode_regions_set(struct incode_regions *regions, unsigned i,
                        const struct incode_region *r)
{
    uint64_t bit = UINT64_C(1) << i;
    for (int d = 0; d < 3; d++) {
        regions->o[d][i] = r->o[d];
        regions->x[d][i] = r->x[d];
        regions->error[d][i] = r->error[d];
        regions->centre[d][i] = r->centre[d];
    }
    regions->square[i] = r->square;
    regions->round[i] = r->infinite ? 0 : 1;
    regions->infinite = (regions->infinite & ~bit) | (r->infinite ? bit : 0);
}

/* Bits of those of some regions whose balls are clear of a box. */
static uint32_t clear_of(const struct incode_regions *r, unsigned i,
                         const double lo[3], const double hi[3])
{
    incode_vd zero = incode_vd_all(0), square = zero;
    for (int d = 0; d < 3; d++) {
        incode_vd c = incode_vd_load(r->centre[d] + i);
        incode_vd gap =
            incode_vd_max(incode_vd_all(lo[d]) - c, c - incode_vd_all(hi[d]));
        gap = incode_vd_max(gap, zero);
        square += gap * gap;
    }
    return incode_vdm_bits(
        incode_vd_less(incode_vd_load(r->square + i), square));
}

/* The same of planes that the box is all before. */
static uint32_t before(const struct incode_regions *r, unsigned i,
                       const double lo[3], const double hi[3])
{
    incode_vd most = incode_vd_all(0), doubt = incode_vd_all(0x1p-900);
    for (int d = 0; d < 3; d++) {
        incode_vd o = incode_vd_load(r->o[d] + i);
        incode_vd x = incode_vd_load(r->x[d] + i);
        incode_vd a = incode_vd_all(lo[d]) - o, b = incode_vd_all(hi[d]) - o;
        most += incode_vd_max(x * a, x * b);
        doubt += (incode_vd_load(r->error[d] + i) +
                  incode_vd_all(0x1p-48) * incode_vd_abs(x)) *
                 incode_vd_max(incode_vd_abs(a), incode_vd_abs(b));
    }
    return incode_vdm_bits(incode_vd_less(most, -doubt));
}

uint64_t incode_regions_meeting(const struct incode_regions *r, uint64_t some,
                                const double lo[3], const double hi[3])
{
    uint64_t met = 0;
    for (unsigned i = 0; i < INCODE_REGIONS; i += INCODE_VD_LANES) {
        uint32_t these = (uint32_t)(some >> i) & INCODE_VD_ALL;
        uint32_t half = (uint32_t)(r->infinite >> i) & INCODE_VD_ALL;
        if (these == 0)
            continue;
        uint32_t off = clear_of(r, i, lo, hi);
        if ((half & these) != 0)
            off = (off & ~half) | (before(r, i, lo, hi) & half);
        met |= (uint64_t)(these & ~off) << i;
    }
    return met;
}

struct box {
    double at[3], size[3]; /* its centre, and of what that is rounded */
    double a[3][3], slope[3], lid, radius;
};

/* boxes.h; D is 1 for a sphere, 0 for a half-space. */
static uint32_t clear_of_lifted(const struct incode_regions *r, unsigned i,
                                const struct box *b)
{
    incode_vd zero = incode_vd_all(0), g[3];
    incode_vd d = incode_vd_load(r->round + i);
    incode_vd radius = incode_vd_all(b->radius);
    incode_vd value = incode_vd_all(b->lid) * d;
    incode_vd slack = incode_vd_all(0x1p-900), spread = zero;
    for (int k = 0; k < 3; k++) {
        incode_vd o = incode_vd_load(r->o[k] + i);
        incode_vd x = incode_vd_load(r->x[k] + i);
        incode_vd rounding = incode_vd_all(0x1p-50) *
                             (incode_vd_all(b->size[k]) + incode_vd_abs(o));
        incode_vd y = incode_vd_all(b->at[k]) - o;
        incode_vd far = incode_vd_abs(y) + radius;
        g[k] = incode_vd_all(2) * d * y - x;
        incode_vd steep = incode_vd_abs(g[k]);
        value += (d * y - x) * y;
        /* Of X, of y, and of the sum. */
        slack += incode_vd_load(r->error[k] + i) * far +
                 rounding * (steep + incode_vd_all(2) * d * radius) +
                 incode_vd_all(0x1p-48) * far * (d * far + incode_vd_abs(x)) +
                 /* What the box does not hold of the points. */
                 incode_vd_all(0x1p-19) * radius * (steep + d * radius);
    }
    for (int k = 0; k < 3; k++) {
        incode_vd along = g[0] * incode_vd_all(b->a[k][0]) +
                          g[1] * incode_vd_all(b->a[k][1]) +
                          g[2] * incode_vd_all(b->a[k][2]);
        spread += incode_vd_abs(along + incode_vd_all(b->slope[k]) * d);
    }
    return incode_vdm_bits(incode_vd_less(slack, value - spread));
}

uint64_t incode_regions_meeting_lifted(const struct incode_regions *r,
                                       uint64_t some,
                                       const struct incode_boxes *boxes,
                                       const struct incode_lifted *l)
{
    double unit = boxes->unit;
    struct box b = {.lid = unit * unit * l->lid, .radius = unit * l->radius};
    uint64_t met = 0;
    for (int k = 0; k < 3; k++) {
        b.at[k] = boxes->origin[k] + unit * l->o[k];
        b.size[k] = __builtin_fabs(b.at[k]) + __builtin_fabs(boxes->origin[k]);
        b.slope[k] = unit * unit * l->slope[k];
        for (int j = 0; j < 3; j++)
            b.a[k][j] = unit * l->a[k][j];
    }
    for (unsigned i = 0; i < INCODE_REGIONS; i += INCODE_VD_LANES) {
        uint32_t these = (uint32_t)(some >> i) & INCODE_VD_ALL;
        if (these != 0)
            met |= (uint64_t)(these & ~clear_of_lifted(r, i, &b)) << i;
    }
    return met;
}
