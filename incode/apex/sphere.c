#include "sphere.h"

#include <stdalign.h>
#include <stddef.h>
#include <string.h>

#include "search.h"
#include "horizon.h"
#include "incode/predicates/simd.h"

/* What underflows in a determinant is lost to all points, however far. */
#define LOST 1e-290

void incode_sphere_plane(struct incode_sphere *s, const double b[3],
                         const double c[3]) {
    incode_cross(s->n, b, c);
    s->lb = incode_max_norm(b);
    s->lc = incode_max_norm(c);
    s->bb = incode_dot(b, b);
    s->cc = incode_dot(c, c);
    s->pn[0] = s->pn[1] = s->pn[2] = 2 * s->lb * s->lc + LOST;
    s->has_apex = false;
}

void incode_sphere_apex(struct incode_sphere *s, const double b[3],
                        const double c[3], const double a[3]) {
    double ca[3], ab[3];
    incode_cross(ca, c, a);
    incode_cross(ab, a, b);
    double aa = incode_dot(a, a), la = incode_max_norm(a);
    s->det = incode_dot(a, s->n);
    for (int d = 0; d < 3; d++)
        s->m[d] = s->bb * ca[d] + s->cc * ab[d] + aa * s->n[d];
    /* Each of the two products of a cross product is at most that of the
     * maximum norms; the determinant has three such pairs. */
    s->pm[0] = s->pm[1] = s->pm[2] =
        2 * (s->bb * s->lc * la + s->cc * la * s->lb + aa * s->lb * s->lc) +
        LOST * (1 + s->bb + s->cc + aa);
    s->pdet = 6 * la * s->lb * s->lc + LOST * (1 + la);
    s->has_apex = true;
}

/* ---- twice the precision ---- */

/* What is left: the roundings of the evaluation, at most 7 units on a term with
 * m or n, 8 on that with det, and 2^-100 of the old bounds.  As large as the
 * value itself, so that a bound overflows where a product does. */
static double refined(double value, double bound) {
    return __builtin_fabs(value) + 1e-15 * bound;
}

void incode_sphere_fine(struct incode_fine *f, const double v[3],
                        const double b[3], const double c[3], const double *a,
                        double scale) {
    struct incode_dd_vector rb = incode_dd_relative(b, v, scale),
                            rc = incode_dd_relative(c, v, scale);
    struct incode_dd_vector n = incode_dd_vector_product(rb.d, rc.d);
    memcpy(f->n, n.d, sizeof f->n);
    if (a == NULL)
        return;
    struct incode_dd_vector ra = incode_dd_relative(a, v, scale);
    struct incode_dd_vector ca = incode_dd_vector_product(rc.d, ra.d),
                            ab = incode_dd_vector_product(ra.d, rb.d);
    struct incode_dd squares[3] = {incode_dd_dot(rb.d, rb.d),
                                   incode_dd_dot(rc.d, rc.d),
                                   incode_dd_dot(ra.d, ra.d)};
    for (int k = 0; k < 3; k++) {
        struct incode_dd normals[3] = {ca.d[k], ab.d[k], n.d[k]};
        f->m[k] = incode_dd_dot(squares, normals);
    }
    f->det = incode_dd_dot(ra.d, n.d);
}

/* ---- bounds of each component ---- */

static void relative(double r[3], const double p[3], const double v[3],
                     double scale) {
    for (int d = 0; d < 3; d++)
        r[d] = (p[d] - v[d]) * scale;
}

/* Of the components of a cross product: the sum of its two products. */
static void cross_bound(double out[3], const double a[3], const double b[3]) {
    for (int d = 0; d < 3; d++) {
        int j = (d + 1) % 3, k = (d + 2) % 3;
        out[d] = __builtin_fabs(a[j] * b[k]) + __builtin_fabs(a[k] * b[j]);
    }
}

/* Bounds that tell the axes apart: where these have different scales, the
 * maximum norms are far too much. */
static void sharpen(struct incode_sphere *s, const double b[3],
                    const double c[3], const double *a) {
    double bc[3], ca[3], ab[3];
    cross_bound(bc, b, c);
    if (a == NULL) {
        for (int d = 0; d < 3; d++)
            s->pn[d] = bc[d] + LOST;
        return;
    }
    double aa = incode_dot(a, a), lost = LOST * (1 + s->bb + s->cc + aa);
    cross_bound(ca, c, a);
    cross_bound(ab, a, b);
    for (int d = 0; d < 3; d++)
        s->pm[d] = s->bb * ca[d] + s->cc * ab[d] + aa * bc[d] + lost;
    s->pdet = incode_absolute_dot(bc, a) + LOST * (1 + incode_max_norm(a));
}

void incode_sphere_refine(struct incode_sphere *s, const double v[3],
                          const double b[3], const double c[3], const double *a,
                          double scale) {
    struct incode_fine fine;
    double rb[3], rc[3], ra[3];
    relative(rb, b, v, scale);
    relative(rc, c, v, scale);
    if (a != NULL)
        relative(ra, a, v, scale);
    sharpen(s, rb, rc, a == NULL ? NULL : ra);
    if (!(a == NULL ? incode_plane_is_ill_conditioned(s)
                    : incode_sphere_is_ill_conditioned(s)))
        return;
    incode_sphere_fine(&fine, v, b, c, a, scale);
    for (int k = 0; k < 3; k++) {
        s->n[k] = fine.n[k].hi;
        s->pn[k] = refined(s->n[k], 2 * s->lb * s->lc + LOST);
    }
    if (a == NULL)
        return;
    for (int k = 0; k < 3; k++) {
        s->m[k] = fine.m[k].hi;
        s->pm[k] = refined(s->m[k], s->pm[k]);
    }
    s->det = fine.det.hi;
    s->pdet = refined(s->det, s->pdet);
}

/* --- empty spheres -------------------------------------------------------- */

/* Relative error of a sum of some numbers of twice the precision. */
#define FINE 1e-29

static struct incode_dd ratio(struct incode_dd a, struct incode_dd b) {
    struct incode_dd q = {a.hi / b.hi, 0}, r;
    double rest = incode_dd_minus(a, incode_dd_times(q, b)).hi / b.hi;
    r.hi = incode_fast_two_sum(q.hi, rest, &r.lo);
    return r;
}

/* False: too little is known of it. */
static bool circum_of(struct incode_circum *c, const double *const p[4],
                      double scale) {
    struct incode_near_degenerate degenerate;
    degenerate.known = degenerate.regular = false;
    degenerate.count = 0;
    incode_near_degenerate_sphere(&degenerate, p, scale);
    struct incode_dd det = degenerate.sphere.det;
    /* The spread bounds the errors of det and of m. */
    if (!(det.hi > 1e9 * degenerate.spread) || !(det.hi > INCODE_SPHERE_LEAST))
        return false;
    memcpy(c->p, p[0], sizeof c->p);
    c->scale = scale;
    for (int k = 0; k < 3; k++)
        c->twice[k] = ratio(degenerate.sphere.m[k], det);
    double size = incode_dd_max_norm(c->twice);
    c->error = 2 * degenerate.spread * (1 + size) / det.hi + FINE * size;
    double longest = 0, r[3];
    for (int i = 1; i < 4; i++) {
        for (int k = 0; k < 3; k++)
            r[k] = (p[i][k] - p[0][k]) * scale;
        double square = incode_dot(r, r);
        longest = square > longest ? square : longest;
    }
    c->thickness = det.hi / longest / scale;
    return c->error < 1e300;
}

/* Nearly the same sphere, as far as doubles can tell. */
static bool is_same(const struct incode_circum *a,
                    const struct incode_circum *b) {
    double gap[3], size = incode_dd_max_norm(a->twice) / a->scale;
    for (int k = 0; k < 3; k++)
        gap[k] = a->p[k] * 2 + a->twice[k].hi / a->scale - b->p[k] * 2 -
                 b->twice[k].hi / b->scale;
    return incode_max_norm(gap) < 1e-3 * size;
}

void incode_empty_spheres_add(struct incode_empty_spheres *e,
                              const double *const p[4], double scale) {
    struct incode_circum c;
    if (!circum_of(&c, p, scale))
        return;
    for (uint32_t i = 0; i < e->count; i++) {
        if (!is_same(&c, &e->sphere[i]))
            continue;
        if (c.thickness > e->sphere[i].thickness)
            e->sphere[i] = c;
        return;
    }
    e->sphere[e->next] = c;
    e->next = (e->next + 1) % INCODE_EMPTY_SPHERES;
    if (e->count < INCODE_EMPTY_SPHERES)
        e->count++;
}

/* With d = v - p of the empty sphere, M and N twice the centres: the power of r
 * less that in the empty sphere is (N - M - 2 d) . r - (|d|^2 - N . d). */
static bool bound_of(struct incode_radical_bound *c,
                     const struct incode_circum *b,
                     const struct incode_circum *empty) {
    struct incode_dd_vector d = incode_dd_relative(b->p, empty->p, b->scale);
    struct incode_dd there[3], negative[3];
    double share = b->scale / empty->scale, size = 0;
    double far = 2 * incode_dd_max_norm(d.d) + incode_dd_max_norm(b->twice);
    for (int k = 0; k < 3; k++) {
        there[k].hi = empty->twice[k].hi * share;
        there[k].lo = empty->twice[k].lo * share;
        struct incode_dd twice = {2 * d.d[k].hi, 2 * d.d[k].lo};
        struct incode_dd g =
            incode_dd_minus(incode_dd_minus(there[k], twice), b->twice[k]);
        c->g[k] = g.hi;
        size += __builtin_fabs(g.hi);
        negative[k] = incode_dd_minus(d.d[k], there[k]);
    }
    far += incode_dd_max_norm(there);
    double error = empty->error * share;
    c->slack = error + b->error + FINE * far + 1e-15 * size;
    /* |d|^2 - N . d = d . (d - N) */
    c->level = incode_dd_dot(d.d, negative).hi * (1 + 1e-15) +
               (3 * error + FINE * far) * far;
    /* What overflows is not a number, and stays so. */
    c->level = c->level < 0 ? 0 : c->level;
    c->set = c->level < 1e300 && c->slack < 1e300;
    return c->set;
}

void incode_radical_bound_set(struct incode_radical_bound *c,
                              const struct incode_empty_spheres *e,
                              const double *const p[4], double scale,
                              const double n[3]) {
    struct incode_circum best;
    double most = 0;
    c->set = false;
    if (e->count == 0 || !circum_of(&best, p, scale))
        return;
    for (uint32_t i = 0; i < e->count; i++) {
        struct incode_radical_bound here;
        if (!bound_of(&here, &best, &e->sphere[i]))
            continue;
        double steep = incode_dot(here.g, n) / (here.level + 1e-200);
        if (steep > most) {
            *c = here;
            most = steep;
        }
    }
}

/* --- centre --------------------------------------------------------------- */

/* The points around a vertex, brought to hand, and the bricks around its own.
 */

enum {
    HORIZON_UNITS =
        16, /* of incode/predicates/yield.h: a look over its boxes */
    NEAR_WANTED = 96,
    COPY_TRIES = 64
};

static double longest_side(const double lo[3], const double hi[3]) {
    double extent = 0;
    for (int d = 0; d < 3; d++)
        extent = hi[d] - lo[d] > extent ? hi[d] - lo[d] : extent;
    return extent;
}

/* Half-width of the box of local points: the extent of the leaf, times what has
 * lately given the wanted number of points around a vertex. */
static double first_radius(const struct incode_maker *m, const double lo[3],
                           const double hi[3]) {
    double extent = longest_side(lo, hi);
    if (!(extent > 0)) {
        for (int d = 0; d < 3; d++) {
            double e = m->hi[d] * 0x1p-10 - m->lo[d] * 0x1p-10;
            extent = e > extent ? e : extent;
        }
    }
    double radius = extent * m->spread;
    radius = radius > 0x1p-1070 ? radius : 0x1p-1070; /* it must grow by 4s */
    return radius < 0x1p1000 ? radius : 0x1p1000;
}

static void learn_spread(struct incode_maker *m, uint32_t points) {
    if (points > NEAR_WANTED * 9 / 8)
        m->spread *= 0.98;
    else if (points < NEAR_WANTED * 7 / 8)
        m->spread *= 1.02;
    m->spread = m->spread < 0.25 ? 0.25 : m->spread > 16 ? 16 : m->spread;
}

/* Brings the points around the leaf of a vertex to hand. */
static enum incode_step copy_around_leaf(struct incode_maker *m,
                                         struct incode_search *s, uint32_t v,
                                         const struct incode_frame *f) {
    struct incode_local_points *local = &m->local;
    uint32_t leaf = v % INCODE_BRICK_POINTS / INCODE_LEAF_POINTS;
    alignas(64) double leaf_lo[3][INCODE_BRICK_LEAVES],
        leaf_hi[3][INCODE_BRICK_LEAVES];
    double lo[3], hi[3];
    incode_frame_leaf_boxes(f, leaf_lo, leaf_hi);
    for (int d = 0; d < 3; d++) {
        lo[d] = leaf_lo[d][leaf];
        hi[d] = leaf_hi[d][leaf];
    }
    double radius = first_radius(m, lo, hi);
    for (int tries = 0;; tries++) {
        incode_maker_yield(m, HORIZON_UNITS);
        enum incode_local_outcome r =
            incode_local_around(local, &m->walker, &m->horizon,
                                v / INCODE_LEAF_POINTS, lo, hi, radius);
        s->page = local->query.missing;
        if (r == INCODE_LOCAL_WAIT)
            return INCODE_WAITING;
        if (r == INCODE_LOCAL_READY || tries == COPY_TRIES)
            return INCODE_FINISHED;
        radius *= 0.75;
        m->spread *= 0.9;
    }
}

enum { HORIZON_TRIES = 12 };

/* Lists the bricks around that of a vertex: more of them where there are few,
 * none where there are too many whatever the box. */
static enum incode_step list_bricks(struct incode_maker *m,
                                    struct incode_search *s, uint32_t brick,
                                    const struct incode_frame *f) {
    struct incode_horizon *h = &m->horizon;
    double lo[3], hi[3];
    bool full = false;
    (void)incode_frame_box(f, lo, hi);
    double extent = longest_side(lo, hi);
    for (int tries = 0; tries < HORIZON_TRIES; tries++) {
        double radius = extent * m->reach, around_lo[3], around_hi[3];
        bool all = true;
        for (int d = 0; d < 3; d++) {
            around_lo[d] = lo[d] - radius;
            around_hi[d] = hi[d] + radius;
            all = all && around_lo[d] <= m->lo[d] && around_hi[d] >= m->hi[d];
        }
        enum incode_step r = incode_horizon_make(
            h, &m->walker, brick, around_lo, around_hi, &s->page);
        if (r == INCODE_WAITING)
            return INCODE_WAITING;
        if (r == INCODE_FINISHED &&
            (full || all || h->count >= incode_horizon_near(h) / 3))
            break;
        full = full || r == INCODE_FULL;
        m->reach *= full ? 0.75 : 1.25;
        m->reach = m->reach < 0x1p-10  ? 0x1p-10
                   : m->reach > 0x1p10 ? 0x1p10
                                       : m->reach;
    }
    for (int d = 0; d < 3; d++) {
        if (h->box_lo[d] <= m->lo[d])
            h->box_lo[d] = -__builtin_inf();
        if (h->box_hi[d] >= m->hi[d])
            h->box_hi[d] = __builtin_inf();
    }
    return INCODE_FINISHED;
}

enum incode_step incode_maker_centre(struct incode_maker *m, unsigned search,
                                     uint32_t v) {
    struct incode_search *s = &m->search[search];
    struct incode_local_points *local = &m->local;
    uint32_t brick = v / INCODE_BRICK_POINTS, slot = v % INCODE_BRICK_POINTS;
    const struct incode_frame *f = incode_pager_get(&m->pager, brick);
    s->page = brick;
    if (f == NULL)
        return INCODE_WAITING;
    if (slot >= f->count) {
        m->fault = INCODE_NO_VERTEX;
        return INCODE_WAITING;
    }
    if (m->horizon.centre != brick &&
        list_bricks(m, s, brick, f) == INCODE_WAITING)
        return INCODE_WAITING;
    if (local->leaf != v / INCODE_LEAF_POINTS &&
        copy_around_leaf(m, s, v, f) == INCODE_WAITING)
        return INCODE_WAITING;
    const double p[3] = {f->page.brick.x[slot], f->page.brick.y[slot],
                         f->page.brick.z[slot]};
    bool again = local->vertex == v; /* after a wait: nothing new to learn */
    incode_local_centre(local, v, p, local->radius, m->lo, m->hi);
    if (!again)
        learn_spread(m, local->near);
    return INCODE_FINISHED;
}

/* --- copies --------------------------------------------------------------- */

/* The points of a horizon's bricks, copied in its units. */

void incode_horizon_copy(struct incode_horizon *h, uint32_t index,
                         const struct incode_frame *frame) {
    const struct incode_brick *b = &frame->page.brick;
    const double *const axis[3] = {b->x, b->y, b->z};
    uint32_t copy = h->next;
    incode_vd scale = incode_vd_all(h->scale);
    for (int d = 0; d < 3; d++) {
        /* Scaled first: a difference of large numbers could overflow. */
        incode_vd origin = incode_vd_all(h->origin[d] * h->scale);
        for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VD_LANES)
            incode_vd_store_float(h->point[copy][d] + i,
                                  incode_vd_load(axis[d] + i) * scale - origin);
    }
    uint8_t *old = &h->copy[h->owner[copy]];
    if (*old == copy)
        *old = INCODE_NO_COPY;
    h->owner[copy] = (uint16_t)index;
    h->copy[index] = (uint8_t)copy;
    h->next = (copy + 1) % h->room;
}

static uint64_t points_beyond(const float (*point)[INCODE_BRICK_POINTS],
                              const struct incode_horizon_cap *cap, float far) {
    incode_vf most = incode_vf_all(cap->level + far * cap->slack);
    uint64_t out = 0;
    for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VF_LANES) {
        incode_vf value = incode_vf_all(0);
        for (int k = 0; k < 3; k++)
            value = incode_vf_fma(
                incode_vf_all(cap->g[k]),
                incode_vf_load(point[k] + i) - incode_vf_all(cap->v[k]), value);
        out |= (uint64_t)incode_vm_bits(incode_vf_less(most, value)) << i;
    }
    return out;
}

uint64_t incode_horizon_points(const struct incode_horizon *h, uint32_t index,
                               const struct incode_horizon_cap *cap) {
    const float(*point)[INCODE_BRICK_POINTS] = h->point[h->copy[index]];
    float far = h->far[index] + cap->near;
    /* A half-space says nothing of points that are beyond all bounds. */
    if (cap->d == 0 && far >= INCODE_ANYWHERE)
        return UINT64_MAX;
    incode_vf d = incode_vf_all(cap->d);
    incode_vf most =
        incode_vf_all((cap->d * far + cap->m_sum) * far * INCODE_HORIZON_DOUBT);
    uint64_t out = 0;
    for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VF_LANES) {
        incode_vf value = incode_vf_all(0);
        for (int k = 0; k < 3; k++) {
            incode_vf y =
                incode_vf_load(point[k] + i) - incode_vf_all(cap->v[k]);
            value = incode_vf_fma(
                incode_vf_fma(d, y, -incode_vf_all(cap->m[k])), y, value);
        }
        out |= (uint64_t)incode_vm_bits(incode_vf_less(most, value)) << i;
    }
    return ~out & ~(cap->bounded ? points_beyond(point, cap, far) : 0);
}
