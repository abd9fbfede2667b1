#include <stdalign.h>
#include <string.h>

#include "lanes.h"
#include "query.h"

enum {
    LEAF_ALL = (1 << INCODE_LEAF_POINTS) - 1, /* its points, a bit each */
    LEAF_UNITS = 5, /* of work, as incode/predicates/pause.h counts it */
    FINE_LEAF_UNITS = 32,
    POINT_UNITS = 2
};

/* What a walk does with the points of the leaves that it comes to: each
 * question's candidates, a vector of points at a time. */

struct lane_points {
    incode_vd r[3]; /* relative coordinates */
};

INCODE_INLINE void load_points(struct lane_points *p,
                               const struct incode_query *q,
                               const struct incode_frame *frame,
                               unsigned slot) {
    incode_vd scale = incode_vd_all(q->scale);
    p->r[0] =
        (incode_vd_load(frame->page.brick.x + slot) - incode_vd_all(q->pv[0])) *
        scale;
    p->r[1] =
        (incode_vd_load(frame->page.brick.y + slot) - incode_vd_all(q->pv[1])) *
        scale;
    p->r[2] =
        (incode_vd_load(frame->page.brick.z + slot) - incode_vd_all(q->pv[2])) *
        scale;
}

/* Points that are not certainly beaten, one bit each; depth: how far before the
 * best they lie in the face's pencil, as far as doubles tell. */
INCODE_INLINE uint32_t apex_lanes(const struct incode_query *q,
                                  const struct lane_points *p,
                                  incode_vd *depth) {
    const struct incode_sphere *s = &q->sphere;
    incode_vd zero = incode_vd_all(0), plane = zero, plane_error = zero;
    incode_vd value = zero, value_error = zero, square = zero;
    for (int d = 0; d < 3; d++) {
        incode_vd r = p->r[d], far = incode_vd_abs(r);
        plane += incode_vd_all(s->n[d]) * r;
        plane_error += incode_vd_all(s->pn[d]) * far;
        square += r * r;
        if (s->has_apex) {
            value += incode_vd_all(s->m[d]) * r;
            value_error += incode_vd_all(s->pm[d]) * far;
        }
    }
    incode_vd eps = incode_vd_all(INCODE_SPHERE_EPS);
    incode_vd tiny = incode_vd_all(INCODE_SPHERE_TINY);
    incode_vd margin = plane_error * eps + tiny;
    incode_vl out =
        q->strictly_beyond ? ~(plane > margin) : plane + margin < zero;
    *depth = zero;
    if (s->has_apex) {
        value -= incode_vd_all(s->det) * square;
        *depth = incode_vd_select(plane > zero, value / plane,
                                  incode_vd_all(-__builtin_inf()));
        value_error += incode_vd_all(s->pdet) * square;
        out |= value + (value_error * eps + tiny) < zero;
    }
    return ~incode_vd_mask(out) & INCODE_VD_ALL;
}

/* Points that are certainly beyond the radical plane. */
INCODE_INLINE uint32_t above_radical_lanes(const struct incode_query *q,
                                           const struct lane_points *p) {
    incode_vd value = incode_vd_all(0), far = value;
    for (int d = 0; d < 3; d++) {
        value += incode_vd_all(q->radical.g[d]) * p->r[d];
        far += incode_vd_abs(p->r[d]);
    }
    return incode_vd_mask(value - far * incode_vd_all(q->radical.slack) >
                          incode_vd_all(q->radical.level));
}

/* Points that lie in the ball and not certainly on the known side of the plane:
 * a coarser test, and a cheaper one. */
INCODE_INLINE uint32_t ball_lanes(const struct incode_query *q,
                                  const struct lane_points *p) {
    incode_vd plane = incode_vd_all(q->plane_slack), square = incode_vd_all(0);
    for (int d = 0; d < 3; d++) {
        incode_vd gap = p->r[d] - incode_vd_all(q->centre[d]);
        square += gap * gap;
        plane += incode_vd_all(q->sphere.n[d]) * p->r[d];
    }
    /* A difference that overflows tells nothing. */
    incode_vd infinite = incode_vd_all(__builtin_inf());
    incode_vl far = (square > incode_vd_all(q->square)) & (square < infinite);
    incode_vl below = (plane < incode_vd_all(0)) & (plane > -infinite);
    return INCODE_VD_ALL & ~incode_vd_mask(far | below);
}

/* incode_near_degenerate_outside for some points, one bit each. */
INCODE_INLINE uint32_t outside_lanes(const struct incode_query *q,
                                     const struct incode_frame *frame,
                                     unsigned slot) {
    const struct incode_brick *brick = &frame->page.brick;
    const double *const axis[3] = {brick->x + slot, brick->y + slot,
                                   brick->z + slot};
    struct incode_lanes zero = {incode_vd_all(0), incode_vd_all(0)};
    struct incode_lanes value = zero, square = zero;
    for (int d = 0; d < 3; d++) {
        struct incode_lanes r = incode_lanes_difference(incode_vd_load(axis[d]),
                                                        q->pv[d], q->scale);
        struct incode_lanes m = incode_lanes_all(q->degenerate.sphere.m[d]);
        square = incode_lanes_plus(square, incode_lanes_times(r, r));
        value = incode_lanes_plus(value, incode_lanes_times(m, r));
    }
    struct incode_lanes det = incode_lanes_all(q->degenerate.sphere.det);
    value = incode_lanes_minus(value, incode_lanes_times(det, square));
    /* 1 + |r|^2 is more than |r|. */
    incode_vd slack = incode_vd_all(q->degenerate.spread) *
                          (incode_vd_all(1) + square.hi + square.hi) +
                      incode_vd_all(INCODE_SPHERE_TINY);
    return incode_vd_mask(value.hi < -slack);
}

/* ---- the points of a leaf ---- */

uint32_t incode_query_lanes(const struct incode_query *q,
                            const double *const axis[3]) {
    uint32_t mask = 0;
    for (unsigned i = 0; i < INCODE_LEAF_POINTS; i += INCODE_VD_LANES) {
        struct lane_points points;
        incode_vd depth;
        for (int d = 0; d < 3; d++)
            points.r[d] =
                (incode_vd_load(axis[d] + i) - incode_vd_all(q->pv[d])) *
                incode_vd_all(q->scale);
        mask |= apex_lanes(q, &points, &depth) << i;
    }
    return mask;
}

static void point_of(double p[3], const struct incode_frame *frame,
                     unsigned slot) {
    p[0] = frame->page.brick.x[slot];
    p[1] = frame->page.brick.y[slot];
    p[2] = frame->page.brick.z[slot];
}

static void consider_near(struct incode_query *q, uint32_t id,
                          const double p[3]) {
    double r[3];
    incode_query_relative(r, q, p);
    double square = incode_dot(r, r);
    if (square > q->limit ||
        (q->best != INCODE_NONE &&
         incode_compare_distance(q->pv, p, q->best_p) >= 0))
        return;
    q->best = id;
    memcpy(q->best_p, p, sizeof q->best_p);
    q->limit = square * (1 + 1e-9) + INCODE_SPHERE_TINY;
}

static void consider_circle(struct incode_query *q, uint32_t id,
                            const double p[3]) {
    double r[3], n[3], e[3];
    incode_query_relative(r, q, p);
    incode_cross(n, q->rb, r);
    for (int d = 0; d < 3; d++)
        e[d] = r[d] - q->rb[d];
    double area = 4 * incode_dot(n, n);
    double product = incode_dot(q->rb, q->rb) * incode_dot(r, r);
    double square = product * incode_dot(e, e) / area;
    if (!(area > 0) || !(square < q->limit / 4)) {
        if (q->best != INCODE_NONE || incode_collinear(q->pv, q->pb, p))
            return;
    } else {
        q->limit = 4 * square * (1 + 1e-6);
    }
    q->best = id;
    memcpy(q->best_p, p, sizeof q->best_p);
}

void incode_query_half_space(struct incode_query *q, const double pv[3],
                             const double n[3], double scale) {
    memset(q, 0, sizeof *q);
    q->question = INCODE_QUERY_HALF_SPACE;
    q->v = q->b = q->c = q->best = INCODE_NONE;
    q->half_space.scale = scale;
    memcpy(q->half_space.n, n, sizeof q->half_space.n);
    memcpy(q->half_space.p, pv, sizeof q->half_space.p);
}

static void consider_height(struct incode_query *q, const double p[3]) {
    struct incode_half_space *s = &q->half_space;
    struct incode_dd top = {s->most[0], s->most[1]};
    double r[3], error = 0;
    for (int d = 0; d < 3; d++) {
        r[d] = (p[d] - s->p[d]) * s->scale;
        error += __builtin_fabs(r[d] * s->n[d]);
    }
    if (incode_dot(r, s->n) + error * INCODE_SPHERE_EPS < q->limit)
        return;
    struct incode_dd height = incode_half_space_height(s, p);
    /* What overflows may be anywhere: such a half-space tells nothing. */
    if (!(error < 1e300))
        height = (struct incode_dd){__builtin_inf(), 0};
    if (incode_dd_minus(height, top).hi > 0 || !(height.hi < 1e300)) {
        s->most[0] = height.hi;
        s->most[1] = height.lo;
        q->limit = height.hi;
    }
}

static bool is_done(const struct incode_query *q, const double p[3]) {
    bool done = true;
    for (int d = 0; d < 3; d++)
        done = done && p[d] >= q->done_lo[d] && p[d] <= q->done_hi[d];
    return done;
}

/* The points of a brick that a query must consider, one bit each. */
struct chosen {
    uint64_t in;
    bool ranked; /* they have just been chosen by their depths */
    alignas(64) double depth[INCODE_BRICK_POINTS];
};

/* Those of some points of a leaf that an APEX query must consider, one bit
 * each. */
static uint32_t apex_leaf(const struct incode_query *q,
                          const struct incode_frame *frame, unsigned first,
                          uint32_t lanes, struct chosen *chosen) {
    uint32_t in = 0;
    for (unsigned i = 0; i < INCODE_LEAF_POINTS; i += INCODE_VD_LANES) {
        struct lane_points points;
        uint32_t here = lanes >> i & INCODE_VD_ALL;
        load_points(&points, q, frame, first + i);
        if (q->round)
            here &= ball_lanes(q, &points);
        if (here != 0)
            here &= apex_lanes(q, &points,
                               (incode_vd *)(chosen->depth + first + i));
        if (here != 0 && q->radical.set)
            here &= ~above_radical_lanes(q, &points);
        in |= here << i;
    }
    if ((in & (in - 1)) == 0 || q->degenerate.spread == 0)
        return in;
    for (unsigned i = 0; i < INCODE_LEAF_POINTS; i += INCODE_VD_LANES)
        in &= ~(outside_lanes(q, frame, first + i) << i);
    return in;
}

/* Of work, as incode/predicates/pause.h counts it: in twice the precision, too,
 * where points are nearly degenerate. */
static uint32_t leaf_units(const struct incode_query *q) {
    return q->degenerate.spread == 0 ? LEAF_UNITS : FINE_LEAF_UNITS;
}

static void choose(struct incode_walker *walker, struct incode_query *q,
                   const struct incode_frame *frame, uint32_t leaves,
                   struct chosen *chosen) {
    chosen->in = 0;
    chosen->ranked = q->question == INCODE_QUERY_APEX;
    for (; leaves != 0; leaves &= leaves - 1) {
        unsigned first = (unsigned)__builtin_ctz(leaves) * INCODE_LEAF_POINTS;
        unsigned count = frame->count - first;
        uint32_t lanes =
            count >= INCODE_LEAF_POINTS ? LEAF_ALL : (1U << count) - 1;
        *walker->candidates += (unsigned)__builtin_popcount(lanes);
        incode_walker_breathe(walker, leaf_units(q));
        if (q->question == INCODE_QUERY_APEX) {
            if (q->looked + 1 == INCODE_QUERY_CROWD)
                incode_walker_breathe(walker, INCODE_RADICAL_UNITS);
            incode_query_look(q);
            lanes = apex_leaf(q, frame, first, lanes, chosen);
        }
        chosen->in |= (uint64_t)lanes << first;
    }
}

/* The same after an APEX query has found another best. */
static void choose_again(const struct incode_query *q,
                         const struct incode_frame *frame,
                         struct chosen *chosen) {
    uint64_t in = chosen->in;
    chosen->in = 0;
    chosen->ranked = true;
    for (unsigned i = 0; i < INCODE_BRICK_POINTS; i += INCODE_LEAF_POINTS) {
        uint32_t lanes = (uint32_t)(in >> i) & LEAF_ALL;
        if (lanes != 0)
            chosen->in |= (uint64_t)apex_leaf(q, frame, i, lanes, chosen) << i;
    }
}

/* Takes one out; of those ranked, that which is first in the pencil.  On a
 * curve, where each point would beat the one before, it beats all at once. */
static unsigned take(struct chosen *chosen) {
    unsigned first = (unsigned)__builtin_ctzll(chosen->in);
    uint64_t others = chosen->ranked ? chosen->in & (chosen->in - 1) : 0;
    for (; others != 0; others &= others - 1) {
        unsigned slot = (unsigned)__builtin_ctzll(others);
        first = chosen->depth[slot] > chosen->depth[first] ? slot : first;
    }
    chosen->in &= ~(UINT64_C(1) << first);
    chosen->ranked = false;
    return first;
}

bool incode_visit_points(struct incode_walker *walker, struct incode_query *q,
                         const struct incode_frame *frame, uint32_t brick,
                         uint32_t leaves, void *context) {
    struct chosen chosen;
    (void)context;
    choose(walker, q, frame, leaves, &chosen);
    while (chosen.in != 0) {
        unsigned slot = take(&chosen);
        uint32_t id = brick * INCODE_BRICK_POINTS + slot;
        double p[3];
        incode_walker_breathe(walker, POINT_UNITS);
        if (id == q->v || id == q->b || id == q->c || id == q->best)
            continue;
        point_of(p, frame, slot);
        if (q->done && is_done(q, p))
            continue;
        if (q->question == INCODE_QUERY_APEX) {
            incode_query_consider(q, walker->tally, id, p);
            if (q->best == id) {
                incode_walker_breathe(walker,
                                      INCODE_BRICK_LEAVES * leaf_units(q));
                choose_again(q, frame, &chosen);
            }
        } else if (q->question == INCODE_QUERY_HALF_SPACE)
            consider_height(q, p);
        else if (q->question == INCODE_QUERY_NEAREST)
            consider_near(q, id, p);
        else
            consider_circle(q, id, p);
    }
    return true;
}
