#include "query.h"

#include <float.h>
#include <stdalign.h>
#include <string.h>

#include "incode/predicates/check.h"
#include "incode/predicates/simd.h"

double incode_scale_for(double extent) {
    uint64_t bits;
    if (!(extent > DBL_MIN))
        extent = DBL_MIN;
    if (extent > DBL_MAX)
        extent = DBL_MAX;
    memcpy(&bits, &extent, sizeof bits);
    uint64_t exponent = bits >> 52; /* extent >= 2^(exponent - 1023) */
    uint64_t scaled = exponent > 2045 ? 1 : 2046 - exponent;
    bits = scaled << 52;
    double scale;
    memcpy(&scale, &bits, sizeof scale);
    return scale;
}

void incode_query_face(struct incode_query *q) {
    double extent = 0;
    for (int d = 0; d < 3; d++) {
        double eb = __builtin_fabs(q->pb[d] - q->pv[d]);
        double ec = __builtin_fabs(q->pc[d] - q->pv[d]);
        extent = eb > extent ? eb : extent;
        extent = ec > extent ? ec : extent;
    }
    q->scale = incode_scale_for(extent);
    incode_query_relative(q->rb, q, q->pb);
    incode_query_relative(q->rc, q, q->pc);
    incode_sphere_plane(&q->sphere, q->rb, q->rc);
    if (incode_plane_is_ill_conditioned(&q->sphere))
        incode_sphere_refine(&q->sphere, q->pv, q->pb, q->pc, NULL, q->scale);
}

/* Sets the ball, relative and scaled, and the box around it; false: there is no
 * such box. */
static bool set_ball(struct incode_query *q, const double centre[3],
                     double radius) {
    double inverse = 1 / q->scale, far = 0;
    for (int d = 0; d < 3; d++) {
        double lo = (centre[d] - radius) * inverse;
        double hi = (centre[d] + radius) * inverse;
        double slack = 1e-15 * (__builtin_fabs(q->pv[d]) + hi - lo);
        q->lo[d] = q->pv[d] + lo - slack;
        q->hi[d] = q->pv[d] + hi + slack;
        if (!(q->lo[d] <= q->hi[d]))
            return false;
        q->centre[d] = centre[d];
        far += __builtin_fabs(centre[d]);
    }
    q->square = radius * radius;
    q->plane_slack = INCODE_SPHERE_TINY + INCODE_SPHERE_EPS * 3 *
                                              (far + radius) *
                                              incode_max_norm(q->sphere.pn);
    q->boxed = q->round = true;
    return true;
}

/* Where the sphere says nothing, the points' half-space may. */
static void bound_near_degenerate(struct incode_query *q) {
    if (q->best == INCODE_NONE)
        return;
    const double *const p[4] = {q->pv, q->pb, q->pc, q->best_p};
    incode_near_degenerate_lessen(&q->degenerate, p, q->scale);
    const struct incode_ball *ball = &q->degenerate.ball;
    q->lens = q->large = ball->radius < 1e300 &&
                         set_ball(q, ball->centre, ball->radius * (1 + 1e-9));
}

/* Face sizes: the ball of a larger sphere is too coarse where its surface runs
 * along that of the set. */
#define LARGE 16

/* The box of the best's sphere, widened by 1e-6 of its size and by the rounding
 * of all that leads to it; none where the sphere is ill-conditioned. */
static void bound_sphere(struct incode_query *q) {
    const struct incode_sphere *s = &q->sphere;
    q->boxed = q->round = q->lens = false;
    if (q->degenerate.known && incode_sphere_is_near_degenerate(s)) {
        bound_near_degenerate(q);
        return;
    }
    if (!s->has_apex || !(s->det > 1e9 * INCODE_SPHERE_EPS * s->pdet) ||
        !(s->det > INCODE_SPHERE_LEAST)) /* squares below would underflow */
        return;
    double half = 0.5 / s->det, radius = __builtin_sqrt(incode_dot(s->m, s->m));
    radius = radius * half * (1 + 1e-6) +
             12 * INCODE_SPHERE_EPS * incode_max_norm(s->pm) * half;
    q->large = radius > LARGE * (s->lb + s->lc);
    (void)set_ball(q, q->peak, radius);
}

void incode_query_shrink(struct incode_query *q) {
    q->shrinking = true;
    bound_sphere(q);
}

/* Where many points are to be looked at. */
static void set_radical_bound(struct incode_query *q) {
    if (q->best == INCODE_NONE)
        return;
    const double *const p[4] = {q->pv, q->pb, q->pc, q->best_p};
    if (q->empty != NULL)
        incode_radical_bound_set(&q->radical, q->empty, p, q->scale,
                                 q->sphere.n);
}

void incode_query_look(struct incode_query *q) {
    if (++q->looked == INCODE_QUERY_CROWD)
        set_radical_bound(q);
}

void incode_query_start(struct incode_query *q, uint32_t id,
                        const double p[3]) {
    q->best = id;
    q->degenerate.spread = 0;
    q->radical.set = false;
    memcpy(q->best_p, p, sizeof q->best_p);
    for (int d = 0; d < 3; d++)
        q->peak[d] = 0.5 * q->sphere.m[d] / q->sphere.det; /* either may be 0 */
    if (q->shrinking)
        bound_sphere(q);
    if (q->looked >= INCODE_QUERY_CROWD)
        set_radical_bound(q);
}

enum {
    CONTESTS = 8,      /* by the predicates, before twice the precision */
    CONSIDER_UNITS = 4 /* of work, as incode/predicates/yield.h counts it */
};

/* Whether a point is certainly outside the best's sphere, looked at more
 * closely where many points are in doubt. */
static bool is_outside(struct incode_query *q, struct incode_tally *tally,
                       const double p[3]) {
    if (q->contests < CONTESTS) {
        q->contests++;
        if (!q->degenerate.known || (q->round && !q->lens))
            return false;
    }
    if (q->degenerate.spread == 0) {
        const double *const f[4] = {q->pv, q->pb, q->pc, q->best_p};
        incode_yield_after(&tally->yield, INCODE_FINE_UNITS);
        incode_near_degenerate_sphere(&q->degenerate, f, q->scale);
    }
    return incode_near_degenerate_outside(&q->degenerate, q->pv, p, q->scale);
}

void incode_query_apex(struct incode_query *q, struct incode_tally *tally,
                       const double p[3]) {
    double r[3];
    incode_query_relative(r, q, p);
    incode_sphere_apex(&q->sphere, q->rb, q->rc, r);
    if (incode_sphere_is_ill_conditioned(&q->sphere)) {
        incode_yield_after(&tally->yield, INCODE_FINE_UNITS);
        incode_sphere_refine(&q->sphere, q->pv, q->pb, q->pc, p, q->scale);
    }
}

void incode_query_consider(struct incode_query *q, struct incode_tally *tally,
                           uint32_t id, const double p[3]) {
    incode_yield_after(&tally->yield, CONSIDER_UNITS);
    if (q->best != INCODE_NONE && is_outside(q, tally, p))
        return;
    if (incode_orient3d(tally, q->pv, q->pb, q->pc, p) <= 0)
        return;
    if (q->best != INCODE_NONE &&
        incode_in_sphere(tally, q->pv, q->pb, q->pc, q->best_p, p) < 0)
        return;
    incode_query_apex(q, tally, p);
    if (q->degenerate.known)
        incode_yield_after(&tally->yield, INCODE_LESSEN_UNITS);
    if (q->looked >= INCODE_QUERY_CROWD)
        incode_yield_after(&tally->yield, INCODE_RADICAL_UNITS);
    incode_query_start(q, id, p);
}

/* ---- which of up to 32 boxes a question concerns ---- */

struct boxes {
    const double *lo[3], *hi[3];
};

INCODE_INLINE incode_vl meets(const struct incode_query *q,
                              const struct boxes *boxes, unsigned i) {
    incode_vl in = incode_vl_ones();
    for (int d = 0; d < 3; d++) {
        incode_vd lo = incode_vd_load(boxes->lo[d] + i);
        incode_vd hi = incode_vd_load(boxes->hi[d] + i);
        in &= (lo <= incode_vd_all(q->hi[d])) & (hi >= incode_vd_all(q->lo[d]));
    }
    return in;
}

INCODE_INLINE incode_vl not_done(const struct incode_query *q,
                                 const struct boxes *boxes, unsigned i) {
    incode_vl in = incode_vl_ones();
    for (int d = 0; d < 3; d++) {
        incode_vd lo = incode_vd_load(boxes->lo[d] + i);
        incode_vd hi = incode_vd_load(boxes->hi[d] + i);
        in &= (lo >= incode_vd_all(q->done_lo[d])) &
              (hi <= incode_vd_all(q->done_hi[d]));
    }
    return ~in;
}

/* Not certainly on the known side of the plane, nor outside the sphere: upper
 * bounds of both functions over the box, dimension by dimension. */
INCODE_INLINE incode_vl may_hold_apex(const struct incode_query *q,
                                      const struct boxes *boxes, unsigned i) {
    const struct incode_sphere *s = &q->sphere;
    incode_vd zero = incode_vd_all(0), plane = zero, plane_error = zero;
    incode_vd value = zero, value_error = zero;
    incode_vd det = incode_vd_all(s->det), pdet = incode_vd_all(s->pdet);
    for (int d = 0; d < 3; d++) {
        incode_vd v = incode_vd_all(q->pv[d]);
        incode_vd scale = incode_vd_all(q->scale);
        incode_vd lo = (incode_vd_load(boxes->lo[d] + i) - v) * scale;
        incode_vd hi = (incode_vd_load(boxes->hi[d] + i) - v) * scale;
        incode_vd far = incode_vd_max(incode_vd_abs(lo), incode_vd_abs(hi));
        incode_vd n = incode_vd_all(s->n[d]);
        plane += incode_vd_max(n * lo, n * hi);
        plane_error += incode_vd_all(s->pn[d]) * far;
        if (!s->has_apex)
            continue;
        incode_vd m = incode_vd_all(s->m[d]);
        incode_vd peak = incode_vd_all(q->peak[d]);
        incode_vd top = incode_vd_max(incode_vd_min(peak, hi), lo);
        incode_vd best =
            incode_vd_max((m - det * lo) * lo, (m - det * hi) * hi);
        value += incode_vd_max((m - det * top) * top, best);
        value_error += (incode_vd_all(s->pm[d]) + pdet * far) * far;
    }
    incode_vd eps = incode_vd_all(INCODE_SPHERE_EPS);
    incode_vd tiny = incode_vd_all(INCODE_SPHERE_TINY);
    incode_vl out = plane + (plane_error * eps + tiny) < zero;
    if (s->has_apex)
        out |= value + (value_error * eps + tiny) < zero;
    return ~out;
}

/* What meets the ball and is not certainly on the known side of the plane.  The
 * bound of the plane's rounding holds within the ball. */
INCODE_INLINE incode_vl meets_ball(const struct incode_query *q,
                                   const struct boxes *boxes, unsigned i) {
    incode_vd zero = incode_vd_all(0), plane = incode_vd_all(q->plane_slack);
    incode_vd square = zero, scale = incode_vd_all(q->scale);
    for (int d = 0; d < 3; d++) {
        incode_vd v = incode_vd_all(q->pv[d]), c = incode_vd_all(q->centre[d]);
        incode_vd lo = (incode_vd_load(boxes->lo[d] + i) - v) * scale;
        incode_vd hi = (incode_vd_load(boxes->hi[d] + i) - v) * scale;
        incode_vd n = incode_vd_all(q->sphere.n[d]);
        plane += incode_vd_max(n * lo, n * hi);
        incode_vd gap = incode_vd_max(incode_vd_max(lo - c, c - hi), zero);
        square += gap * gap;
    }
    /* A difference that overflows tells nothing. */
    incode_vd infinite = incode_vd_all(__builtin_inf());
    incode_vl far = (square > incode_vd_all(q->square)) & (square < infinite);
    return ~(((plane < zero) & (plane > -infinite)) | far);
}

INCODE_INLINE incode_vl may_be_near(const struct incode_query *q,
                                    const struct boxes *boxes, unsigned i) {
    incode_vd zero = incode_vd_all(0), square = zero;
    for (int d = 0; d < 3; d++) {
        incode_vd v = incode_vd_all(q->pv[d]);
        incode_vd scale = incode_vd_all(q->scale);
        incode_vd lo = (incode_vd_load(boxes->lo[d] + i) - v) * scale;
        incode_vd hi = (incode_vd_load(boxes->hi[d] + i) - v) * scale;
        incode_vd gap = incode_vd_max(incode_vd_max(lo, -hi), zero);
        square += gap * gap;
    }
    return ~(square > incode_vd_all(q->limit));
}

/* Not certainly beyond the radical plane. */
INCODE_INLINE incode_vl below_radical_plane(const struct incode_query *q,
                                            const struct boxes *boxes,
                                            unsigned i) {
    const struct incode_radical_bound *c = &q->radical;
    incode_vd least = incode_vd_all(0), far = least;
    for (int d = 0; d < 3; d++) {
        incode_vd v = incode_vd_all(q->pv[d]), g = incode_vd_all(c->g[d]);
        incode_vd scale = incode_vd_all(q->scale);
        incode_vd lo = (incode_vd_load(boxes->lo[d] + i) - v) * scale;
        incode_vd hi = (incode_vd_load(boxes->hi[d] + i) - v) * scale;
        least += incode_vd_min(g * lo, g * hi);
        far += incode_vd_max(incode_vd_abs(lo), incode_vd_abs(hi));
    }
    return ~(least - far * incode_vd_all(c->slack) > incode_vd_all(c->level));
}

/* May reach higher than the half-space so far. */
INCODE_INLINE incode_vl may_rise(const struct incode_query *q,
                                 const struct boxes *boxes, unsigned i) {
    const struct incode_half_space *s = &q->half_space;
    incode_vd top = incode_vd_all(INCODE_SPHERE_TINY), error = top;
    for (int d = 0; d < 3; d++) {
        incode_vd p = incode_vd_all(s->p[d]), scale = incode_vd_all(s->scale);
        incode_vd lo = (incode_vd_load(boxes->lo[d] + i) - p) * scale;
        incode_vd hi = (incode_vd_load(boxes->hi[d] + i) - p) * scale;
        incode_vd n = incode_vd_all(s->n[d]);
        incode_vd a = n * lo, b = n * hi;
        top += incode_vd_max(a, b);
        error += incode_vd_max(incode_vd_abs(a), incode_vd_abs(b));
    }
    /* Not a number where a difference overflows, which tells nothing. */
    return ~(top + error * incode_vd_all(INCODE_SPHERE_EPS) <
             incode_vd_all(q->limit));
}

static uint32_t passing(const struct incode_query *q, const struct boxes *boxes,
                        unsigned count) {
    uint32_t mask = 0;
    for (unsigned i = 0; i < count; i += INCODE_VD_LANES) {
        incode_vl in = incode_vl_ones();
        if (q->boxed) {
            in = meets(q, boxes, i);
            if (incode_vd_mask(in) == 0)
                continue;
        }
        if (q->done)
            in &= not_done(q, boxes, i);
        if (q->question == INCODE_QUERY_APEX) {
            if (q->round)
                in &= meets_ball(q, boxes, i);
            if (!q->round || q->large)
                in &= may_hold_apex(q, boxes, i);
            if (q->radical.set)
                in &= below_radical_plane(q, boxes, i);
        } else if (q->question == INCODE_QUERY_HALF_SPACE)
            in &= may_rise(q, boxes, i);
        else if (q->question != INCODE_QUERY_BOX)
            in &= may_be_near(q, boxes, i);
        mask |= incode_vd_mask(in) << i;
    }
    return count >= 32 ? mask : mask & ((UINT32_C(1) << count) - 1);
}

uint32_t incode_query_boxes(const struct incode_query *q,
                            const double *const lo[3],
                            const double *const hi[3], unsigned count) {
    struct boxes boxes = {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}};
    return passing(q, &boxes, count);
}

/* ---- the walk ---- */

struct walk {
    struct incode_walker *walker;
    struct incode_query *q;
    incode_visit *visit;
    void *context;
    bool visited; /* a brick, in this call */
};

enum {
    ASK_AHEAD = 8,
    /* Of work, as incode/predicates/yield.h counts it: the leaves of a brick, a
     * page of boxes, a lifted one. */
    VISIT_UNITS = 6,
    PAGE_UNITS = 20,
    LIFTED_UNITS = 2
};

/* Which child comes next in the walk's direction. */
static inline unsigned next_child(const struct incode_query *q, uint32_t left) {
    return (unsigned)(q->down ? 31 - __builtin_clz(left) : __builtin_ctz(left));
}

/* A page is missing: its next siblings will be, too, so ask for some now. */
static enum incode_step wait_for(struct walk *w, uint32_t base, uint32_t first,
                                 uint32_t left, unsigned child) {
    w->q->missing = base + first + child;
    for (int i = 0; i < ASK_AHEAD && left != 0; i++) {
        unsigned next = next_child(w->q, left);
        left &= ~(UINT32_C(1) << next);
        (void)incode_pager_get(w->walker->pager, base + first + next);
    }
    return INCODE_WAITING;
}

/* The leaves of a brick that a question concerns.  Boxes are made for those
 * questions that take more of a point than what a box takes to make. */
static __attribute__((noinline)) uint32_t
passing_leaves(const struct incode_query *q, const struct incode_frame *frame) {
    alignas(64) double lo[3][INCODE_BRICK_LEAVES], hi[3][INCODE_BRICK_LEAVES];
    struct boxes boxes = {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}};
    unsigned leaves = incode_frame_leaves(frame);
    if (q->question == INCODE_QUERY_BOX)
        return (UINT32_C(1) << leaves) - 1;
    incode_frame_leaf_boxes(frame, lo, hi);
    return passing(q, &boxes, leaves);
}

static enum incode_step visit_brick(struct walk *w, uint32_t brick,
                                    const struct incode_frame *frame) {
    uint32_t leaves = passing_leaves(w->q, frame);
    incode_walker_spend(w->walker, 1);
    incode_walker_yield(w->walker, VISIT_UNITS);
    w->visited = true;
    if (leaves != 0 &&
        !w->visit(w->walker, w->q, frame, brick, leaves, w->context))
        return INCODE_WORKED;
    return INCODE_FINISHED;
}

/* Bricks up to and with those below page `index` of `level`, in the walk's
 * direction. */
static uint32_t bricks_to(const struct walk *w, uint32_t level,
                          uint64_t index) {
    uint64_t bricks = w->walker->tree->bricks;
    uint64_t begin = index << (5 * level), end = (index + 1) << (5 * level);
    return (uint32_t)(w->q->down     ? bricks - begin
                      : end < bricks ? end
                                     : bricks);
}

/* ---- which lifted boxes a question concerns ---- */

/* A lower bound of det |r|^2 - m . r over a lifted box (incode/pages/pages.h),
 * less what rounding and the errors of det and m may do; of the plane where
 * there is no sphere.  Not a number where something overflows. */
static double least_value(const struct incode_query *q,
                          const struct incode_boxes *page,
                          const struct incode_lifted *lifted) {
    const struct incode_sphere *s = &q->sphere;
    const double *m = s->has_apex ? s->m : s->n;
    const double *pm = s->has_apex ? s->pm : s->pn;
    double det = s->has_apex ? s->det - INCODE_SPHERE_EPS * s->pdet : 0;
    double unit = page->unit * q->scale, square = unit * unit;
    double g[3], value, error = 0, steep = 0;
    det = det > 0 ? det : 0; /* less holds more */
    value = det * square * lifted->lid;
    for (int d = 0; d < 3; d++) {
        double at = (page->origin[d] - q->pv[d]) * q->scale;
        double y = at + unit * lifted->o[d];
        double far = __builtin_fabs(at) + 4 * unit;
        value += (det * y - m[d]) * y;
        g[d] = 2 * det * y - m[d];
        error += (pm[d] + __builtin_fabs(m[d]) + 4 * det * far) * far;
        steep += __builtin_fabs(g[d]);
    }
    for (int k = 0; k < 3; k++)
        value -= __builtin_fabs(incode_dot(g, lifted->a[k]) * unit +
                                det * square * lifted->slope[k]);
    return value - 8 * INCODE_SPHERE_EPS * error - INCODE_SPHERE_TINY -
           steep * unit * lifted->radius * 0x1p-19;
}

/* Whether a child's lifted box may hold what an APEX query looks for. */
static bool may_reach(const struct incode_query *q,
                      const struct incode_boxes *page, unsigned child) {
    struct incode_lifted lifted;
    return q->question != INCODE_QUERY_APEX ||
           !incode_boxes_lifted(page, child, &lifted) ||
           !(least_value(q, page, &lifted) > 0);
}

/* Its own frame of the stack: the boxes are not needed farther down. */
static __attribute__((noinline)) uint32_t
passing_children(const struct incode_query *q, const struct incode_boxes *page,
                 unsigned count) {
    alignas(64) double lo[3][INCODE_FANOUT], hi[3][INCODE_FANOUT];
    struct boxes boxes = {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}};
    incode_boxes_axes(page, lo, hi);
    return passing(q, &boxes, count);
}

static enum incode_step descend(struct walk *w, uint32_t level, uint32_t index,
                                const struct incode_frame *frame) {
    const struct incode_tree *tree = w->walker->tree;
    uint32_t first = index * INCODE_FANOUT;
    uint32_t count = tree->count[level - 1] - first;
    if (count > INCODE_FANOUT)
        count = INCODE_FANOUT;
    incode_walker_yield(w->walker, PAGE_UNITS);
    uint32_t mask = passing_children(w->q, &frame->page.boxes, count);
    for (uint32_t left = mask; left != 0;) {
        unsigned child = next_child(w->q, left);
        uint32_t to = bricks_to(w, level - 1, (uint64_t)first + child);
        left &= ~(UINT32_C(1) << child);
        if (to <= w->q->cursor)
            continue;
        incode_walker_yield(w->walker, LIFTED_UNITS);
        if (!may_reach(w->q, &frame->page.boxes, child)) {
            w->q->cursor = to;
            continue;
        }
        uint32_t page = tree->base[level - 1] + first + child;
        if (w->q->yields && w->visited && w->walker->left == 0) {
            w->q->missing = INCODE_NONE;
            return INCODE_WAITING;
        }
        if (w->q->pages_max != 0 && w->q->pages++ == w->q->pages_max)
            return INCODE_WORKED;
        const struct incode_frame *f = incode_pager_get(w->walker->pager, page);
        if (f == NULL && w->q->ahead && level == 1 &&
            incode_pager_loading(w->walker->pager, page))
            continue;
        if (f == NULL)
            return wait_for(w, tree->base[level - 1], first, left, child);
        enum incode_step r = level == 1
                                 ? visit_brick(w, first + child, f)
                                 : descend(w, level - 1, first + child, f);
        if (r != INCODE_FINISHED)
            return r;
        w->q->cursor = to;
    }
    return INCODE_FINISHED;
}

enum incode_step incode_walk(struct incode_walker *walker,
                             struct incode_query *q, incode_visit *visit,
                             void *context) {
    struct walk w = {walker, q, visit, context, false};
    uint32_t top = walker->tree->levels - 1;
    const struct incode_frame *root =
        incode_pager_get(walker->pager, walker->tree->base[top]);
    if (root == NULL) {
        q->missing = walker->tree->base[top];
        return INCODE_WAITING;
    }
    return descend(&w, top, 0, root);
}

enum incode_step incode_walk_brick(struct incode_walker *walker,
                                   struct incode_query *q, uint32_t brick,
                                   incode_visit *visit, void *context) {
    struct walk w = {walker, q, visit, context, false};
    const struct incode_frame *f = incode_pager_get(walker->pager, brick);
    q->missing = brick;
    return f == NULL ? INCODE_WAITING : visit_brick(&w, brick, f);
}
