#include <float.h>
#include <string.h>

#include "search.h"
#include "horizon.h"
#include "lanes.h"
#include "sphere.h"

/* MakeTetra over the horizon, where the local points do not suffice.  For a
 * regular face, points are ordered along its pencil of spheres: one pass
 * keeps all that lie in the ball of the first so far, and the predicates
 * compare only what is still in the last ball. */

/* Units of work, as incode/predicates/yield.h counts them. */
enum { BOXES_A_UNIT = 5, HITS_A_UNIT = 5, BRICK_UNITS = 10 };

/* ---- what is left to be looked at ---- */

/* One look over the horizon: what a cap reaches and was not looked at yet. */
struct look {
    struct incode_horizon_cap cap;
    uint64_t done[INCODE_HORIZON_MAX / 64];
    uint32_t index[INCODE_HORIZON_MAX + INCODE_HORIZON_PADDING];
    uint32_t bricks, pages; /* indices of the former, then of the latter */
};

static void set_done(struct look *look, uint32_t index) {
    look->done[index / 64] |= UINT64_C(1) << (index % 64);
}

/* Bricks go first, those beside the vertex's own before others: they are near
 * and draw the cap in. */
static void reach(struct incode_maker *m, struct look *look) {
    const struct incode_horizon *h = &m->horizon;
    uint32_t pages[INCODE_HORIZON_MAX];
    incode_maker_yield(m, h->count / BOXES_A_UNIT);
    uint32_t count =
        incode_horizon_reached(h, &look->cap, look->done, look->index);
    look->bricks = look->pages = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t at = look->index[i];
        if (h->level[at] == 0)
            look->index[look->bricks++] = at;
        else
            pages[look->pages++] = at;
    }
    memcpy(look->index + look->bricks, pages, look->pages * sizeof pages[0]);
}

enum { CROWD = 32 /* boxes: so many are many */ };

/* Where a cap reaches many boxes, points may lie on one sphere up to rounding:
 * empty spheres met before rule out others. */
static void bound(struct incode_maker *m, const struct incode_query *q,
                  struct look *look) {
    struct incode_radical_bound radical;
    if (look->bricks + look->pages < CROWD || q->best == INCODE_NONE ||
        look->cap.bounded)
        return;
    const double *const p[4] = {q->pv, q->pb, q->pc, q->best_p};
    incode_maker_yield(m, INCODE_RADICAL_UNITS);
    incode_radical_bound_set(&radical, &m->empty, p, q->scale, q->sphere.n);
    if (!radical.set)
        return;
    incode_horizon_bound(&m->horizon, &look->cap, q->scale, &radical);
    reach(m, look);
}

/* Splits the pages that the cap reaches; false: one is missing, or there is no
 * room. */
static bool split(struct incode_maker *m, struct look *look,
                  uint32_t *missing) {
    for (uint32_t i = 0; i < look->pages; i++) {
        uint32_t at = look->index[look->bricks + i];
        if (incode_horizon_split(&m->horizon, &m->walker, at, &look->cap,
                                 missing) != INCODE_FINISHED)
            return false;
        set_done(look, at);
    }
    return true;
}

/* ---- any face: by spheres ---- */

/* A bound of the errors of a vector's components is small enough to vanish
 * among the roundings to single precision. */
static bool is_sure(const double a[3], const double bound[3]) {
    return INCODE_SPHERE_EPS * bound[0] < 0x1p-26 * incode_max_norm(a) &&
           INCODE_SPHERE_EPS * bound[1] < 0x1p-26 * incode_max_norm(a) &&
           INCODE_SPHERE_EPS * bound[2] < 0x1p-26 * incode_max_norm(a);
}

static bool sphere_cap(const struct incode_horizon *h,
                       const struct incode_query *q,
                       struct incode_horizon_cap *cap) {
    const struct incode_sphere *s = &q->sphere;
    double det = s->det - INCODE_SPHERE_EPS * s->pdet;
    return s->has_apex && is_sure(s->m, s->pm) && is_sure(s->n, s->pn) &&
           incode_horizon_cap(h, cap, q->pv, q->scale, s->m, det > 0 ? det : 0,
                              s->n);
}

/* That of all spheres through the face. */
static bool plane_cap(const struct incode_horizon *h,
                      const struct incode_query *q,
                      struct incode_horizon_cap *cap) {
    const struct incode_sphere *s = &q->sphere;
    return is_sure(s->n, s->pn) &&
           incode_horizon_cap(h, cap, q->pv, q->scale, s->n, 0, s->n);
}

/* Where in the pencil of the face's circle the middle of a box is, about; what
 * is not beyond the face comes last.  c0: centre of the circle, relative to the
 * vertex in the horizon's units. */
static float middle(const struct incode_horizon *h, const struct look *look,
                    const float c0[3], uint32_t i) {
    float square = 0, level = 0, along = 0;
    for (int d = 0; d < 3; d++) {
        float y = (h->lo[d][i] + h->hi[d][i]) * 0.5F - look->cap.v[d];
        square += y * y;
        level += y * look->cap.n[d];
        along += y * c0[d];
    }
    /* Less than 3 degrees above the face tells nothing. */
    return level > 0 && level * level > 0.0025F * square
               ? (square - 2 * along) / level
               : 1e20F * (1 + square);
}

/* The centre of the face's circle, about, in the horizon's units. */
static void set_middle(const struct incode_make *n, float c0[3]) {
    const struct incode_sphere *s = &n->sphere;
    double cn[3], nb[3], nn = incode_dot(s->n, s->n);
    double ratio = n->maker->horizon.scale / n->maker->local.scale;
    incode_cross(cn, n->rc, s->n);
    incode_cross(nb, s->n, n->rb);
    for (int d = 0; d < 3; d++) {
        double c = (s->bb * cn[d] + s->cc * nb[d]) * 0.5 / nn * ratio;
        c0[d] = c > -1e15 && c < 1e15 ? (float)c : 0;
    }
}

/* Puts what is first in the pencil first; where it is a page, that alone is
 * left. */
static void choose_first(struct incode_maker *m, struct look *look,
                         const float c0[3]) {
    const struct incode_horizon *h = &m->horizon;
    uint32_t count = look->bricks + look->pages, first = 0;
    incode_maker_yield(m, count / BOXES_A_UNIT);
    float least = __builtin_inff();
    for (uint32_t i = 0; i < count; i++) {
        float t = middle(h, look, c0, look->index[i]);
        if (t < least) {
            least = t;
            first = i;
        }
    }
    uint32_t at = look->index[first];
    if (first >= look->bricks) {
        look->bricks = 0;
        look->pages = 1;
    } else {
        look->index[first] = look->index[0];
    }
    look->index[0] = at;
}

/* The points of a brick that the cap may hold, one bit each; false: the brick
 * is missing.  *frame: set where there are any. */
static bool points_of(struct incode_maker *m, struct look *look, uint32_t index,
                      uint64_t *in, const struct incode_frame **frame,
                      uint32_t *missing) {
    struct incode_horizon *h = &m->horizon;
    uint32_t brick = h->page[index];
    const struct incode_frame *f = NULL;
    *missing = brick;
    incode_maker_yield(m, BRICK_UNITS);
    m->counts.candidates += INCODE_BRICK_POINTS;
    if (h->copy[index] == INCODE_NO_COPY) {
        f = incode_pager_get(&m->pager, brick);
        if (f == NULL)
            return false;
        incode_horizon_copy(h, index, f);
    }
    *in = incode_horizon_points(h, index, &look->cap);
    set_done(look, index);
    if (*in != 0 && f == NULL)
        f = incode_pager_get(&m->pager, brick);
    *frame = f;
    return *in == 0 || f != NULL;
}

/* Considers the points of the bricks, up to a first candidate; false: one is
 * missing, or the best's sphere tells nothing. */
static bool visit_bricks(struct incode_maker *m, struct incode_query *q,
                         struct look *look) {
    bool none = q->best == INCODE_NONE;
    for (uint32_t i = 0; i < look->bricks; i++) {
        const struct incode_frame *f;
        uint32_t leaves = 0, best = q->best;
        uint64_t in;
        if (!points_of(m, look, look->index[i], &in, &f, &q->missing))
            return false;
        for (unsigned k = 0; k < INCODE_BRICK_LEAVES; k++)
            leaves |= (uint32_t)((in >> (k * INCODE_LEAF_POINTS) & 0xff) != 0)
                      << k;
        if (leaves != 0)
            leaves &= (UINT32_C(1) << incode_frame_leaves(f)) - 1;
        if (leaves != 0)
            (void)incode_visit_points(&m->walker, q, f, f->number, leaves,
                                      NULL);
        if (q->best == best)
            continue;
        if (none)
            break;
        if (!sphere_cap(&m->horizon, q, &look->cap))
            return false;
    }
    return true;
}

enum { TRIES = 8 /* boxes, for a first candidate */ };

/* At first, only points that are clearly beyond the face count, so that those
 * in its plane need not be told apart in vain.  What is coplanar up to rounding
 * is left to those who know of half-spaces. */
static bool search_spheres(struct incode_make *n, struct incode_search *s) {
    struct incode_maker *m = n->maker;
    const struct incode_horizon *h = &m->horizon;
    struct incode_query *q = &s->query;
    struct look look = {.done = {0}};
    float c0[3];
    bool strictly = q->best == INCODE_NONE;
    uint32_t tries = 0;
    if (strictly)
        set_middle(n, c0);
    q->done = q->boxed = q->round = false;
    for (;;) {
        uint32_t best = q->best;
        q->strictly_beyond = strictly;
        if (best == INCODE_NONE ? tries++ == TRIES
                                : incode_sphere_is_near_degenerate(&q->sphere))
            return false;
        if (!(best == INCODE_NONE ? plane_cap(h, q, &look.cap)
                                  : sphere_cap(h, q, &look.cap)))
            return false;
        reach(m, &look);
        bound(m, q, &look);
        if (look.bricks + look.pages == 0 && !strictly)
            return true;
        if (look.bricks + look.pages == 0) {
            strictly = false;
            memset(look.done, 0, sizeof look.done);
            continue;
        }
        if (best == INCODE_NONE && strictly)
            choose_first(m, &look, c0);
        if (!visit_bricks(m, q, &look))
            return false;
        if (best == q->best || best != INCODE_NONE) {
            if (!split(m, &look, &q->missing))
                return false;
            if (look.pages == 0 && best != INCODE_NONE)
                return true;
        }
        if (q->best != best && strictly) {
            strictly = false;
            memset(look.done, 0, sizeof look.done);
            incode_maker_yield(m, INCODE_LESSEN_UNITS);
            incode_search_last(m, s);
        }
    }
}

/* ---- a regular face: along its pencil ---- */

enum { BATCH = 8 /* bricks looked at before the ball is drawn in */ };

/* The bit of a vertex in its brick, 0 in others. */
static uint64_t bit_of(uint32_t id, uint32_t brick) {
    return (uint64_t)(id / INCODE_BRICK_POINTS == brick)
           << id % INCODE_BRICK_POINTS;
}

/* The bits of a brick's points, but for the face's and the best so far, which
 * are in the ball. */
static uint64_t others(const struct incode_query *q,
                       const struct incode_frame *frame) {
    uint32_t brick = frame->number;
    uint64_t all = frame->count < INCODE_BRICK_POINTS
                       ? (UINT64_C(1) << frame->count) - 1
                       : UINT64_MAX;
    return all & ~(bit_of(q->v, brick) | bit_of(q->b, brick) |
                   bit_of(q->c, brick) | bit_of(q->best, brick));
}

/* The cap of the pencil's sphere at q->t, or of that of a best without a place
 * there, or of all spheres. */
static bool pencil_cap(const struct incode_make *n,
                       const struct incode_query *q,
                       struct incode_horizon_cap *cap) {
    const struct incode_horizon *h = &n->maker->horizon;
    const struct incode_pencil *pencil = &n->pencil;
    double m[3], t = incode_pencil_later(pencil, q->t);
    if (!(q->t < __builtin_inf()))
        return sphere_cap(h, q, cap) || plane_cap(h, q, cap);
    for (int d = 0; d < 3; d++)
        m[d] = 2 * pencil->c0[d] + t * pencil->n[d];
    return incode_horizon_cap(h, cap, q->pv, q->scale, m, 1, pencil->n);
}

/* Looks at some bricks, and draws the query's ball in.  False: one is missing,
 * or too much lies in the cap. */
static bool look_at(struct incode_make *n, struct incode_query *q,
                    struct look *look, const uint32_t *index, uint32_t count,
                    struct incode_hits *hits) {
    for (uint32_t i = 0; i < count; i++) {
        const struct incode_frame *f;
        uint64_t in;
        if (!points_of(n->maker, look, index[i], &in, &f, &q->missing))
            return false;
        incode_maker_yield(n->maker, (uint32_t)__builtin_popcountll(in) / 2);
        if (in != 0 &&
            !incode_hits_add(&n->pencil, q, f, in & others(q, f), hits))
            return false;
    }
    incode_maker_yield(n->maker, (hits->count - hits->placed) / HITS_A_UNIT);
    incode_hits_place(q, &n->pencil, hits);
    return true;
}

/* The same for a better one, with the bound that holds for all before it. */
static bool next_cap(const struct incode_make *n, const struct incode_query *q,
                     struct look *look) {
    struct incode_horizon_cap old = look->cap;
    if (!pencil_cap(n, q, &look->cap))
        return false;
    look->cap.bounded = old.bounded;
    memcpy(look->cap.g, old.g, sizeof old.g);
    look->cap.level = old.level;
    look->cap.slack = old.slack;
    return true;
}

/* Looks at the bricks that the ball reaches, near ones first, and draws it in;
 * *much: by so much that the rest is to be chosen again.  False: one is
 * missing, or too much lies in the cap. */
static bool look_at_bricks(struct incode_make *n, struct incode_query *q,
                           struct look *look, struct incode_hits *hits,
                           bool *much) {
    double square = q->square;
    uint32_t batch = square < __builtin_inf() ? BATCH : 1;
    *much = false;
    for (uint32_t i = 0; i < look->bricks && !*much; i += batch) {
        uint32_t left = look->bricks - i;
        double t = q->t;
        left = left < batch ? left : batch;
        if (!look_at(n, q, look, look->index + i, left, hits))
            return false;
        *much = q->square < 0.7 * square && i + left < look->bricks;
        if (q->t < t && !next_cap(n, q, look))
            return false;
    }
    return true;
}

/* Looks at all that the ball reaches. */
static bool look_around(struct incode_make *n, struct incode_query *q,
                        struct incode_hits *hits) {
    struct incode_maker *m = n->maker;
    struct look look = {.done = {0}};
    float c0[3];
    bool much;
    set_middle(n, c0);
    hits->count = hits->placed = 0;
    if (!pencil_cap(n, q, &look.cap))
        return false;
    for (;;) {
        bool none = q->best == INCODE_NONE && !(q->t < __builtin_inf());
        reach(m, &look);
        bound(m, q, &look);
        if (look.bricks + look.pages == 0)
            return true;
        /* Those who know of half-spaces do better. */
        if (none && n->doubtful && look.bricks > CROWD)
            return false;
        if (none)
            choose_first(m, &look, c0);
        if (!look_at_bricks(n, q, &look, hits, &much) ||
            (!much && !split(m, &look, &q->missing)))
            return false;
        if (!much && look.pages == 0)
            return true;
    }
}

/* The first of the hits and of the best so far, at t, which does not count if a
 * hit's place is certainly before. */
static void settle(struct incode_make *n, struct incode_query *q, double t,
                   const struct incode_hits *hits) {
    struct incode_tally *tally = &n->maker->counts.tally;
    double last = incode_pencil_later(&n->pencil, q->t);
    bool any = q->best != INCODE_NONE && t <= last;
    for (uint32_t i = 0; i < hits->count; i++) {
        const double p[3] = {hits->p[0][i], hits->p[1][i], hits->p[2][i]};
        bool beyond = hits->t[i] < __builtin_inf();
        incode_yield_after(&tally->yield, 2);
        if (!incode_hits_contends(q, hits, i, last) ||
            (!beyond && incode_orient3d(tally, n->pv, n->pb, n->pc, p) <= 0) ||
            (any &&
             incode_in_sphere(tally, n->pv, n->pb, n->pc, q->best_p, p) <= 0))
            continue;
        any = true;
        q->best = hits->id[i];
        memcpy(q->best_p, p, sizeof q->best_p);
    }
}

static void set_query(struct incode_make *n, struct incode_query *q) {
    const struct incode_local_points *local = &n->maker->local;
    memcpy(q->pv, n->pv, sizeof q->pv);
    memcpy(q->pb, n->pb, sizeof q->pb);
    memcpy(q->pc, n->pc, sizeof q->pc);
    q->question = INCODE_QUERY_APEX;
    q->v = local->vertex;
    q->b = local->id[n->b];
    q->c = local->id[n->c];
    q->scale = local->scale;
    q->best = INCODE_NONE;
    q->boxed = q->round = q->strictly_beyond = q->done = q->shrinking = false;
    q->radical.set = false;
    q->pages_max = 0;
    memcpy(q->sphere.n, n->sphere.n, sizeof q->sphere.n);
    memcpy(q->sphere.pn, n->sphere.pn, sizeof q->sphere.pn);
    q->sphere.has_apex = q->large = false;
    q->t = q->square = __builtin_inf();
}

static bool search_pencil(struct incode_make *n, struct incode_search *s) {
    struct incode_maker *m = n->maker;
    struct incode_query *q = &s->query;
    struct incode_hits hits;
    double at = -__builtin_inf();
    set_query(n, q);
    if (n->best != INCODE_LOCAL_NONE) {
        double r[3];
        for (int d = 0; d < 3; d++)
            q->best_p[d] = m->local.p[d][n->best];
        q->best = m->local.id[n->best];
        incode_query_relative(r, q, q->best_p);
        if (incode_pencil_place(&n->pencil, r, &at)) {
            incode_hits_draw_in(q, &n->pencil, at);
        } else {
            if (n->bare)
                incode_make_sphere(n);
            if (incode_sphere_is_near_degenerate(&n->sphere))
                return false;
            q->sphere = n->sphere;
        }
    }
    if (!look_around(n, q, &hits))
        return false;
    settle(n, q, at, &hits);
    return true;
}

bool incode_apex_around(struct incode_make *n, struct incode_search *s) {
    struct incode_maker *m = n->maker;
    uint64_t before = m->counts.candidates;
    bool found = false;
    if (m->horizon.count > 0 && n->regular && !n->degenerate.known)
        found = search_pencil(n, s);
    if (!found) {
        incode_search_from(n, s);
        /* Of a face of the hull's side, half-spaces tell more. */
        if (m->horizon.count > 0 && !(n->degenerate.known && n->regular &&
                                      n->best == INCODE_LOCAL_NONE))
            found = search_spheres(n, s);
    }
    s->looked = m->local.near + m->counts.candidates - before;
    return found;
}

/* --- close candidates ----------------------------------------------------- */

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
