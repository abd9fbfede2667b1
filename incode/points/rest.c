#include "rest.h"

#include "incode/complex/sphere.h"
#include "incode/predicates/simd.h"

/* ---- the boxes ---- */

static void fill_up(struct incode_rest *rest)
{
    for (uint32_t i = rest->count; i % 8 != 0; i++)
        for (int d = 0; d < 3; d++) {
            rest->lo[d][i] = __builtin_inf();
            rest->hi[d][i] = -__builtin_inf();
        }
}

bool incode_rest_set(struct incode_rest *rest, struct incode_maker *maker,
                     uint32_t brick)
{
    const struct incode_tree *tree = &maker->tree;
    uint32_t first = brick; /* of the rest, on the level below */
    double extent = 0;
    for (int d = 0; d < 3; d++) {
        double half = maker->hi[d] * 0.5 - maker->lo[d] * 0.5;
        extent = half > extent ? half : extent;
    }
    rest->scale = incode_scale_for(extent);
    rest->maker = maker;
    rest->count = 0;
    for (uint32_t level = 1; level < tree->levels; level++) {
        uint32_t page = first / INCODE_FANOUT;
        uint32_t end = page * INCODE_FANOUT + INCODE_FANOUT;
        end = end < tree->count[level - 1] ? end : tree->count[level - 1];
        if (first < end) {
            alignas(64) double lo[3][INCODE_FANOUT], hi[3][INCODE_FANOUT];
            const struct incode_frame *f =
                incode_pager_get(&maker->pager, tree->base[level] + page);
            if (f == NULL)
                return false;
            incode_boxes_axes(&f->page.boxes, lo, hi);
            for (; first < end; first++, rest->count++) {
                for (int d = 0; d < 3; d++) {
                    rest->lo[d][rest->count] = lo[d][first % INCODE_FANOUT];
                    rest->hi[d][rest->count] = hi[d][first % INCODE_FANOUT];
                }
                rest->page[rest->count] = tree->base[level - 1] + first;
            }
        }
        first = page + 1;
    }
    fill_up(rest);
    return true;
}

/* ---- a sphere, or a half-space ---- */

/* |p - o|^2 - X (p - o) < 0, or X (p - o) > 0, but for the errors of X. */
struct region {
    double o[3], x[3], error[3];
    double centre[3], square; /* of a ball that holds the sphere */
    bool infinite;
};

static void set_ball(struct region *r)
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

/* As the cell keeps it; false: nothing is known. */
static bool set_region(struct region *r, const struct incode_complex *x,
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

/* The same from its points, with bounds of the errors of each component. */
static bool set_sharp_region(struct region *r, const struct incode_complex *x,
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

static bool ball_reaches(const struct incode_rest *rest, const struct region *r)
{
    for (uint32_t i = 0; i < rest->count; i += INCODE_VD_LANES) {
        incode_vd zero = incode_vd_all(0), square = zero;
        for (int d = 0; d < 3; d++) {
            incode_vd c = incode_vd_all(r->centre[d]);
            incode_vd gap = incode_vd_max(incode_vd_load(rest->lo[d] + i) - c,
                                          c - incode_vd_load(rest->hi[d] + i));
            gap = incode_vd_max(gap, zero);
            square = incode_vd_fma(gap, gap, square);
        }
        if (incode_vdm_bits(incode_vd_less(incode_vd_all(r->square), square)) !=
            INCODE_VD_ALL)
            return true;
    }
    return false;
}

/* Whether a box reaches to or beyond a facet's plane. */
static bool box_is_beyond(const struct region *r, const double lo[3],
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

bool incode_rest_reaches(const struct incode_rest *rest,
                         const struct incode_complex *x,
                         const struct incode_cell *c)
{
    struct region r;
    if (rest->count == 0)
        return false;
    if (!set_region(&r, x, c))
        return true;
    if (!r.infinite)
        return ball_reaches(rest, &r);
    for (uint32_t i = 0; i < rest->count; i++) {
        const double lo[3] = {rest->lo[0][i], rest->lo[1][i], rest->lo[2][i]};
        const double hi[3] = {rest->hi[0][i], rest->hi[1][i], rest->hi[2][i]};
        if (box_is_beyond(&r, lo, hi))
            return true;
    }
    return false;
}

/* ---- all boxes ---- */

static bool ball_meets(const struct region *r, const double lo[3],
                       const double hi[3])
{
    double square = 0;
    for (int d = 0; d < 3; d++) {
        double a = lo[d] - r->centre[d], b = r->centre[d] - hi[d];
        double gap = a > b ? a : b;
        square += gap > 0 ? gap * gap : 0;
    }
    return !(square > r->square);
}

/* Whether a child's lifted box may hold a point of the region (boxes.h): D is 1
 * for a sphere, 0 for a half-space. */
static bool lifted_meets(const struct region *r,
                         const struct incode_boxes *boxes, unsigned child)
{
    struct incode_lifted l;
    if (!incode_boxes_lifted(boxes, child, &l))
        return true;
    double unit = boxes->unit, d = r->infinite ? 0 : 1, lid = unit * unit * d;
    double radius = unit * l.radius, far[3], y[3], g[3];
    double value = lid * l.lid, slack = 0x1p-900, spread = 0;
    for (int k = 0; k < 3; k++) {
        double at = boxes->origin[k] + unit * l.o[k];
        double rounding =
            0x1p-50 * (__builtin_fabs(at) + __builtin_fabs(boxes->origin[k]) +
                       __builtin_fabs(r->o[k]));
        y[k] = at - r->o[k];
        g[k] = 2 * d * y[k] - r->x[k];
        far[k] = __builtin_fabs(y[k]) + radius;
        value += d * y[k] * y[k] - r->x[k] * y[k];
        /* Of X, of y, and of the sum. */
        slack += r->error[k] * far[k] +
                 rounding * (__builtin_fabs(g[k]) + 2 * d * radius) +
                 0x1p-48 * far[k] * (d * far[k] + __builtin_fabs(r->x[k])) +
                 /* What the box does not hold of the points. */
                 0x1p-19 * radius * (__builtin_fabs(g[k]) + d * radius);
    }
    for (int k = 0; k < 3; k++) {
        double along = g[0] * l.a[k][0] + g[1] * l.a[k][1] + g[2] * l.a[k][2];
        spread += __builtin_fabs(unit * along + lid * l.slope[k]);
    }
    return !(value - spread > slack);
}

/* Whether the region may hold a point of a page's child from `first` on. */
static bool page_meets(const struct incode_rest *rest, const struct region *r,
                       uint32_t level, uint32_t index);

static bool child_meets(const struct incode_rest *rest, const struct region *r,
                        const struct incode_boxes *boxes, uint32_t level,
                        uint32_t child, const double lo[3], const double hi[3])
{
    if (r->infinite ? !box_is_beyond(r, lo, hi) : !ball_meets(r, lo, hi))
        return false;
    if (!lifted_meets(r, boxes, child % INCODE_FANOUT))
        return false;
    return level == 1 || page_meets(rest, r, level - 1, child);
}

/* Page `index` of a level of boxes. */
static bool page_meets(const struct incode_rest *rest, const struct region *r,
                       uint32_t level, uint32_t index)
{
    const struct incode_tree *tree = &rest->maker->tree;
    const struct incode_frame *f =
        incode_pager_get(&rest->maker->pager, tree->base[level] + index);
    if (f == NULL)
        return true;
    alignas(64) double lo[3][INCODE_FANOUT], hi[3][INCODE_FANOUT];
    const struct incode_boxes boxes = f->page.boxes;
    uint32_t first = index * INCODE_FANOUT;
    uint32_t count = tree->count[level - 1] - first;
    count = count < INCODE_FANOUT ? count : INCODE_FANOUT;
    incode_boxes_axes(&boxes, lo, hi);
    for (uint32_t i = 0; i < count; i++) {
        const double from[3] = {lo[0][i], lo[1][i], lo[2][i]};
        const double to[3] = {hi[0][i], hi[1][i], hi[2][i]};
        if (child_meets(rest, r, &boxes, level, first + i, from, to))
            return true;
    }
    return false;
}

bool incode_rest_looks(const struct incode_rest *rest,
                       const struct incode_complex *x,
                       const struct incode_cell *c)
{
    const struct incode_tree *tree = &rest->maker->tree;
    struct region r;
    if (!set_sharp_region(&r, x, c, rest->scale))
        return rest->count > 0;
    for (uint32_t i = 0; i < rest->count; i++) {
        const double lo[3] = {rest->lo[0][i], rest->lo[1][i], rest->lo[2][i]};
        const double hi[3] = {rest->hi[0][i], rest->hi[1][i], rest->hi[2][i]};
        uint32_t level = incode_tree_level(tree, rest->page[i]);
        uint32_t index = rest->page[i] - tree->base[level];
        if (r.infinite ? !box_is_beyond(&r, lo, hi) : !ball_meets(&r, lo, hi))
            continue;
        if (level == 0 || page_meets(rest, &r, level, index))
            return true;
    }
    return false;
}
