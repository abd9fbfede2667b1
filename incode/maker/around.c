#include <float.h>
#include <string.h>

#include "apex.h"
#include "incode/predicates/simd.h"

/* MakeTetra among the bricks around, where the local points do not suffice.
 * For a regular face, points are ordered along its pencil of spheres: one pass
 * keeps all that lie in the ball of the first so far, and the predicates
 * compare only what is still in the last ball. */

/* wall - p, infinite only where the wall is. */
static double gap(double wall, double p)
{
    double difference = wall - p;
    return wall < __builtin_inf() && difference > DBL_MAX ? DBL_MAX
                                                          : difference;
}

/* The box of the list as walls around the vertex. */
static void set_walls(double wall[8], const struct incode_neighbours *list,
                      const double pv[3], double scale)
{
    for (int d = 0; d < 3; d++) {
        wall[d] = gap(list->box_hi[d], pv[d]) * scale;
        wall[4 + d] = gap(-list->box_lo[d], -pv[d]) * scale;
    }
    wall[3] = wall[7] = __builtin_inf();
}

/* Box after box, up to that of the list, for a first candidate. */
static enum incode_walk find_first(struct incode_maker *m,
                                   struct incode_search *s, incode_visit *visit,
                                   void *context)
{
    struct incode_query *q = &s->query;
    enum incode_walk r = INCODE_WALK_DONE;
    while (r == INCODE_WALK_DONE && q->best == INCODE_NONE && !q->round) {
        s->radius *= 2;
        incode_search_box(m, s);
        if (!q->boxed || !incode_neighbours_holds(&m->neighbours, q->lo, q->hi))
            return INCODE_WALK_STOP;
        r = incode_neighbours_visit(&m->neighbours, &m->walker, q, visit,
                                    context);
        if (r != INCODE_WALK_DONE)
            break;
        q->done = true;
        memcpy(q->done_lo, q->lo, sizeof q->lo);
        memcpy(q->done_hi, q->hi, sizeof q->hi);
    }
    return r;
}

/* ---- any face: by spheres ---- */

static bool search_spheres(struct incode_make *n, struct incode_search *s)
{
    struct incode_maker *m = n->maker;
    const struct incode_neighbours *list = &m->neighbours;
    struct incode_query *q = &s->query;
    alignas(64) double wall[8];
    enum incode_walk r = INCODE_WALK_DONE;
    if (q->best == INCODE_NONE) {
        r = find_first(m, s, incode_visit_points, NULL);
        if (r == INCODE_WALK_DONE)
            incode_search_last(s);
    }
    bool whole = q->boxed && incode_neighbours_holds(list, q->lo, q->hi);
    /* Without a ball of its own, a sphere does not fit. */
    if (r != INCODE_WALK_DONE || (!whole && (!q->round || q->lens)) ||
        incode_neighbours_visit(list, &m->walker, q, incode_visit_points,
                                NULL) != INCODE_WALK_DONE)
        return false;
    if (whole)
        return true;
    set_walls(wall, list, q->pv, q->scale);
    if (incode_sphere_fits(wall, &q->sphere))
        return true;
    q->done = true;
    memcpy(q->done_lo, list->box_lo, sizeof q->done_lo);
    memcpy(q->done_hi, list->box_hi, sizeof q->done_hi);
    return false;
}

/* ---- a regular face: along its pencil ---- */

enum {
    HITS = 64, /* kept at a time */
    BATCH = 8  /* bricks looked at before the ball is drawn in */
};

/* Points in the ball, and where in the pencil: infinite where they are not
 * clearly beyond the face. */
struct hits {
    alignas(64) double p[3][HITS];
    alignas(64) double t[HITS];
    uint32_t id[HITS], count;
    uint32_t placed; /* so many of them, at least, have a place */
};

/* The ball of the pencil's sphere at t, widened by 1e-6 of its size. */
static void draw_in(struct incode_query *q, const struct incode_pencil *pencil,
                    double t)
{
    double square = 0.25 * t * t;
    for (int d = 0; d < 3; d++) {
        q->centre[d] = pencil->c0[d] + 0.5 * t * pencil->n[d];
        square += pencil->c0[d] * pencil->c0[d];
    }
    q->t = t;
    q->square = square * (1 + 4e-6);
    double far = 2 * pencil->size + __builtin_fabs(t); /* above the radius */
    q->plane_slack =
        INCODE_SPHERE_TINY + INCODE_SPHERE_EPS * 6 * q->sphere.pn[0] * far;
    q->round = true;
}

INCODE_INLINE incode_vd dot(const double a[3], const incode_vd b[3])
{
    return incode_vd_all(a[0]) * b[0] + incode_vd_all(a[1]) * b[1] +
           incode_vd_all(a[2]) * b[2];
}

/* incode_pencil_place for a vector of points at x, y and z; infinite where it
 * is false. */
INCODE_INLINE incode_vd places(const struct incode_query *q,
                               const struct incode_pencil *pencil,
                               const double *const xyz[3], uint32_t i)
{
    incode_vd r[3], square = incode_vd_all(0);
    incode_vd far = incode_vd_all(INCODE_PENCIL_LEAST);
    for (int d = 0; d < 3; d++) {
        /* Scaled first: a difference of large numbers could overflow. */
        r[d] = incode_vd_load(xyz[d] + i) * incode_vd_all(q->scale) -
               incode_vd_all(q->pv[d] * q->scale);
        far = incode_vd_max(incode_vd_abs(r[d]), far);
        square += r[d] * r[d];
    }
    incode_vd beyond = dot(pencil->n, r);
    incode_vd t = (square - incode_vd_all(2) * dot(pencil->c0, r)) / beyond;
    return incode_vd_select(beyond > incode_vd_all(2e-3) * far, t,
                            incode_vd_all(__builtin_inf()));
}

/* Sets the places that are missing, and draws the ball in to the first of them.
 */
static void place(struct incode_query *q, const struct incode_pencil *pencil,
                  struct hits *hits)
{
    if (hits->placed == hits->count)
        return;
    const double *const xyz[3] = {hits->p[0], hits->p[1], hits->p[2]};
    incode_vd infinite = incode_vd_all(__builtin_inf()), least = infinite;
    incode_vd end = incode_vd_all(hits->count), lane = incode_vd_count();
    for (uint32_t i = hits->placed / INCODE_VD_LANES * INCODE_VD_LANES;
         i < hits->count; i += INCODE_VD_LANES) {
        incode_vd t = places(q, pencil, xyz, i);
        t = incode_vd_select(incode_vd_all(i) + lane < end, t, infinite);
        *(incode_vd *)(hits->t + i) = t;
        least = incode_vd_min(t, least);
    }
    hits->placed = hits->count;
    double first = incode_vd_least_of(least);
    if (first < q->t)
        draw_in(q, pencil, first);
}

/* Draws the ball in to the first of the points of some leaves (context: the
 * pencil); what repeats a brick's last point does no harm. */
static bool visit_first(struct incode_walker *walker, struct incode_query *q,
                        const struct incode_frame *frame, uint32_t brick,
                        uint32_t leaves, void *context)
{
    const struct incode_pencil *pencil = context;
    const struct incode_brick *b = &frame->page.brick;
    const double *const xyz[3] = {b->x, b->y, b->z};
    incode_vd least = incode_vd_all(__builtin_inf());
    (void)brick;
    *walker->candidates +=
        (unsigned)__builtin_popcount(leaves) * INCODE_LEAF_POINTS;
    for (; leaves != 0; leaves &= leaves - 1) {
        uint32_t slot = (uint32_t)__builtin_ctz(leaves) * INCODE_LEAF_POINTS;
        for (uint32_t i = 0; i < INCODE_LEAF_POINTS; i += INCODE_VD_LANES)
            least = incode_vd_min(places(q, pencil, xyz, slot + i), least);
    }
    double first = incode_vd_least_of(least);
    if (first < q->t)
        draw_in(q, pencil, first);
    return true;
}

/* Whether a hit may be the first, or tie with it. */
static bool contends(const struct incode_query *q, const struct hits *hits,
                     uint32_t i, double last)
{
    double square = 0;
    if (hits->t[i] < __builtin_inf())
        return hits->t[i] <= last;
    for (int d = 0; d < 3; d++) {
        double r = hits->p[d][i] * q->scale - q->pv[d] * q->scale;
        square += (r - q->centre[d]) * (r - q->centre[d]);
    }
    return !(square > q->square);
}

/* Drops what has fallen out of the ball. */
static void thin_out(const struct incode_query *q,
                     const struct incode_pencil *pencil, struct hits *hits)
{
    double last = incode_pencil_later(pencil, q->t);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < hits->count; i++) {
        if (!contends(q, hits, i, last))
            continue;
        for (int d = 0; d < 3; d++)
            hits->p[d][kept] = hits->p[d][i];
        hits->id[kept] = hits->id[i];
        hits->t[kept++] = hits->t[i];
    }
    hits->count = hits->placed = kept;
}

/* The bit of a vertex in its brick, 0 in others. */
static uint64_t bit_of(uint32_t id, uint32_t brick)
{
    return (uint64_t)(id / INCODE_BRICK_POINTS == brick)
           << id % INCODE_BRICK_POINTS;
}

/* false: there are too many. */
static bool add_hits(struct incode_make *n, struct incode_query *q,
                     const struct incode_frame *frame, uint64_t in,
                     struct hits *hits)
{
    const struct incode_brick *b = &frame->page.brick;
    for (; in != 0; in &= in - 1) {
        uint32_t slot = (uint32_t)__builtin_ctzll(in);
        if (hits->count == HITS) {
            place(q, &n->pencil, hits);
            thin_out(q, &n->pencil, hits);
            if (hits->count == HITS)
                return false;
        }
        uint32_t i = hits->count++;
        hits->p[0][i] = b->x[slot];
        hits->p[1][i] = b->y[slot];
        hits->p[2][i] = b->z[slot];
        hits->id[i] = frame->number * INCODE_BRICK_POINTS + slot;
    }
    return true;
}

/* The bits of a brick's points, but for the face's and the best so far, which
 * are in the ball. */
static uint64_t others(const struct incode_query *q,
                       const struct incode_frame *frame)
{
    uint32_t brick = frame->number;
    uint64_t all = frame->count < INCODE_BRICK_POINTS
                       ? (UINT64_C(1) << frame->count) - 1
                       : UINT64_MAX;
    return all & ~(bit_of(q->v, brick) | bit_of(q->b, brick) |
                   bit_of(q->c, brick) | bit_of(q->best, brick));
}

/* Looks at some bricks of the list, and draws the query's ball in, which this
 * one holds.  False: one is missing, or too much lies in the ball. */
static bool look_at(struct incode_make *n, struct incode_query *q,
                    const struct incode_neighbours_ball *ball,
                    const uint32_t *index, uint32_t count, struct hits *hits)
{
    struct incode_neighbours *list = &n->maker->neighbours;
    struct incode_pager *pager = &n->maker->pager;
    uint32_t brick[BATCH], met = 0;
    uint64_t in[BATCH];
    n->maker->counts.candidates += (uint64_t)count * INCODE_BRICK_POINTS;
    for (uint32_t i = 0; i < count; i++) {
        brick[met] = list->brick[index[i]];
        if (list->copy[index[i]] == INCODE_NO_COPY) {
            const struct incode_frame *f = incode_pager_get(pager, brick[met]);
            if (f == NULL)
                return false;
            incode_neighbours_copy(list, index[i], f);
        }
        in[met] = incode_neighbours_points(list, index[i], ball);
        met += in[met] != 0;
    }
    for (uint32_t i = 0; i < met; i++) {
        const struct incode_frame *f = incode_pager_get(pager, brick[i]);
        if (f == NULL || !add_hits(n, q, f, in[i] & others(q, f), hits))
            return false;
    }
    place(q, &n->pencil, hits);
    return true;
}

/* Looks at the bricks of the list that meet the ball.  Of many, those beside
 * the vertex's own, by number, are near and go first: where they draw the ball
 * in, the rest are chosen again. */
static bool look_around(struct incode_make *n, struct incode_query *q,
                        struct hits *hits)
{
    const struct incode_neighbours *list = &n->maker->neighbours;
    uint32_t index[INCODE_NEIGHBOURS_BRICKS + INCODE_NEIGHBOURS_PADDING];
    struct incode_neighbours_ball ball;
    uint32_t count = incode_neighbours_in_ball(list, q, &ball, index);
    hits->count = hits->placed = 0;
    while (count > BATCH) {
        double square = q->square;
        uint32_t first = 0;
        while (first + BATCH < count &&
               list->brick[index[first + BATCH / 2]] < list->centre)
            first++;
        if (!look_at(n, q, &ball, index + first, BATCH, hits))
            return false;
        if (q->square > 0.7 * square) {
            memmove(index + first, index + first + BATCH,
                    (count - first - BATCH) * sizeof index[0]);
            count -= BATCH;
            break;
        }
        hits->count = hits->placed = 0;
        count = incode_neighbours_in_ball(list, q, &ball, index);
    }
    for (uint32_t i = 0; i < count; i += BATCH) {
        uint32_t left = count - i;
        if (i > 0)
            incode_neighbours_set_ball(list, q, &ball);
        if (!look_at(n, q, &ball, index + i, left < BATCH ? left : BATCH, hits))
            return false;
    }
    return true;
}

/* The first of the hits and of the best so far, at t, which does not count if a
 * hit's place is certainly before; false: it is not clearly beyond the face.
 */
static bool settle(struct incode_make *n, struct incode_query *q, double t,
                   const struct hits *hits)
{
    struct incode_tally *tally = &n->maker->counts.tally;
    double last = incode_pencil_later(&n->pencil, q->t);
    bool placed = t <= last, any = placed;
    for (uint32_t i = 0; i < hits->count; i++) {
        const double p[3] = {hits->p[0][i], hits->p[1][i], hits->p[2][i]};
        bool beyond = hits->t[i] < __builtin_inf();
        if (!contends(q, hits, i, last) ||
            (!beyond && incode_orient3d(tally, n->pv, n->pb, n->pc, p) <= 0) ||
            (any &&
             incode_in_sphere(tally, n->pv, n->pb, n->pc, q->best_p, p) <= 0))
            continue;
        any = true;
        placed = beyond;
        q->best = hits->id[i];
        memcpy(q->best_p, p, sizeof q->best_p);
    }
    return placed;
}

static void set_query(struct incode_make *n, struct incode_query *q)
{
    const struct incode_local_points *local = &n->maker->local;
    memcpy(q->pv, n->pv, sizeof q->pv);
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
    q->t = __builtin_inf();
}

static bool search_pencil(struct incode_make *n, struct incode_search *s)
{
    struct incode_maker *m = n->maker;
    struct incode_query *q = &s->query;
    struct hits hits;
    alignas(64) double wall[8];
    double at = __builtin_inf();
    set_query(n, q);
    if (n->best == INCODE_LOCAL_NONE) {
        double radius = m->local.radius;
        s->radius = radius > DBL_MIN ? radius : DBL_MIN;
        if (find_first(m, s, visit_first, &n->pencil) != INCODE_WALK_DONE)
            return false;
        draw_in(q, &n->pencil, incode_pencil_later(&n->pencil, q->t));
    } else {
        double r[3];
        for (int d = 0; d < 3; d++)
            q->best_p[d] = m->local.p[d][n->best];
        q->best = m->local.id[n->best];
        incode_query_relative(r, q, q->best_p);
        if (!incode_pencil_place(&n->pencil, r, &at))
            return false; /* too near the face's plane */
        draw_in(q, &n->pencil, at);
    }
    if (!look_around(n, q, &hits) || !settle(n, q, at, &hits))
        return false;
    set_walls(wall, &m->neighbours, q->pv, q->scale);
    return incode_cap_fits(wall, &n->pencil,
                           incode_pencil_later(&n->pencil, q->t));
}

bool incode_apex_around(struct incode_make *n, struct incode_search *s)
{
    struct incode_maker *m = n->maker;
    uint64_t before = m->counts.candidates;
    bool found = false;
    if (m->neighbours.count > 0 && n->regular && !n->degenerate.known)
        found = search_pencil(n, s);
    if (!found) {
        incode_search_from(n, s);
        if (m->neighbours.count > 0)
            found = search_spheres(n, s);
    }
    s->looked = m->local.near + m->counts.candidates - before;
    return found;
}
