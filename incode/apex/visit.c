#include <stdalign.h>
#include <string.h>

#include "lanes.h"
#include "query.h"
#include "search.h"

enum {
    LEAF_ALL = (1 << INCODE_LEAF_POINTS) - 1, /* its points, a bit each */
    LEAF_UNITS = 5, /* of work, as incode/predicates/yield.h counts it */
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

/* Of work, as incode/predicates/yield.h counts it: in twice the precision, too,
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
        incode_walker_yield(walker, leaf_units(q));
        if (q->question == INCODE_QUERY_APEX) {
            if (q->looked + 1 == INCODE_QUERY_CROWD)
                incode_walker_yield(walker, INCODE_RADICAL_UNITS);
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
        incode_walker_yield(walker, POINT_UNITS);
        if (id == q->v || id == q->b || id == q->c || id == q->best)
            continue;
        point_of(p, frame, slot);
        if (q->done && is_done(q, p))
            continue;
        if (q->question == INCODE_QUERY_APEX) {
            incode_query_consider(q, walker->tally, id, p);
            if (q->best == id) {
                incode_walker_yield(walker,
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

/* --- faces ---------------------------------------------------------------- */

/* Faces and their answers, by the index `kd`: of a vertex whose local points
 * are at hand, face after face. */

/* Index of vertex `id` among the local points, fetched and appended if it is
 * far; INCODE_AGAIN: the room for far vertices is used up. */
static enum incode_step resolve(struct incode_maker *m, uint32_t id,
                                uint16_t *index, uint32_t *page) {
    if (*index != INCODE_LOCAL_NONE)
        return INCODE_FINISHED;
    uint32_t i = incode_local_find(&m->local, id);
    if (i == INCODE_LOCAL_NONE) {
        double p[3];
        if (!incode_fetch_point(m, id, p, page))
            return INCODE_WAITING;
        i = incode_local_append(&m->local, id, p);
        if (i == INCODE_LOCAL_NONE)
            return INCODE_AGAIN;
    }
    *index = (uint16_t)i;
    return INCODE_FINISHED;
}

/* The answer at three local points. */
static void set_answer(struct incode_answer *a, const struct incode_maker *m,
                       uint16_t b, uint16_t c, uint16_t apex) {
    const struct incode_local_points *local = &m->local;
    const uint16_t near[3] = {b, c, apex};
    a->f[0] = local->vertex;
    a->near[0] = INCODE_LOCAL_NONE;
    memcpy(a->p[0], local->p0, sizeof a->p[0]);
    for (int i = 0; i < 3; i++) {
        a->f[i + 1] = local->id[near[i]];
        a->near[i + 1] = near[i];
        for (int d = 0; d < 3; d++)
            a->p[i + 1][d] = local->p[d][near[i]];
    }
}

static void set_hull(struct incode_answer *a, uint32_t v, uint32_t b,
                     uint32_t c) {
    const uint32_t f[4] = {v, b, c, INCODE_NONE};
    memcpy(a->f, f, sizeof a->f);
}

enum incode_step incode_maker_apex(struct incode_maker *m, unsigned slot,
                                   uint32_t b, uint32_t c, uint16_t near[2],
                                   struct incode_answer *a) {
    struct incode_search *s = &m->search[slot];
    uint32_t apex;
    enum incode_step r = resolve(m, b, &near[0], &s->page);
    if (r == INCODE_FINISHED)
        r = resolve(m, c, &near[1], &s->page);
    if (r != INCODE_FINISHED)
        return r;
    m->counts.calls++;
    switch (incode_apex_near(m, near[0], near[1], &apex, s)) {
    case INCODE_NEAR_FOUND:
        set_answer(a, m, near[0], near[1], (uint16_t)apex);
        return INCODE_FINISHED;
    case INCODE_NEAR_HULL:
        set_hull(a, m->local.vertex, b, c);
        return INCODE_FINISHED;
    case INCODE_NEAR_SEARCH:
    default:
        m->counts.tree_searches++;
        s->stage = INCODE_SEARCH_POINTS;
        return INCODE_WORKED;
    }
}

enum incode_step incode_maker_resume(struct incode_maker *m, unsigned slot,
                                     struct incode_answer *a) {
    struct incode_search *s = &m->search[slot];
    const struct incode_query *q = &s->query;
    uint16_t near[2] = {INCODE_LOCAL_NONE, INCODE_LOCAL_NONE};
    uint32_t apex = INCODE_LOCAL_NONE, v = m->local.vertex, b, c;
    s->advanced = false;
    if (s->stage == INCODE_SEARCH_POINTS) {
        enum incode_step r = incode_search_run(m, s);
        if (r != INCODE_FINISHED)
            return r;
        s->stage = INCODE_SEARCH_FOUND;
    }
    /* The face as it came: the search may have turned it. */
    b = q->v == v ? q->b : q->b == v ? q->c : q->v;
    c = q->v == v ? q->c : q->b == v ? q->v : q->b;
    if (q->best != INCODE_NONE) {
        apex = incode_local_find(&m->local, q->best);
        if (apex == INCODE_LOCAL_NONE)
            apex = incode_local_append(&m->local, q->best, q->best_p);
        enum incode_step r = resolve(m, b, &near[0], &s->page);
        if (r == INCODE_FINISHED)
            r = resolve(m, c, &near[1], &s->page);
        if (r != INCODE_FINISHED || apex == INCODE_LOCAL_NONE)
            return r != INCODE_FINISHED ? r : INCODE_AGAIN;
    }
    s->stage = INCODE_SEARCH_NONE;
    if (q->question == INCODE_QUERY_HALF_SPACE)
        return INCODE_WORKED; /* the face is tried again with it */
    incode_search_learn(m, q, s->looked);
    if (q->best != INCODE_NONE)
        set_answer(a, m, near[0], near[1], (uint16_t)apex);
    else
        set_hull(a, v, b, c);
    return INCODE_FINISHED;
}

/* ---- faces as they come ---- */

static bool is_at_hand(const struct incode_maker *m, uint32_t v) {
    return m->local.vertex == v && m->local.leaf == v / INCODE_LEAF_POINTS &&
           m->horizon.centre == v / INCODE_BRICK_POINTS;
}

static enum incode_step answer_near(struct incode_maker *m, unsigned slot,
                                    const uint32_t f[3],
                                    struct incode_answer *a) {
    enum incode_step r = is_at_hand(m, f[0]) ? INCODE_WORKED : INCODE_AGAIN;
    uint16_t near[2] = {INCODE_LOCAL_NONE, INCODE_LOCAL_NONE};
    for (bool begun = false; r == INCODE_AGAIN || r == INCODE_WORKED;
         begun = true) {
        if (begun && r == INCODE_WORKED && m->walker.left == 0)
            return INCODE_WORKED;
        if (r == INCODE_AGAIN) {
            near[0] = near[1] = INCODE_LOCAL_NONE;
            r = incode_maker_centre(m, slot, f[0]);
            if (r != INCODE_FINISHED)
                return r;
        }
        r = m->search[slot].stage == INCODE_SEARCH_NONE
                ? incode_maker_apex(m, slot, f[1], f[2], near, a)
                : incode_maker_resume(m, slot, a);
    }
    return r;
}

enum incode_step incode_maker_apexes(struct incode_maker *m, unsigned slot,
                                     const uint32_t (*faces)[3], uint32_t count,
                                     struct incode_answer *answers,
                                     uint32_t *done) {
    while (*done < count) {
        const uint32_t *f = faces[*done];
        struct incode_answer *a = &answers[*done];
        enum incode_step r = m->index == INCODE_KD
                                 ? answer_near(m, slot, f, a)
                                 : incode_maker_face(m, slot, f, a);
        if (r != INCODE_FINISHED)
            return r;
        ++*done;
    }
    return INCODE_FINISHED;
}

/* --- whole ---------------------------------------------------------------- */

/* MakeTetra among the whole set, as in the paper: all points (index `naive`:
 * every page of points in turn) or those of the uniform grid (index `grid`, see
 * cell_search.h). */

enum {
    SWEEP_BRICKS = 256, /* a step of index `naive` looks at, at most */
    SWEEP_AHEAD = 4,    /* pages asked for together */
    SHELLS = 4          /* cells: nearer shells, if empty, are one step */
};

static struct incode_grid grid_of(struct incode_maker *m) {
    return (struct incode_grid){&m->pager, &m->tree, m->lo, m->hi, m->cells};
}

static enum incode_step begin(struct incode_maker *m, struct incode_search *s,
                              const uint32_t f[3]) {
    double p[3][3];
    for (int i = 0; i < 3; i++)
        if (!incode_fetch_point(m, f[i], p[i], &s->page))
            return INCODE_WAITING;
    m->counts.calls++;
    incode_search_begin(m, s, f, p[0], p[1], p[2], __builtin_inf());
    s->query.boxed = s->query.strictly_beyond = false;
    s->stage = INCODE_SEARCH_POINTS;
    if (m->index == INCODE_GRID) {
        const struct incode_grid grid = grid_of(m);
        incode_cell_search_begin(&s->cells, &grid, &s->query);
    } else {
        s->sweep = m->sweep;
        s->sweep_left = m->tree.bricks;
    }
    return INCODE_FINISHED;
}

/* Every page of points in turn, from where the last search stands: several
 * searches share a page that has to be fetched. */
static enum incode_step look_at_all(struct incode_maker *m,
                                    struct incode_search *s) {
    for (int i = 0; i < SWEEP_BRICKS && s->sweep_left > 0; i++) {
        if (i > 0 && m->walker.left == 0)
            break;
        incode_walker_spend(&m->walker, 1);
        uint32_t brick = s->sweep;
        const struct incode_frame *f = incode_pager_get(&m->pager, brick);
        if (f == NULL) {
            s->page = brick;
            for (uint32_t k = 1; k < SWEEP_AHEAD && k < s->sweep_left; k++)
                (void)incode_pager_get(&m->pager, (brick + k) % m->tree.bricks);
            return INCODE_WAITING;
        }
        (void)incode_visit_points(&m->walker, &s->query, f, brick,
                                  (UINT32_C(1) << incode_frame_leaves(f)) - 1,
                                  NULL);
        m->sweep = brick;
        s->sweep = brick + 1 < m->tree.bricks ? brick + 1 : 0;
        s->sweep_left--;
        s->advanced = true;
    }
    return s->sweep_left > 0 ? INCODE_WORKED : INCODE_FINISHED;
}

static enum incode_step look_at_cells(struct incode_maker *m,
                                      struct incode_search *s) {
    struct incode_query *q = &s->query;
    struct incode_cell_search *c = &s->cells;
    const struct incode_grid grid = grid_of(m);
    bool new_shell = c->any_done;
    enum incode_step r = incode_cell_search_run(c, &grid, &m->walker, q);
    if (r == INCODE_WAITING) {
        s->page = q->missing;
        return INCODE_WAITING;
    }
    s->advanced = true;
    if (q->best == INCODE_NONE) {
        /* A facet of the hull?  Its plane may be known from another. */
        if (r == INCODE_FINISHED && c->has_below)
            incode_hull_remember(m, q, c->below);
        else if (!new_shell && incode_hull_known(m, q->pv, q->pb, q->pc))
            return INCODE_FINISHED;
    }
    return r == INCODE_WORKED ? INCODE_WORKED : INCODE_FINISHED;
}

static void whole_set_answer(struct incode_answer *a,
                             const struct incode_query *q) {
    const uint32_t f[4] = {q->v, q->b, q->c, q->best};
    const double *const p[4] = {q->pv, q->pb, q->pc, q->best_p};
    memcpy(a->f, f, sizeof a->f);
    for (int i = 0; i < 4; i++) {
        memcpy(a->p[i], p[i], sizeof a->p[i]);
        a->near[i] = INCODE_LOCAL_NONE;
    }
}

enum incode_step incode_maker_face(struct incode_maker *m, unsigned slot,
                                   const uint32_t f[3],
                                   struct incode_answer *a) {
    struct incode_search *s = &m->search[slot];
    enum incode_step r = INCODE_FINISHED;
    s->advanced = false;
    if (s->stage != INCODE_SEARCH_POINTS)
        r = begin(m, s, f);
    if (r != INCODE_FINISHED)
        return r;
    uint64_t before = m->counts.candidates;
    do {
        r = m->index == INCODE_GRID ? look_at_cells(m, s) : look_at_all(m, s);
    } while (r == INCODE_WORKED && m->index == INCODE_GRID &&
             m->walker.left > 0 && s->cells.reach <= SHELLS &&
             s->cells.list == s->cells.end);
    s->looked += m->counts.candidates - before;
    if (r == INCODE_WORKED)
        s->page = INCODE_NONE;
    if (r != INCODE_FINISHED)
        return r;
    incode_count_candidates(m, s->looked);
    whole_set_answer(a, &s->query);
    s->stage = INCODE_SEARCH_NONE;
    return INCODE_FINISHED;
}
