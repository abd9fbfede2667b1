#include <float.h>
#include <string.h>

#include "apex.h"
#include "incode/predicates/check.h"
#include "close_candidates.h"
#include "simd.h"

/* MakeTetra: the apex of a face.  Among the local points, single precision
 * proposes and the sphere's rigorous bound leaves the few that the predicates
 * must compare; the answer stands when the closed cap of the sphere lies in the
 * box of the local points.  Otherwise the tree is searched, near boxes first.
 */

bool incode_fetch_point(struct incode_triangulator *t, uint32_t v, double p[3],
                        uint32_t *page)
{
    uint32_t brick = v / INCODE_BRICK_POINTS, slot = v % INCODE_BRICK_POINTS;
    const struct incode_frame *f = incode_pager_get(&t->pager, brick);
    *page = brick;
    if (f == NULL)
        return false;
    INCODE_ASSERT(slot < f->count);
    p[0] = f->page.brick.x[slot];
    p[1] = f->page.brick.y[slot];
    p[2] = f->page.brick.z[slot];
    return true;
}

/* ---- hull planes ---- */

bool incode_hull_known(struct incode_triangulator *t, const double pv[3],
                       const double pb[3], const double pc[3])
{
    struct incode_tally *tally = &t->stats.tally;
    for (uint32_t i = 0; i < t->plane_count; i++) {
        const struct incode_hull_plane *h = &t->planes[i];
        const double *a = h->p[0], *b = h->p[1], *c = h->p[2];
        if (incode_orient3d(tally, a, b, c, pv) == 0 &&
            incode_orient3d(tally, a, b, c, pb) == 0 &&
            incode_orient3d(tally, a, b, c, pc) == 0)
            return incode_orient3d(tally, pv, pb, pc, h->below) < 0;
    }
    return false;
}

void incode_hull_remember(struct incode_triangulator *t,
                          const struct incode_query *q, const double below[3])
{
    struct incode_hull_plane *h = &t->planes[t->plane_next];
    memcpy(h->p[0], q->pv, sizeof q->pv);
    memcpy(h->p[1], q->pb, sizeof q->pb);
    memcpy(h->p[2], q->pc, sizeof q->pc);
    memcpy(h->below, below, sizeof h->below);
    t->plane_next = (t->plane_next + 1) % INCODE_HULL_PLANES;
    if (t->plane_count < INCODE_HULL_PLANES)
        t->plane_count++;
}

/* Remembers a certified hull facet, if some local point is below it. */
static void remember_plane(struct incode_triangulator *t,
                           const struct incode_query *q)
{
    const struct incode_local_points *local = &t->local;
    for (uint32_t i = 0; i < local->count; i++) {
        double p[3] = {local->p[0][i], local->p[1][i], local->p[2][i]};
        if (incode_orient3d(&t->stats.tally, q->pv, q->pb, q->pc, p) < 0) {
            incode_hull_remember(t, q, p);
            return;
        }
    }
}

/* ---- the search of the whole set ---- */

/* The box of the next look: only points that are clearly beyond the face count
 * there, so that those in its plane need not be told apart in vain. */
void incode_search_box(struct incode_triangulator *t, struct incode_search *s)
{
    struct incode_query *q = &s->query;
    bool all = true;
    for (int d = 0; d < 3; d++) {
        q->lo[d] = q->pv[d] - s->radius;
        q->hi[d] = q->pv[d] + s->radius;
        all = all && q->lo[d] <= t->setup.lo[d] && q->hi[d] >= t->setup.hi[d];
    }
    q->boxed = !all;
    q->strictly_beyond = !s->degenerate;
    q->cursor = 0;
}

void incode_search_last(struct incode_search *s)
{
    struct incode_query *q = &s->query;
    s->final = true;
    q->done = q->strictly_beyond = false;
    q->cursor = 0;
    incode_query_shrink(q);
}

void incode_search_begin(struct incode_triangulator *t, struct incode_search *s,
                         const uint32_t f[3], const double pv[3],
                         const double pb[3], const double pc[3], double radius)
{
    struct incode_query *q = &s->query;
    memset(q, 0, sizeof *q);
    q->question = INCODE_QUERY_APEX;
    q->v = f[0];
    q->b = f[1];
    q->c = f[2];
    memcpy(q->pv, pv, sizeof q->pv);
    memcpy(q->pb, pb, sizeof q->pb);
    memcpy(q->pc, pc, sizeof q->pc);
    q->best = INCODE_NONE;
    incode_query_face(q);
    /* A radius that vanished among denormals could not grow again. */
    s->radius = radius > DBL_MIN ? radius : DBL_MIN;
    s->final = s->degenerate = false;
    s->looked = 0;
    incode_search_box(t, s);
}

void incode_count_candidates(struct incode_triangulator *t, uint64_t looked)
{
    uint64_t n = looked < 2 ? 2 : looked;
    uint32_t octave = 63 - (uint32_t)__builtin_clzll(n);
    uint32_t half = 2 * octave + (uint32_t)(n >> (octave - 1) & 1);
    uint32_t last = sizeof t->stats.candidates_histogram /
                        sizeof t->stats.candidates_histogram[0] -
                    1;
    t->stats.candidates_histogram[half < last ? half : last]++;
}

/* Where many points were looked at, the sphere found helps the next search. */
void incode_search_learn(struct incode_triangulator *t,
                         const struct incode_query *q)
{
    const double *const p[4] = {q->pv, q->pb, q->pc, q->best_p};
    if (q->best != INCODE_NONE && q->shrinking &&
        q->looked >= INCODE_QUERY_CROWD)
        incode_empty_spheres_add(&t->empty, p, q->scale);
}

enum incode_outcome incode_search_run(struct incode_triangulator *t,
                                      struct incode_search *s)
{
    struct incode_query *q = &s->query;
    for (;;) {
        uint64_t before = t->stats.candidates;
        enum incode_walk r =
            incode_walk(&t->walker, q, incode_visit_points, NULL);
        s->looked += t->stats.candidates - before;
        if (r == INCODE_WALK_WAIT)
            return INCODE_WAIT;
        if (q->question == INCODE_QUERY_HALF_SPACE) {
            t->half_spaces[t->half_space_next] = q->half_space;
            t->half_space_next = (t->half_space_next + 1) % INCODE_HALF_SPACES;
            if (t->half_space_count < INCODE_HALF_SPACES)
                t->half_space_count++;
            return INCODE_OK;
        }
        if (s->final) {
            incode_count_candidates(t, s->looked);
            if (q->best == INCODE_NONE)
                remember_plane(t, q);
            return INCODE_OK;
        }
        if (q->best != INCODE_NONE || !q->boxed) {
            incode_search_last(s);
            continue;
        }
        q->done = true;
        memcpy(q->done_lo, q->lo, sizeof q->lo);
        memcpy(q->done_hi, q->hi, sizeof q->hi);
        s->radius *= s->degenerate ? 2 : 4;
        incode_search_box(t, s);
    }
}

/* ---- among the local points ---- */

/* A regular face's circumcentre is right to 1e-9 of its distance: the sine of
 * its angle at v is at least 1/100. */
static void set_pencil(struct incode_make *f, const struct incode_sphere *s)
{
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

/* Three numbers along the axes' two directions, in the order of a box's walls;
 * the lanes from `first` on. */
INCODE_INLINE incode_vd both_ways(const double a[3], int first)
{
#if INCODE_VECTOR == 64
    (void)first;
    return (incode_vd){a[0], a[1], a[2], 0, -a[0], -a[1], -a[2], 0};
#elif INCODE_VECTOR == 32
    incode_vd up = {a[0], a[1], a[2], 0};
    return first == 0 ? up : -up;
#else
    incode_vd up = {a[first % 4], first % 4 == 0 ? a[1] : 0};
    return first < 4 ? up : -up;
#endif
}

bool incode_cap_fits(const double walls[8], const struct incode_pencil *pencil,
                     double t)
{
    double circle = incode_dot(pencil->c0, pencil->c0);
    double square = circle + 0.25 * t * t, radius = __builtin_sqrt(square);
    incode_vd zero = incode_vd_all(0);
    incode_vl all = incode_vl_ones();
    for (int first = 0; first < 8; first += INCODE_VD_LANES) {
        incode_vd n = both_ways(pencil->n, first);
        incode_vd c0 = both_ways(pencil->c0, first);
        incode_vd wall = incode_vd_load(walls + first);
        incode_vd gap = wall - (c0 + incode_vd_all(0.5 * t) * n);
        incode_vl in =
            (gap > zero) & (gap * gap > incode_vd_all(square * (1 + 4e-6)));
        incode_vl known =
            n * incode_vd_all(radius) < incode_vd_all(-0.5 * t - 2e-6 * radius);
        incode_vd rim = incode_vd_all(circle + 4e-6 * square) -
                        incode_vd_all(circle) * n * n;
        incode_vd short_gap = wall - c0;
        in |= known & (short_gap > zero) & (short_gap * short_gap > rim);
        all &= in;
    }
    return incode_vd_mask(all) == INCODE_VD_ALL;
}

/* The centre is m / (2 det), the radius its length. */
bool incode_sphere_fits(const double wall[8], const struct incode_sphere *s)
{
    if (!(s->det > 1e9 * INCODE_SPHERE_EPS * s->pdet) ||
        !(s->det > INCODE_SPHERE_LEAST)) /* squares below would underflow */
        return false;
    double nn = incode_dot(s->n, s->n), half = 0.5 / s->det;
    double centre[3], t = 2 * incode_dot(s->n, s->m) * half;
    struct incode_pencil pencil;
    double unit = 1 / __builtin_sqrt(nn);
    double length = __builtin_sqrt(incode_dot(s->m, s->m)) * half;
    double error = 12 * INCODE_SPHERE_EPS * incode_max_norm(s->pm) * half;
    if (!(error < 1e-7 * length))
        return false;
    /* Without a good normal, the whole sphere. */
    if (!(nn > 1e-60) ||
        !(INCODE_SPHERE_EPS * s->pn[0] < 1e-8 * incode_max_norm(s->n)))
        t = unit = 0;
    for (int d = 0; d < 3; d++) {
        centre[d] = s->m[d] * half;
        pencil.n[d] = s->n[d] * unit;
        pencil.c0[d] = centre[d] - 0.5 * t * unit * pencil.n[d];
    }
    return incode_cap_fits(wall, &pencil, t * unit);
}

static void copy_point(double p[3], const struct incode_local_points *local,
                       uint32_t i)
{
    p[0] = local->p[0][i];
    p[1] = local->p[1][i];
    p[2] = local->p[2][i];
}

/* Takes i as the best if it is strictly beyond the face and inside the best's
 * sphere. */
static void consider(struct incode_make *n, uint32_t i)
{
    struct incode_local_points *local = &n->t->local;
    struct incode_tally *tally = &n->t->stats.tally;
    if (i == n->b || i == n->c || i == n->best || i == local->self)
        return;
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
    if (incode_sphere_is_ill_conditioned(&n->sphere))
        incode_sphere_refine(&n->sphere, n->pv, n->pb, n->pc, p, local->scale);
}

void incode_make_sphere(struct incode_make *n)
{
    double r[3];
    copy_point(n->store[3], &n->t->local, n->best);
    incode_local_relative(&n->t->local, n->best, r);
    incode_sphere_apex(&n->sphere, n->rb, n->rc, r);
    if (incode_sphere_is_ill_conditioned(&n->sphere))
        incode_sphere_refine(&n->sphere, n->pv, n->pb, n->pc, n->store[3],
                             n->t->local.scale);
    n->bare = false;
}

/* The best of those in doubt, in twice the precision if that can tell: the
 * first of some meets the next of them. */
static bool rank_first(struct incode_make *n, const uint16_t *first,
                       uint32_t count)
{
    const struct incode_local_points *local = &n->t->local;
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
        uint32_t k = incode_close_first(&close, n->pv, n->pb, n->pc,
                                        local->scale, &n->t->stats.tally);
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
static bool contest_first(struct incode_make *n, double *t)
{
    const struct incode_local_points *local = &n->t->local;
    uint16_t first[INCODE_NEAR_ALL];
    double most;
    uint32_t only = INCODE_LOCAL_NONE, others = 0;
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

/* The best of all local points, by the predicates where bounds do not tell.
 * Of an irregular face's candidates none has been looked at. */
static void contest(struct incode_make *n)
{
    const struct incode_local_points *local = &n->t->local;
    uint16_t inside[INCODE_NEAR_ALL];
    for (uint32_t i = 0; i < local->near && !n->regular; i++)
        consider(n, local->at[i]);
    if (n->best == INCODE_LOCAL_NONE)
        return;
    uint32_t count = incode_local_inside(local, &n->sphere, inside);
    for (uint32_t i = 0; i < count; i++)
        consider(n, inside[i]);
}

static enum incode_near contest_all(struct incode_make *n)
{
    const struct incode_local_points *local = &n->t->local;
    bool fits;
    double t;
    n->t->stats.candidates += local->near;
    if (n->regular && contest_first(n, &t)) {
        fits = incode_cap_fits(local->wall, &n->pencil, t);
        return fits ? INCODE_NEAR_FOUND : INCODE_NEAR_SEARCH;
    }
    contest(n);
    if (n->best == INCODE_LOCAL_NONE)
        return incode_hull_known(n->t, n->pv, n->pb, n->pc)
                   ? INCODE_NEAR_HULL
                   : INCODE_NEAR_SEARCH;
    fits = incode_sphere_fits(local->wall, &n->sphere);
    return fits ? INCODE_NEAR_FOUND : INCODE_NEAR_SEARCH;
}

void incode_search_from(struct incode_make *n, struct incode_search *s)
{
    const struct incode_local_points *local = &n->t->local;
    struct incode_query *q = &s->query;
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
    q->best = INCODE_NONE;
    q->empty = &n->t->empty;
    s->radius = local->radius > DBL_MIN ? local->radius : DBL_MIN;
    s->looked = local->near;
    s->final = false;
    s->degenerate = n->degenerate.known;
    q->degenerate = n->degenerate;
    if (n->best == INCODE_LOCAL_NONE) {
        q->sphere = n->sphere;
        s->radius *= 2;
        incode_search_box(n->t, s);
        return;
    }
    if (n->bare)
        incode_make_sphere(n);
    q->sphere = n->sphere;
    incode_query_start(q, local->id[n->best], n->store[3]);
    incode_search_last(s);
    q->done = true;
    memcpy(q->done_lo, local->lo, sizeof local->lo);
    memcpy(q->done_hi, local->hi, sizeof local->hi);
}

/* ---- faces among points coplanar up to rounding ---- */

enum { COPLANAR_POINTS = 3, COPLANAR_ASKED = 12 };

/* Whether no sphere tells where the apex is, and local points are in doubt
 * about the face or the face itself is thin. */
static bool is_doubtful(const struct incode_make *n)
{
    const struct incode_local_points *local = &n->t->local;
    const struct incode_sphere *s = &n->sphere;
    uint32_t count = 0;
    if (n->best != INCODE_LOCAL_NONE)
        return !n->bare && incode_sphere_is_near_degenerate(s);
    if (!n->regular)
        return true;
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

static enum lie lie_of(const struct incode_make *n)
{
    const struct incode_triangulator *t = n->t;
    const struct incode_sphere *sphere = &n->sphere;
    enum lie lie = n->regular ? UNKNOWN : COPLANAR;
    for (uint32_t i = 0; i < t->half_space_count && lie != COPLANAR; i++) {
        const struct incode_half_space *s = &t->half_spaces[i];
        if (!incode_half_space_faces(s, sphere->n))
            continue;
        double most = s->most[0] - incode_half_space_height(s, n->pv).hi;
        double size = incode_max_norm(s->n) * s->scale / t->local.scale;
        lie = most < 1e-6 * size * (sphere->lb + sphere->lc) ? COPLANAR
                                                             : INTERIOR;
    }
    return lie;
}

/* Lets some local points say how far the apex may be: where one's sphere is
 * too ill-conditioned to tell, another's may do.  True: the best at hand is
 * it. */
static bool reach_fits(struct incode_make *n)
{
    const struct incode_local_points *local = &n->t->local;
    uint32_t asked = 0;
    bool fits = false;
    if (n->best == INCODE_LOCAL_NONE)
        return false;
    for (uint32_t i = 0; i <= local->near && asked < COPLANAR_ASKED && !fits;
         i++) {
        uint32_t at = i == 0 ? n->best : local->at[i - 1];
        double p[3];
        copy_point(p, local, at);
        if (at == local->self || at == n->b || at == n->c ||
            incode_orient3d(&n->t->stats.tally, n->pv, n->pb, n->pc, p) <= 0)
            continue;
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
static bool contest_near_degenerate(struct incode_make *n)
{
    const struct incode_triangulator *t = n->t;
    const struct incode_local_points *local = &t->local;
    n->degenerate.known = true;
    n->degenerate.ball.radius = __builtin_inf();
    n->degenerate.spread = 0;
    n->degenerate.regular = n->regular;
    if (n->regular)
        memcpy(n->degenerate.c0, n->pencil.c0, sizeof n->degenerate.c0);
    n->degenerate.half_spaces = t->half_spaces;
    n->degenerate.count = t->half_space_count;
    if (n->best == INCODE_LOCAL_NONE && n->regular)
        for (uint32_t i = 0; i < local->near; i++)
            consider(n, local->at[i]);
    return reach_fits(n);
}

enum incode_near incode_apex_near(struct incode_triangulator *t, uint32_t b,
                                  uint32_t c, uint32_t *apex,
                                  struct incode_search *s)
{
    struct incode_local_points *local = &t->local;
    struct incode_make n;
    n.t = t;
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
    if (incode_plane_is_ill_conditioned(&n.sphere))
        incode_sphere_refine(&n.sphere, n.pv, n.pb, n.pc, NULL, local->scale);
    set_pencil(&n, &n.sphere);
    n.degenerate.known = false;
    n.degenerate.spread = 0;
    enum incode_near r = contest_all(&n);
    bool doubtful = r == INCODE_NEAR_SEARCH && is_doubtful(&n);
    enum lie lie = doubtful ? lie_of(&n) : INTERIOR;
    bool degenerate = doubtful && n.best != INCODE_LOCAL_NONE;
    if ((degenerate || lie == COPLANAR) && contest_near_degenerate(&n))
        r = INCODE_NEAR_FOUND;
    *apex = n.best;
    if (r != INCODE_NEAR_SEARCH) {
        incode_count_candidates(t, local->near);
        return r;
    }
    bool lost =
        lie == UNKNOWN && degenerate && n.degenerate.ball.radius > 1e300;
    if (lost || !incode_apex_around(&n, s)) {
        if (lie == UNKNOWN)
            incode_query_half_space(&s->query, n.pv, n.sphere.n, local->scale);
        return INCODE_NEAR_SEARCH;
    }
    incode_search_learn(t, &s->query);
    *apex = incode_local_find(local, s->query.best);
    if (*apex == INCODE_LOCAL_NONE)
        *apex = incode_local_append(local, s->query.best, s->query.best_p);
    if (*apex == INCODE_LOCAL_NONE) { /* no room: found again by itself */
        incode_search_from(&n, s);
        return INCODE_NEAR_SEARCH;
    }
    incode_count_candidates(t, s->looked);
    return INCODE_NEAR_FOUND;
}
