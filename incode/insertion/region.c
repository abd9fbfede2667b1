#include <string.h>

#include "insertion.h"
#include "incode/complex/cavity.h"
#include "incode/apex/sphere.h"
#include "incode/predicates/simd.h"
#include "incode/front/job.h"

/* A planted fault leaves out one of these bounds; a test must find it. */
#ifndef INCODE_PLANT_BOUND
#define INCODE_PLANT_BOUND(name, value) (value)
#endif

/* All bounds here are of F(p) = D |p - o|^2 - X (p - o), D = 1 for a sphere and
 * 0 for a half-space, where X is known up to |x - X| <= e, component by
 * component; u = 2^-53.  A box is ruled out only if F > 0 is certain for all
 * its points.  So a point with F = 0, which the tie rule may count as inside,
 * is never ruled out. */

/* The ball's centre c is o + x/2, rounded.  For p in the sphere
 *
 *   |p - c| <= |X|/2 + |X - x|/2 + u (|o|_1 + |x|_1)
 *           <= |x|/2 + |e|_1 + u |o|_1 + 4 u |x|/2,
 *
 * as |X| <= |x| + |e| and |x|_1 < 2 |x|.  The root and the sums below lose 5 u
 * of the radius, its square and that of the gap in clear_of 6 u, thus 3 u of
 * the radius.  That is below 2^-48 = 32 u of radius and |o|_1.  Squares that
 * lose digits are below 2^-1020: with 2^-450, the radius is right where |x| is
 * so small, and no gap is compared with less than 2^-900. */
static void set_ball(struct incode_region *r) {
    double square = 0, size = 0, error = 0;
    for (int d = 0; d < 3; d++) {
        r->centre[d] = r->o[d] + 0.5 * r->x[d];
        square += r->x[d] * r->x[d];
        size += __builtin_fabs(r->o[d]);
        error += r->error[d];
    }
    double radius = 0.5 * __builtin_sqrt(square) +
                    INCODE_PLANT_BOUND(BALL_ERROR, error) +
                    INCODE_PLANT_BOUND(BALL_UNDERFLOW, 0x1p-450);
    radius += INCODE_PLANT_BOUND(BALL_ROUNDING, 0x1p-48) * (radius + size);
    r->square = radius * radius;
}

/* X is kept as whole multiples of S, each wrong by at most S/2 + S/16
 * (incode/complex/cavity.h), which is nine tenths of 5/8 S; the product with S,
 * a power of two, is exact. */
bool incode_region_set(struct incode_region *r, const struct incode_complex *x,
                       const struct incode_cell *c) {
    double scale = incode_sphere_scale(c);
    r->infinite = incode_sphere_is_infinite(c);
    for (int d = 0; d < 3; d++) {
        r->o[d] = x->point[c->v[3]].p[d];
        r->x[d] = incode_sphere_whole(c, d) * scale;
        r->error[d] = INCODE_PLANT_BOUND(WHOLE, 0.625) * scale;
    }
    set_ball(r);
    return scale < 0x1p300;
}

void incode_region_set_all(struct incode_region *r) {
    memset(r, 0, sizeof *r);
    for (int d = 0; d < 3; d++)
        r->error[d] = __builtin_inf();
    r->square = __builtin_inf();
}

/* X = M / det, both divided by the scale.  With E = INCODE_SPHERE_EPS, which is
 * more than 32 u, m is wrong by at most 20 u b and the determinant by 20 u p,
 * or 5/8 of lost = E p / det, by its part of det; b >= |m| and p >= det are the
 * bounds of incode/apex/sphere.h.  So
 *
 *   |m / det - M / DET| <= (20 u b + 5/8 lost |m|) / (det (1 - lost)),
 *
 * with lost < 2^-10, and unit and the product are wrong by 2 u |m / det| more.
 * The first term of the error has 12 u b to spare, of which 1 u b go into 1 -
 * lost, 2 u |m| into these roundings and 8 u b into that of the error itself;
 * the second is three times as large as it need be.  In an infinite cell X is
 * the facet's normal, unit a power of two, and what is lost 0. */
bool incode_region_set_sharp(struct incode_region *r,
                             const struct incode_complex *x,
                             const struct incode_cell *c, double scale) {
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
            (INCODE_PLANT_BOUND(SHARP_SPHERE, INCODE_SPHERE_EPS * bound) +
             INCODE_PLANT_BOUND(SHARP_DETERMINANT,
                                2 * lost * __builtin_fabs(m))) *
            unit;
    }
    set_ball(r);
    return true;
}

/* The most of X (p - o) in the box is the sum of the larger products with its
 * sides a = lo - o and b = hi - o.  Each is wrong by at most e max(|a|, |b|)
 * for X, u |x| max(|a|, |b|) for the difference and as much for the product;
 * the sums add 2 u of all, in all 4 u.  e has a tenth or more to spare (above),
 * which covers the doubt's own rounding.  Each product may lose 2^-1075 to
 * underflow. */
bool incode_region_is_behind(const struct incode_region *r, const double lo[3],
                             const double hi[3]) {
    double most = 0, doubt = INCODE_PLANT_BOUND(BEHIND_UNDERFLOW, 0x1p-900);
    for (int d = 0; d < 3; d++) {
        double a = lo[d] - r->o[d], b = hi[d] - r->o[d];
        most += r->x[d] > 0 ? r->x[d] * b : r->x[d] * a;
        a = __builtin_fabs(a);
        b = __builtin_fabs(b);
        doubt += (INCODE_PLANT_BOUND(BEHIND_ERROR, r->error[d]) +
                  INCODE_PLANT_BOUND(BEHIND_ROUNDING,
                                     0x1p-48 * __builtin_fabs(r->x[d]))) *
                 (a > b ? a : b);
    }
    return !(most < -doubt);
}

void incode_regions_set(struct incode_regions *regions, unsigned i,
                        const struct incode_region *r) {
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
                         const double lo[3], const double hi[3]) {
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

/* The same for a plane with all of the box in front: incode_region_is_behind.
 */
static uint32_t before(const struct incode_regions *r, unsigned i,
                       const double lo[3], const double hi[3]) {
    incode_vd most = incode_vd_all(0);
    incode_vd doubt =
        INCODE_PLANT_BOUND(BEFORE_UNDERFLOW, incode_vd_all(0x1p-900));
    for (int d = 0; d < 3; d++) {
        incode_vd o = incode_vd_load(r->o[d] + i);
        incode_vd x = incode_vd_load(r->x[d] + i);
        incode_vd a = incode_vd_all(lo[d]) - o, b = incode_vd_all(hi[d]) - o;
        most += incode_vd_max(x * a, x * b);
        doubt +=
            (INCODE_PLANT_BOUND(BEFORE_ERROR, incode_vd_load(r->error[d] + i)) +
             INCODE_PLANT_BOUND(BEFORE_ROUNDING,
                                incode_vd_all(0x1p-48) * incode_vd_abs(x))) *
            incode_vd_max(incode_vd_abs(a), incode_vd_abs(b));
    }
    return incode_vdm_bits(incode_vd_less(most, -doubt));
}

uint64_t incode_regions_meeting(const struct incode_regions *r, uint64_t some,
                                const double lo[3], const double hi[3]) {
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

/* As clear_of and before have it, of boxes that are points. */
uint64_t incode_regions_points(const struct incode_regions *r, unsigned i,
                               const struct incode_brick *brick) {
    const double *const p[3] = {brick->x, brick->y, brick->z};
    bool infinite = (r->infinite >> i & 1) != 0;
    const double(*from)[INCODE_REGIONS] = infinite ? r->o : r->centre;
    uint64_t held = 0;
    for (unsigned k = 0; k < INCODE_BRICK_POINTS; k += INCODE_VD_LANES) {
        incode_vd sum = incode_vd_all(0);
        incode_vd most =
            INCODE_PLANT_BOUND(POINTS_UNDERFLOW, incode_vd_all(-0x1p-900));
        for (int d = 0; d < 3; d++) {
            incode_vd a = incode_vd_load(p[d] + k) - incode_vd_all(from[d][i]);
            incode_vd x = incode_vd_all(r->x[d][i]);
            double error =
                INCODE_PLANT_BOUND(POINTS_ERROR, r->error[d][i]) +
                INCODE_PLANT_BOUND(POINTS_ROUNDING,
                                   0x1p-48 * __builtin_fabs(r->x[d][i]));
            sum += infinite ? x * a : a * a;
            most -= incode_vd_all(error) * incode_vd_abs(a);
        }
        incode_vdm off = infinite
                             ? incode_vd_less(sum, most)
                             : incode_vd_less(incode_vd_all(r->square[i]), sum);
        held |= (uint64_t)(~incode_vdm_bits(off) & INCODE_VD_ALL) << k;
    }
    return held;
}

struct box {
    double at[3], size[3]; /* its centre, and of what that is rounded */
    double a[3][3], slope[3], lid, radius;
};

/* A point of the box is p = at + q with q = sum(s_k a_k) + rest, |s_k| <= 1 and
 * |rest| <= 2^-20 radius, and |q|^2 >= lid + sum(s_k slope_k) (boxes.h).  With
 * y = at - o and g = 2 D y - X, F(p) = (D y - X) y + g q + D |q|^2, thus
 *
 *   F(p) >= (D y - X) y + D lid - sum |g a_k + D slope_k| - |g| |rest|.
 *
 * Component by component, with far = |y| + radius >= |y + q| and wide = size +
 * |o| + radius >= far:
 * - X (y + q) is wrong by e far;
 * - at and y are rounded by u (|at| + |y|) <= 2 u wide, and F falls along that
 *   by at most |g + 2 D q| <= 2 D far + |x| (its second-order part, D times a
 *   square, is not negative): 4 u wide (D far + |x|);
 * - products and sums of (D y - X) y lose at most 6 u far (D far + |x|), those
 * of lid and slopes, which are below 4 times the square of the box's half side
 *   and that below radius^2, 60 u D radius^2 over all three components: with
 *   the last, 30 u wide (D far + |x|), and 2^-48 is 32 u;
 * - |g| |rest| <= 2^-20 radius |g|_1; as much again covers the roundings of g
 * and g a_k, 7 u radius (|g| + D radius). What underflows is below 2^-1070. */
static uint32_t clear_of_lifted(const struct incode_regions *r, unsigned i,
                                const struct box *b) {
    incode_vd zero = incode_vd_all(0), g[3];
    incode_vd d = incode_vd_load(r->round + i);
    incode_vd radius = incode_vd_all(b->radius);
    incode_vd value = incode_vd_all(b->lid) * d;
    incode_vd spread = zero;
    incode_vd slack =
        INCODE_PLANT_BOUND(LIFTED_UNDERFLOW, incode_vd_all(0x1p-900));
    for (int k = 0; k < 3; k++) {
        incode_vd o = incode_vd_load(r->o[k] + i);
        incode_vd x = incode_vd_load(r->x[k] + i);
        incode_vd y = incode_vd_all(b->at[k]) - o;
        incode_vd far = incode_vd_abs(y) + radius;
        incode_vd wide = incode_vd_all(b->size[k]) + incode_vd_abs(o) + radius;
        g[k] = incode_vd_all(2) * d * y - x;
        incode_vd steep = incode_vd_abs(g[k]);
        value += (d * y - x) * y;
        slack +=
            INCODE_PLANT_BOUND(LIFTED_ERROR,
                               incode_vd_load(r->error[k] + i) * far) +
            INCODE_PLANT_BOUND(LIFTED_ROUNDING,
                               incode_vd_all(0x1p-48) * wide *
                                   (d * far + incode_vd_abs(x))) +
            INCODE_PLANT_BOUND(LIFTED_REST, incode_vd_all(0x1p-19) * radius *
                                                (steep + d * radius));
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
                                       const struct incode_lifted *l) {
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

/* What is final goes out: tetrahedra by the vertex that owns them, then the
 * bricks at whose points no cell is left. */

enum {
    EMIT_A_UNIT = 8,   /* tetrahedra, of what a step may work */
    EMIT_A_BREATH = 2, /* of incode/predicates/yield.h */
    FETCHED = 32,      /* lists, side by side */
    FETCHED_MOST = 8,  /* of each, cells that come first */
    AT_ONCE = 16       /* points or cells between two yields */
};

/* Which of a cell's vertices is the smallest, whose brick owns it. */
static unsigned owner_of(const struct incode_complex *x,
                         const struct incode_cell *c) {
    const double *const p[4] = {x->point[c->v[0]].p, x->point[c->v[1]].p,
                                x->point[c->v[2]].p, x->point[c->v[3]].p};
    return incode_smallest(p);
}

static bool is_own(const struct incode_insertion *n, uint32_t id) {
    uint32_t brick = id / INCODE_BRICK_POINTS;
    return brick >= n->own_first && brick < n->own_last;
}

/* No point has a cell. */
static void forget_cells(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    for (uint32_t v = 0; v < x->points; v++) {
        if (v % AT_ONCE == 0)
            incode_maker_yield(n->maker, 1);
        x->point[v].cell = INCODE_NONE;
    }
}

/* Leaves a cell at each vertex of an own brick that has not been taken in, so
 * that it is known as one when it is. */
static void keep_pending(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    uint32_t from = n->from * INCODE_BRICK_POINTS;
    uint32_t pending = n->own_last * INCODE_BRICK_POINTS - from;
    forget_cells(n);
    for (unsigned pass = 0; pass < 2; pass++)
        for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < x->cells; i++) {
            struct incode_cell *c = incode_complex_cell(x, i);
            bool kept = incode_cell_proved(c) == 0;
            if (i % AT_ONCE == 0)
                incode_maker_yield(n->maker, AT_ONCE / 4);
            if (incode_cell_is_free(c) || kept != (pass == 0))
                continue;
            for (unsigned k = 0; k < 4 && pass == 1; k++)
                kept = kept || (x->point[c->v[k]].cell == INCODE_NONE &&
                                x->point[c->v[k]].id - from < pending);
            for (unsigned k = 0; k < 4 && kept; k++)
                x->point[c->v[k]].cell = i;
            if (kept)
                incode_cell_set_proved(c, 0);
        }
}

/* From now on points' `cell` is the first of what they own. */
void incode_insertion_begin_list(struct incode_insertion *n) {
    if (n->shown)
        keep_pending(n);
    forget_cells(n);
    n->cell = INCODE_COMPLEX_CELLS_FIRST;
    n->emitted = true;
    n->stage = INCODE_INSERTION_LIST;
}

/* Leaves a cell to those who know others' points. */
static void leave(struct incode_insertion *n, const struct incode_cell *c) {
    const struct incode_complex *x = &n->complex;
    uint32_t v[4];
    for (unsigned i = 0; i < 4; i++)
        v[i] = c->v[i] == INCODE_COMPLEX_INFINITE ? INCODE_NONE
                                                  : x->point[c->v[i]].id;
    n->outside.left(n->outside.context, v);
    n->left += !incode_cell_is_infinite(c);
}

/* Lists some final tetrahedra by the vertex that owns them; the triangulation
 * is set right when they are released. */
enum incode_step incode_insertion_list(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    uint32_t end = x->cells - n->cell < INCODE_INSERTION_CELLS
                       ? x->cells
                       : n->cell + INCODE_INSERTION_CELLS;
    incode_maker_yield(n->maker, INCODE_INSERTION_CELLS / 4);
    for (; n->cell < end; n->cell++) {
        struct incode_cell *c = incode_complex_cell(x, n->cell);
        if (incode_cell_is_free(c) || incode_cell_proved(c) == 0)
            continue;
        if (n->apart && incode_cell_proved(c) != INCODE_CELL_FINAL) {
            leave(n, c);
            continue;
        }
        if (incode_cell_is_infinite(c))
            continue;
        struct incode_complex_point *owner = &x->point[c->v[owner_of(x, c)]];
        if (!is_own(n, owner->id))
            continue;
        incode_cell_join(c, 0, owner->cell);
        owner->cell = n->cell;
    }
    if (n->cell < x->cells)
        return INCODE_WORKED;
    n->v = n->fetched = 1;
    n->stage = INCODE_INSERTION_EMIT;
    return INCODE_WORKED;
}

/* The vertices of a cell after v, so that all have positive orientation. */
static void apexes_of(const struct incode_complex *x,
                      const struct incode_cell *c, uint32_t v,
                      uint32_t apexes[3]) {
    static const uint8_t EVEN[4][3] = {
        {1, 2, 3}, {0, 3, 2}, {3, 0, 1}, {2, 1, 0}};
    const uint8_t *others = EVEN[incode_cell_index(c, v)];
    for (unsigned k = 0; k < 3; k++)
        apexes[k] = x->point[c->v[others[k]]].id;
}

/* The next cell of such a list. */
static uint32_t next_of(const struct incode_cell *c) {
    uint32_t next = c->n[0].cell;
    return next == INCODE_CELL_NONE ? INCODE_NONE : next;
}

/* Emits tetrahedra of v, as far as there is room for them. */
static enum incode_step emit_some(struct incode_insertion *n,
                                  struct incode_complex_point *v) {
    const struct incode_complex *x = &n->complex;
    size_t room = n->outside.emit_room(n->outside.context), count = 0;
    if (room == 0)
        return INCODE_WAITING;
    if (room > INCODE_INSERTION_EMITTED)
        room = INCODE_INSERTION_EMITTED;
    for (; v->cell != INCODE_NONE && count < room; count++) {
        const struct incode_cell *c = incode_complex_cell(x, v->cell);
        v->cell = next_of(c);
        apexes_of(x, c, n->v, n->apexes[count]);
    }
    n->outside.emit(n->outside.context, v->id, (const uint32_t(*)[3])n->apexes,
                    count);
    n->kept += count;
    incode_maker_yield(n->maker, (uint32_t)count / EMIT_A_BREATH);
    incode_walker_spend(&n->maker->walker, (uint32_t)count / EMIT_A_UNIT);
    return INCODE_WORKED;
}

/* The lists of the points from v on come into the cache, all at a time: one
 * after the other, each cell waits for the one before it, a fifth of a node's
 * time on uniform points. */
static void fetch(const struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    uint32_t next[FETCHED], count = 0, end = x->points - n->v;
    incode_maker_yield(n->maker, FETCHED * FETCHED_MOST / 8);
    for (uint32_t i = 0; i < FETCHED && i < end; i++) {
        next[count] = x->point[n->v + i].cell;
        if (next[count] == INCODE_NONE)
            continue;
        __builtin_prefetch(incode_complex_cell(x, next[count]));
        count++;
    }
    for (unsigned round = 1; round < FETCHED_MOST && count > 0; round++) {
        uint32_t left = 0;
        for (uint32_t i = 0; i < count; i++) {
            next[left] = incode_complex_cell(x, next[i])->n[0].cell;
            if (next[left] == INCODE_CELL_NONE)
                continue;
            __builtin_prefetch(incode_complex_cell(x, next[left]));
            left++;
        }
        count = left;
    }
}

enum incode_step incode_insertion_emit(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    if (n->v >= n->fetched) {
        fetch(n);
        n->fetched = n->v + FETCHED;
    }
    for (; n->v < x->points && n->v < n->fetched; n->v++)
        if (x->point[n->v].cell != INCODE_NONE)
            return emit_some(n, &x->point[n->v]);
    if (n->v == x->points)
        n->stage = INCODE_INSERTION_RELEASE;
    return INCODE_WORKED;
}

/* Releases what has been emitted. */
enum incode_step incode_insertion_release(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    uint32_t words = (n->maker->tree.bricks + 63) / 64, latest = 0;
    uint32_t free = x->free_count;
    incode_complex_release(x, &n->maker->counts.tally.yield);
    if (free == x->free_count && !n->closed)
        return INCODE_FULL; /* all of it is kept for bricks to come */
    memset(n->touched, 0, words * sizeof *n->touched);
    for (uint32_t v = 1; v < x->points; v++) {
        uint32_t id = x->point[v].id;
        if (v % AT_ONCE == 0)
            incode_maker_yield(n->maker, 1);
        if (!incode_complex_is_vertex(x, v))
            continue;
        incode_insertion_set_bit(n->touched, id / INCODE_BRICK_POINTS);
        if (id >= latest) {
            latest = id;
            n->near = v;
        }
    }
    n->brick = n->own_first;
    n->stage = INCODE_INSERTION_COMMIT;
    return INCODE_WORKED;
}

static bool is_half_full(const struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    return incode_complex_cells_used(x) * sizeof *x->cell > x->bytes / 2;
}

/* Commits the bricks at whose points no cell is left. */
enum incode_step incode_insertion_commit(struct incode_insertion *n) {
    for (; n->brick < n->from; n->brick++) {
        if (n->brick % AT_ONCE == 0)
            incode_maker_yield(n->maker, 1);
        if ((n->touched[n->brick / 64] >> n->brick % 64 & 1) != 0 ||
            incode_insertion_has_committed(n, n->brick))
            continue;
        if (n->outside.emit_room(n->outside.context) == 0)
            return INCODE_WAITING;
        incode_maker_yield(n->maker, 1);
        incode_insertion_set_bit(n->committed, n->brick);
        n->outside.commit(n->outside.context, n->brick);
    }
    /* What boxes told has made room for a thorough look. */
    n->thorough = !n->shown && (n->from == n->own_last || is_half_full(n));
    if (n->closed)
        n->stage = INCODE_INSERTION_DONE;
    else if (n->thorough)
        n->stage = INCODE_INSERTION_REST;
    else if (n->from < n->to) /* in the midst of some bricks */
        incode_insertion_take_in(n);
    else
        n->stage = INCODE_INSERTION_CHOOSE;
    return INCODE_WORKED;
}
