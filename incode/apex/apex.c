#include <float.h>
#include <string.h>

#include "search.h"
#include "incode/predicates/check.h"
#include "lanes.h"
#include "incode/predicates/simd.h"

/* MakeTetra: the apex of a face.  Among the local points, single precision
 * proposes and the sphere's rigorous bound leaves the few that the predicates
 * must compare; the answer stands when the closed cap of the sphere lies in the
 * box of the local points.  Otherwise the tree is searched, near boxes first.
 */

/* ---- among the local points ---- */

enum {
    CONSIDER_UNITS = 2, /* of incode/predicates/yield.h */
    FACE_UNITS = 10,
    POINTS_A_UNIT = 4 /* of a look at all of them */
};

static void yield_over_points(const struct incode_make *n) {
    struct incode_maker *m = n->maker;
    incode_maker_yield(m, FACE_UNITS + m->local.near / POINTS_A_UNIT);
}

/* A regular face's circumcentre is right to 1e-9 of its distance: the sine of
 * its angle at v is at least 1/100. */
static void set_pencil(struct incode_make *f, const struct incode_sphere *s) {
    double cn[3], nb[3], nn = incode_dot(s->n, s->n);
    double product = s->lb * s->lc, size = s->lb > s->lc ? s->lb : s->lc;
    f->regular = nn > 1e-4 * product * product && product > 1e-12 && size < 1e6;
    if (!f->regular)
        return;
    incode_cross(cn, f->rc, s->n);
    incode_cross(nb, s->n, f->rb);
    double inverse = 1 / nn, unit = __builtin_sqrt(inverse);
    double sb = 0.5 * inverse * s->bb, sc = 0.5 * inverse * s->cc;
    for (int d = 0; d < 3; d++) {
        f->pencil.c0[d] = sb * cn[d] + sc * nb[d];
        f->pencil.n[d] = s->n[d] * unit;
    }
    double far = incode_max_norm(f->pencil.c0);
    f->pencil.size = far > size ? far : size;
}

static void copy_point(double p[3], const struct incode_local_points *local,
                       uint32_t i) {
    p[0] = local->p[0][i];
    p[1] = local->p[1][i];
    p[2] = local->p[2][i];
}

/* Takes i as the best if it is strictly beyond the face and inside the best's
 * sphere. */
static void consider(struct incode_make *n, uint32_t i) {
    struct incode_local_points *local = &n->maker->local;
    struct incode_tally *tally = &n->maker->counts.tally;
    if (i == n->b || i == n->c || i == n->best || i == local->self)
        return;
    incode_yield_after(&tally->yield, CONSIDER_UNITS);
    double p[3], r[3];
    incode_local_relative(local, i, r);
    bool any = n->best != INCODE_LOCAL_NONE, inside = !any;
    if (any) {
        double value = incode_sphere_value(&n->sphere, r);
        double error = incode_sphere_error(&n->sphere, r);
        if (value < -error)
            return;
        inside = value > error;
    }
    double level = incode_dot(n->sphere.n, r);
    double error = incode_plane_error(&n->sphere, r);
    if (level < -error)
        return;
    copy_point(p, local, i);
    if (!(level > error) && incode_orient3d(tally, n->pv, n->pb, n->pc, p) <= 0)
        return;
    if (!inside &&
        incode_in_sphere(tally, n->pv, n->pb, n->pc, n->store[3], p) < 0)
        return;
    n->best = i;
    memcpy(n->store[3], p, sizeof p);
    incode_sphere_apex(&n->sphere, n->rb, n->rc, r);
    if (incode_sphere_is_ill_conditioned(&n->sphere)) {
        incode_yield_after(&tally->yield, INCODE_FINE_UNITS);
        incode_sphere_refine(&n->sphere, n->pv, n->pb, n->pc, p, local->scale);
    }
}

void incode_make_sphere(struct incode_make *n) {
    double r[3];
    copy_point(n->store[3], &n->maker->local, n->best);
    incode_local_relative(&n->maker->local, n->best, r);
    incode_sphere_apex(&n->sphere, n->rb, n->rc, r);
    if (incode_sphere_is_ill_conditioned(&n->sphere)) {
        incode_maker_yield(n->maker, INCODE_FINE_UNITS);
        incode_sphere_refine(&n->sphere, n->pv, n->pb, n->pc, n->store[3],
                             n->maker->local.scale);
    }
    n->bare = false;
}

/* The best of those in doubt, in twice the precision if that can tell: the
 * first of some meets the next of them. */
static bool rank_first(struct incode_make *n, const uint16_t *first,
                       uint32_t count) {
    const struct incode_local_points *local = &n->maker->local;
    struct incode_close_candidates close;
    uint16_t index[INCODE_CLOSE_MAX];
    if (!incode_close_may_tell(n->rb, n->rc))
        return false;
    close.count = 0;
    for (uint32_t i = 0; i <= count; i++) {
        double p[3];
        if (i < count) {
            if (first[i] == n->b || first[i] == n->c || first[i] == local->self)
                continue;
            copy_point(p, local, first[i]);
            index[close.count] = first[i];
            (void)incode_close_add(&close, p);
            if (close.count < INCODE_CLOSE_MAX)
                continue;
        }
        incode_maker_yield(n->maker, INCODE_CLOSE_UNITS);
        uint32_t k = incode_close_first(&close, n->pv, n->pb, n->pc,
                                        local->scale, &n->maker->counts.tally);
        if (k == INCODE_CLOSE_NONE)
            return false;
        index[0] = index[k];
        copy_point(p, local, index[0]);
        close.count = 0;
        (void)incode_close_add(&close, p);
    }
    n->best = index[0];
    return true;
}

/* The best of the first in the pencil, at *t of it; false: it does not stand
 * against the other local points yet. */
static bool contest_first(struct incode_make *n, double *t) {
    const struct incode_local_points *local = &n->maker->local;
    uint16_t first[INCODE_NEAR_ALL];
    double most;
    uint32_t only = INCODE_LOCAL_NONE, others = 0;
    yield_over_points(n);
    uint32_t count = incode_local_first(local, &n->pencil, &most, first);
    for (uint32_t i = 0; i < count; i++) {
        if (first[i] == n->b || first[i] == n->c || first[i] == local->self)
            continue;
        only = first[i];
        others++;
    }
    bool ranked = others > 1 && rank_first(n, first, count);
    n->bare = others == 1 || ranked;
    if (others == 1)
        n->best = only;
    for (uint32_t i = 0; i < count && !n->bare; i++)
        consider(n, first[i]);
    if (n->best != INCODE_LOCAL_NONE) {
        double r[3];
        incode_local_relative(local, n->best, r);
        if (incode_pencil_place(&n->pencil, r, t) &&
            incode_pencil_later(&n->pencil, *t) < most)
            return true;
    }
    if (ranked) {
        incode_make_sphere(n);
    } else if (n->bare) {
        n->bare = false;
        n->best = INCODE_LOCAL_NONE;
        for (uint32_t i = 0; i < count; i++)
            consider(n, first[i]);
    }
    return false;
}

/* The one of some points that is first in the pencil, as far as doubles tell:
 * on a curve, where each point would beat the one before, it beats all. */
static uint32_t deepest(const struct incode_make *n, const uint16_t *inside,
                        uint32_t count) {
    const struct incode_local_points *local = &n->maker->local;
    uint32_t at = inside[0];
    double most = -__builtin_inf();
    incode_maker_yield(n->maker, count / POINTS_A_UNIT);
    for (uint32_t i = 0; i < count; i++) {
        double r[3];
        incode_local_relative(local, inside[i], r);
        double level = incode_dot(n->sphere.n, r);
        double depth = incode_sphere_value(&n->sphere, r) / level;
        if (level > incode_plane_error(&n->sphere, r) && depth > most) {
            most = depth;
            at = inside[i];
        }
    }
    return at;
}

/* The best of all local points, by the predicates where bounds do not tell:
 * what is inside the sphere of each better one is chosen again.  Of an
 * irregular face's candidates none has been looked at. */
static void contest(struct incode_make *n) {
    const struct incode_local_points *local = &n->maker->local;
    uint16_t inside[INCODE_NEAR_ALL];
    for (uint32_t i = 0; i < local->near && !n->regular; i++) {
        consider(n, local->at[i]);
        if (n->best != INCODE_LOCAL_NONE)
            break;
    }
    if (n->best == INCODE_LOCAL_NONE)
        return;
    for (uint32_t best = INCODE_LOCAL_NONE; best != n->best;) {
        best = n->best;
        yield_over_points(n);
        uint32_t count = incode_local_inside(local, &n->sphere, inside);
        if (count > 0)
            consider(n, deepest(n, inside, count));
        for (uint32_t i = 0; i < count && best == n->best; i++)
            consider(n, inside[i]);
    }
}

static enum incode_near contest_all(struct incode_make *n) {
    const struct incode_local_points *local = &n->maker->local;
    bool fits;
    double t;
    n->maker->counts.candidates += local->near;
    if (n->regular && contest_first(n, &t)) {
        fits = incode_cap_fits(local->wall, &n->pencil, t);
        return fits ? INCODE_NEAR_FOUND : INCODE_NEAR_SEARCH;
    }
    contest(n);
    if (n->best == INCODE_LOCAL_NONE)
        return incode_hull_known(n->maker, n->pv, n->pb, n->pc)
                   ? INCODE_NEAR_HULL
                   : INCODE_NEAR_SEARCH;
    fits = incode_sphere_fits(local->wall, &n->sphere);
    return fits ? INCODE_NEAR_FOUND : INCODE_NEAR_SEARCH;
}

/* Turns an irregular face so that it begins with the vertex across its longest
 * edge: relative to it, the two others lose least, and so do the points around
 * them. */
static void turn(struct incode_query *q) {
    const double *const p[3] = {q->pv, q->pb, q->pc};
    const uint32_t id[3] = {q->v, q->b, q->c};
    double turned[3][3], most = -1;
    int at = 0;
    for (int i = 0; i < 3; i++) {
        const double *const edge[2] = {p[(i + 1) % 3], p[(i + 2) % 3]};
        for (int d = 0; d < 3; d++) {
            double e = __builtin_fabs(edge[0][d] - edge[1][d]);
            at = e > most ? i : at;
            most = e > most ? e : most;
        }
    }
    for (int i = 0; i < 3; i++)
        memcpy(turned[i], p[(at + i) % 3], sizeof turned[i]);
    q->v = id[at];
    q->b = id[(at + 1) % 3];
    q->c = id[(at + 2) % 3];
    memcpy(q->pv, turned[0], sizeof q->pv);
    memcpy(q->pb, turned[1], sizeof q->pb);
    memcpy(q->pc, turned[2], sizeof q->pc);
    incode_query_face(q);
}

/* Sets the query's face. */
static void set_face(const struct incode_make *n, struct incode_query *q) {
    const struct incode_local_points *local = &n->maker->local;
    memset(q, 0, sizeof *q);
    q->question = INCODE_QUERY_APEX;
    q->v = local->vertex;
    q->b = local->id[n->b];
    q->c = local->id[n->c];
    memcpy(q->pv, n->pv, sizeof q->pv);
    memcpy(q->pb, n->pb, sizeof q->pb);
    memcpy(q->pc, n->pc, sizeof q->pc);
    q->scale = local->scale;
    memcpy(q->rb, n->rb, sizeof q->rb);
    memcpy(q->rc, n->rc, sizeof q->rc);
    q->sphere = n->sphere;
    q->best = INCODE_NONE;
    q->empty = &n->maker->empty;
    q->degenerate = n->degenerate;
}

void incode_search_from(struct incode_make *n, struct incode_search *s) {
    const struct incode_local_points *local = &n->maker->local;
    struct incode_query *q = &s->query;
    /* A ball that is known is relative to the vertex. */
    bool turns = !n->regular &&
                 !(n->degenerate.known && n->degenerate.ball.radius < 1e300);
    if (n->bare)
        incode_make_sphere(n);
    set_face(n, q);
    s->radius = local->radius > DBL_MIN ? local->radius : DBL_MIN;
    s->looked = local->near;
    s->final = false;
    s->degenerate = n->degenerate.known;
    if (turns) {
        incode_maker_yield(n->maker, INCODE_FINE_UNITS);
        turn(q);
        s->radius = s->radius * q->scale > 1 ? s->radius : 1 / q->scale;
    }
    if (n->best == INCODE_LOCAL_NONE) {
        s->radius *= 2;
        incode_search_box(n->maker, s);
        return;
    }
    incode_maker_yield(n->maker, INCODE_LESSEN_UNITS);
    if (turns)
        incode_query_apex(q, &n->maker->counts.tally, n->store[3]);
    incode_query_start(q, local->id[n->best], n->store[3]);
    incode_search_last(n->maker, s);
    q->done = true;
    memcpy(q->done_lo, local->lo, sizeof local->lo);
    memcpy(q->done_hi, local->hi, sizeof local->hi);
}

/* ---- faces among points coplanar up to rounding ---- */

enum { COPLANAR_POINTS = 3, COPLANAR_ASKED = 12 };

/* Whether no sphere tells where the apex is, and local points are in doubt
 * about the face or the face itself is thin. */
static bool is_doubtful(const struct incode_make *n) {
    const struct incode_local_points *local = &n->maker->local;
    const struct incode_sphere *s = &n->sphere;
    uint32_t count = 0;
    if (n->best != INCODE_LOCAL_NONE)
        return !n->bare && incode_sphere_is_near_degenerate(s);
    if (!n->regular)
        return true;
    yield_over_points(n);
    for (uint32_t i = 0; i < local->near && count < COPLANAR_POINTS; i++) {
        uint32_t at = local->at[i];
        double r[3];
        incode_local_relative(local, at, r);
        double level = __builtin_fabs(incode_dot(s->n, r));
        count += at != local->self && at != n->b && at != n->c &&
                 level < 1e3 * incode_plane_error(s, r);
    }
    return count == COPLANAR_POINTS;
}

/* What is known of a regular face's direction: no half-space; one far above, as
 * within the set; or one that the face lies in.  A thin face has no direction,
 * and is taken for one of the hull's side. */
enum lie { UNKNOWN, INTERIOR, COPLANAR };

static enum lie lie_of(const struct incode_make *n) {
    const struct incode_maker *m = n->maker;
    const struct incode_sphere *sphere = &n->sphere;
    enum lie lie = n->regular ? UNKNOWN : COPLANAR;
    for (uint32_t i = 0; i < m->half_space_count && lie != COPLANAR; i++) {
        const struct incode_half_space *s = &m->half_spaces[i];
        if (!incode_half_space_faces(s, sphere->n))
            continue;
        double most = s->most[0] - incode_half_space_height(s, n->pv).hi;
        double size = incode_max_norm(s->n) * s->scale / m->local.scale;
        lie = most < 1e-6 * size * (sphere->lb + sphere->lc) ? COPLANAR
                                                             : INTERIOR;
    }
    return lie;
}

/* Lets some local points say how far the apex may be: where one's sphere is
 * too ill-conditioned to tell, another's may do.  True: the best at hand is
 * it. */
static bool reach_fits(struct incode_make *n) {
    const struct incode_local_points *local = &n->maker->local;
    uint32_t asked = 0;
    bool fits = false;
    if (n->best == INCODE_LOCAL_NONE)
        return false;
    for (uint32_t i = 0; i <= local->near && asked < COPLANAR_ASKED && !fits;
         i++) {
        uint32_t at = i == 0 ? n->best : local->at[i - 1];
        double p[3];
        incode_maker_yield(n->maker, CONSIDER_UNITS);
        copy_point(p, local, at);
        if (at == local->self || at == n->b || at == n->c ||
            incode_orient3d(&n->maker->counts.tally, n->pv, n->pb, n->pc, p) <=
                0)
            continue;
        incode_maker_yield(n->maker, INCODE_LESSEN_UNITS);
        const double *const q[4] = {n->pv, n->pb, n->pc, p};
        incode_near_degenerate_lessen(&n->degenerate, q, local->scale);
        const struct incode_ball *ball = &n->degenerate.ball;
        double radius = ball->radius * (1 + 1e-9);
        asked++;
        fits = true;
        for (int d = 0; d < 3; d++)
            fits = fits && ball->centre[d] + radius < local->rhi[d] &&
                   ball->centre[d] - radius > local->rlo[d];
    }
    return fits;
}

/* Whether the local points decide on an apex. */
static bool contest_near_degenerate(struct incode_make *n) {
    const struct incode_maker *m = n->maker;
    const struct incode_local_points *local = &m->local;
    n->degenerate.known = true;
    n->degenerate.ball = (struct incode_ball){.radius = __builtin_inf()};
    n->degenerate.spread = 0;
    n->degenerate.regular = n->regular;
    if (n->regular)
        memcpy(n->degenerate.c0, n->pencil.c0, sizeof n->degenerate.c0);
    n->degenerate.half_spaces = m->half_spaces;
    n->degenerate.count = m->half_space_count;
    if (n->best == INCODE_LOCAL_NONE && n->regular)
        for (uint32_t i = 0; i < local->near; i++)
            consider(n, local->at[i]);
    return reach_fits(n);
}

enum incode_near incode_apex_near(struct incode_maker *m, uint32_t b,
                                  uint32_t c, uint32_t *apex,
                                  struct incode_search *s) {
    struct incode_local_points *local = &m->local;
    struct incode_make n;
    n.maker = m;
    n.b = b;
    n.c = c;
    n.best = INCODE_LOCAL_NONE;
    n.bare = false;
    n.sphere = (struct incode_sphere){.has_apex = false};
    memcpy(n.store[0], local->p0, sizeof local->p0);
    copy_point(n.store[1], local, b);
    copy_point(n.store[2], local, c);
    n.pv = n.store[0];
    n.pb = n.store[1];
    n.pc = n.store[2];
    incode_local_relative(local, b, n.rb);
    incode_local_relative(local, c, n.rc);
    incode_sphere_plane(&n.sphere, n.rb, n.rc);
    if (incode_plane_is_ill_conditioned(&n.sphere)) {
        incode_maker_yield(m, INCODE_FINE_UNITS);
        incode_sphere_refine(&n.sphere, n.pv, n.pb, n.pc, NULL, local->scale);
    }
    set_pencil(&n, &n.sphere);
    n.degenerate.known = false;
    n.degenerate.spread = 0;
    enum incode_near r = contest_all(&n);
    bool doubtful = r == INCODE_NEAR_SEARCH && is_doubtful(&n);
    n.doubtful = doubtful;
    enum lie lie = doubtful ? lie_of(&n) : INTERIOR;
    bool degenerate = doubtful && n.best != INCODE_LOCAL_NONE;
    if ((degenerate || lie == COPLANAR) && contest_near_degenerate(&n))
        r = INCODE_NEAR_FOUND;
    *apex = n.best;
    if (r != INCODE_NEAR_SEARCH) {
        incode_count_candidates(m, local->near);
        return r;
    }
    bool lost =
        lie == UNKNOWN && degenerate && n.degenerate.ball.radius > 1e300;
    if (lost || !incode_apex_around(&n, s)) {
        if (lie == UNKNOWN)
            incode_query_half_space(&s->query, n.pv, n.sphere.n, local->scale);
        return INCODE_NEAR_SEARCH;
    }
    incode_count_candidates(m, s->looked);
    if (s->query.best == INCODE_NONE) {
        incode_hull_learn(m, &s->query);
        return INCODE_NEAR_HULL;
    }
    incode_search_learn(m, &s->query, s->looked);
    *apex = incode_local_find(local, s->query.best);
    if (*apex == INCODE_LOCAL_NONE)
        *apex = incode_local_append(local, s->query.best, s->query.best_p);
    if (*apex == INCODE_LOCAL_NONE) { /* no room: found again by itself */
        incode_search_from(&n, s);
        return INCODE_NEAR_SEARCH;
    }
    return INCODE_NEAR_FOUND;
}

/* --- first ---------------------------------------------------------------- */

/* A first tetrahedron at a vertex v that none has reached (MakeFirstTetra).
 * v and its nearest neighbour u form a Delaunay edge, ties included.  Around
 * that edge the tetrahedra (v, u, w, a) are the edges of a convex polygon in
 * the plane of directions; from a third point w that is no more than a guess
 * (the paper's smallest circle), looking to and fro, a from w and w from a,
 * ends at one of them: each look settles one side exactly, and both agree only
 * on a true edge. */

/* Of points that are not the same in every page. */
static const char *const INCONSISTENT =
    "no first tetrahedron: pages contradict each other";

enum { LOOKS = 16 /* a call, at most */ };

static void begin_walk(struct incode_maker *m, struct incode_search *search,
                       uint32_t v, enum incode_question question,
                       const struct incode_frame *frame, const double p[3]) {
    struct incode_query *q = &search->query;
    memset(q, 0, sizeof *q);
    q->question = question;
    q->v = v;
    q->b = q->c = q->best = INCODE_NONE;
    memcpy(q->pv, p, sizeof q->pv);
    q->limit = __builtin_inf();
    double lo[3], hi[3], extent = incode_frame_box(frame, lo, hi);
    q->scale = incode_scale_for(extent > 0 ? extent : m->hi[0]);
    if (question == INCODE_QUERY_CIRCLE) {
        q->b = search->first.u;
        memcpy(q->pb, search->first.pu, sizeof q->pb);
        for (int d = 0; d < 3; d++)
            q->rb[d] = (q->pb[d] - q->pv[d]) * q->scale;
    }
    /* The vertex's own brick first: it gives a good bound. */
    (void)incode_visit_points(&m->walker, q, frame, v / INCODE_BRICK_POINTS,
                              (UINT32_C(1) << incode_frame_leaves(frame)) - 1,
                              NULL);
}

static void look(struct incode_maker *m, struct incode_search *search,
                 const double pv[3]) {
    struct incode_first *s = &search->first;
    uint32_t v = search->query.v;
    const struct incode_frame *f =
        incode_pager_get(&m->pager, v / INCODE_BRICK_POINTS);
    double lo[3], hi[3], radius = f == NULL ? 0 : incode_frame_box(f, lo, hi);
    for (int d = 0; d < 3; d++) {
        double du = __builtin_fabs(s->pu[d] - pv[d]);
        radius = 4 * du > radius ? 4 * du : radius;
    }
    if (s->stage == INCODE_FIRST_APEX) {
        const uint32_t face[3] = {v, s->u, s->w};
        incode_search_begin(m, search, face, pv, s->pu, s->pw, radius);
    } else {
        const uint32_t face[3] = {v, s->a, s->u};
        incode_search_begin(m, search, face, pv, s->pa, s->pu, radius);
    }
    m->counts.calls++;
}

static void set_point(uint32_t *v, double p[3], const struct incode_query *q) {
    *v = q->best;
    memcpy(p, q->best_p, sizeof q->best_p);
}

/* Takes in what one look has found; true: the tetrahedron is settled. */
static bool looked(struct incode_maker *m, struct incode_search *search) {
    struct incode_first *s = &search->first;
    const struct incode_query *q = &search->query;
    if (s->stage == INCODE_FIRST_APEX) {
        if (q->best == INCODE_NONE) { /* only below: look there */
            s->a = s->w;
            memcpy(s->pa, s->pw, sizeof s->pa);
            s->w = INCODE_NONE;
        } else if (q->best == s->a) {
            return true;
        } else {
            set_point(&s->a, s->pa, q);
        }
        s->stage = INCODE_FIRST_BACK;
        return false;
    }
    if (q->best == INCODE_NONE)
        m->fault = "no tetrahedron at a vertex: the points lie on one plane";
    else if (q->best == s->w)
        return true;
    else
        set_point(&s->w, s->pw, q);
    s->stage = INCODE_FIRST_APEX;
    return false;
}

static void settle(struct incode_maker *m, struct incode_search *search,
                   const double pv[3], struct incode_answer *a) {
    const struct incode_first *s = &search->first;
    const uint32_t f[4] = {search->query.v, s->u, s->w, s->a};
    const double *const p[4] = {pv, s->pu, s->pw, s->pa};
    if (incode_orient3d(&m->counts.tally, pv, s->pu, s->pw, s->pa) <= 0) {
        m->fault = INCONSISTENT;
        return;
    }
    memcpy(a->f, f, sizeof a->f);
    for (int i = 0; i < 4; i++) {
        memcpy(a->p[i], p[i], sizeof a->p[i]);
        a->near[i] = INCODE_LOCAL_NONE;
    }
    search->stage = INCODE_SEARCH_NONE;
}

static void start(struct incode_maker *m, struct incode_search *search,
                  uint32_t v, const struct incode_frame *frame,
                  const double p[3]) {
    memset(&search->first, 0, sizeof search->first);
    search->first.w = search->first.a = INCODE_NONE;
    search->first.stage = INCODE_FIRST_NEAREST;
    search->stage = INCODE_SEARCH_FIRST;
    begin_walk(m, search, v, INCODE_QUERY_NEAREST, frame, p);
}

/* Takes in the nearest neighbour or the third point of a walk that is over. */
static void walked(struct incode_maker *m, struct incode_search *search,
                   const struct incode_frame *frame, const double p[3]) {
    struct incode_first *s = &search->first;
    const struct incode_query *q = &search->query;
    if (q->best == INCODE_NONE) {
        m->fault = "no tetrahedron at a vertex: the points lie on one line";
    } else if (s->stage == INCODE_FIRST_NEAREST) {
        set_point(&s->u, s->pu, q);
        s->stage = INCODE_FIRST_CIRCLE;
        begin_walk(m, search, q->v, INCODE_QUERY_CIRCLE, frame, p);
    } else {
        set_point(&s->w, s->pw, q);
        s->stage = INCODE_FIRST_APEX;
        look(m, search, p);
    }
}

enum incode_step incode_maker_first(struct incode_maker *m, unsigned slot,
                                    uint32_t v, struct incode_answer *a) {
    struct incode_search *search = &m->search[slot];
    struct incode_first *s = &search->first;
    struct incode_query *q = &search->query;
    double p[3];
    unsigned looks = 0;
    search->advanced = false;
    if (!incode_fetch_point(m, v, p, &search->page))
        return INCODE_WAITING;
    const struct incode_frame *frame =
        incode_pager_get(&m->pager, v / INCODE_BRICK_POINTS);
    if (search->stage != INCODE_SEARCH_FIRST)
        start(m, search, v, frame, p);
    while (search->stage == INCODE_SEARCH_FIRST && m->fault == NULL) {
        if (s->stage == INCODE_FIRST_NEAREST ||
            s->stage == INCODE_FIRST_CIRCLE) {
            q->yields = true;
            enum incode_step r =
                incode_walk(&m->walker, q, incode_visit_points, NULL);
            if (r == INCODE_WAITING)
                return incode_search_suspend(search);
            walked(m, search, frame, p);
            continue;
        }
        enum incode_step r = incode_search_run(m, search);
        if (r != INCODE_FINISHED)
            return r;
        if (looked(m, search))
            settle(m, search, p, a);
        else
            look(m, search, p);
        if (search->stage == INCODE_SEARCH_FIRST && ++looks == LOOKS) {
            search->page = INCODE_NONE;
            search->advanced = true;
            return INCODE_WORKED;
        }
    }
    return INCODE_FINISHED;
}
