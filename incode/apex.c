#include <float.h>
#include <string.h>

#include "check.h"
#include "state.h"

/* MakeTetra: the apex of a face.  Among the gathered points, single precision
 * proposes and the sphere's rigorous bound leaves the few that the predicates
 * must compare; the answer stands when the closed cap of the sphere lies in the
 * gathered box.  Otherwise the tree is searched, near boxes first. */

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

/* Remembers a certified hull facet, if some gathered point is below it. */
static void remember_plane(struct incode_triangulator *t,
                           const struct incode_query *q)
{
    const struct incode_gather *g = &t->gather;
    for (uint32_t i = 0; i < g->count; i++) {
        double p[3] = {g->p[0][i], g->p[1][i], g->p[2][i]};
        if (incode_orient3d(&t->stats.tally, q->pv, q->pb, q->pc, p) < 0) {
            incode_hull_remember(t, q, p);
            return;
        }
    }
}

/* ---- the search of the whole set ---- */

/* The box of the next look: only points that are clearly beyond the face count
 * there, so that those in its plane need not be told apart in vain. */
static void set_box(struct incode_triangulator *t, struct incode_search *s)
{
    struct incode_query *q = &s->query;
    bool all = true;
    for (int d = 0; d < 3; d++) {
        q->lo[d] = q->pv[d] - s->radius;
        q->hi[d] = q->pv[d] + s->radius;
        all = all && q->lo[d] <= t->setup.lo[d] && q->hi[d] >= t->setup.hi[d];
    }
    q->boxed = !all;
    q->timid = true;
    q->cursor = 0;
}

/* The last look: every point that the best so far does not clearly beat, or
 * every point if there is none. */
static void set_final(struct incode_search *s)
{
    struct incode_query *q = &s->query;
    s->final = true;
    q->done = q->timid = false;
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
    s->final = false;
    s->looked = 0;
    set_box(t, s);
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
        if (s->final) {
            incode_count_candidates(t, s->looked);
            if (q->best == INCODE_NONE)
                remember_plane(t, q);
            return INCODE_OK;
        }
        if (q->best != INCODE_NONE || !q->boxed) {
            set_final(s);
            continue;
        }
        q->done = true;
        memcpy(q->done_lo, q->lo, sizeof q->lo);
        memcpy(q->done_hi, q->hi, sizeof q->hi);
        s->radius *= 4;
        set_box(t, s);
    }
}

/* ---- among the gathered points ---- */

struct face {
    double b[3], c[3]; /* relative to v */
    double m[3], nn;   /* m / nn: twice the circumcentre; nn = |n|^2 */
};

static void set_face(struct face *f, const struct incode_sphere *s)
{
    double cn[3], nb[3];
    incode_cross(cn, f->c, s->n);
    incode_cross(nb, s->n, f->b);
    f->nn = incode_dot(s->n, s->n);
    for (int d = 0; d < 3; d++)
        f->m[d] = s->bb * cn[d] + s->cc * nb[d];
}

/* Whether single precision may propose an apex: nothing out of its range. */
static bool is_regular(const struct face *f)
{
    return f->nn > 1e-60 && f->nn < 1e60 &&
           incode_max_norm(f->m) < 1e12 * f->nn;
}

/* Of the sphere, only the closed cap beyond the face matters: where an extreme
 * point of the sphere lies on the known side, the rim of the face's circle is
 * the extreme. */
static bool cap_fits(const double rlo[3], const double rhi[3],
                     const struct incode_sphere *s, const struct face *f,
                     double radius, double wide)
{
    double half = 0.5 / s->det, inverse = 1 / f->nn, centre[3], n[3], c0[3];
    double unit = __builtin_sqrt(inverse);
    for (int d = 0; d < 3; d++) {
        centre[d] = s->m[d] * half;
        n[d] = s->n[d] * unit;
        c0[d] = 0.5 * f->m[d] * inverse;
    }
    double circle = __builtin_sqrt(incode_dot(c0, c0));
    double level = incode_dot(n, centre);
    for (int d = 0; d < 3; d++) {
        double hi = centre[d] + radius, lo = centre[d] - radius;
        double flat = 1 - n[d] * n[d];
        double rim = circle * (flat > 0 ? __builtin_sqrt(flat) : 0);
        if (level + radius * n[d] < 0)
            hi = c0[d] + rim;
        if (level - radius * n[d] < 0)
            lo = c0[d] - rim;
        if (!(hi + wide < rhi[d] && lo - wide > rlo[d]))
            return false;
    }
    return true;
}

/* Whether the closed cap of the sphere beyond the face lies strictly inside a
 * box that was scanned.  Conservative: everything is widened by 1e-6 of the
 * sphere's size, and an ill-conditioned sphere is never accepted. */
static bool cap_is_within(const double rlo[3], const double rhi[3],
                          const struct incode_sphere *s, const struct face *f)
{
    if (!(s->det > 1e9 * INCODE_SPHERE_EPS * s->pdet) || !is_regular(f) ||
        !(s->det > INCODE_SPHERE_LEAST)) /* squares below would underflow */
        return false;
    /* The centre is m / (2 det), the radius its length. */
    double length = __builtin_sqrt(incode_dot(s->m, s->m)), two = 2 * s->det;
    double wide =
        length * 1e-6 + 12 * INCODE_SPHERE_EPS * incode_max_norm(s->pm);
    bool fits = true;
    for (int d = 0; d < 3; d++)
        fits = fits && s->m[d] + length + wide < rhi[d] * two &&
               s->m[d] - length - wide > rlo[d] * two;
    return fits || cap_fits(rlo, rhi, s, f, length / two, wide / two);
}

struct near {
    struct incode_triangulator *t;
    const double *pv, *pb, *pc;
    double store[4][3];
    uint32_t b, c, best;
    struct face face;
    struct incode_sphere sphere;
};

static void copy_point(double p[3], const struct incode_gather *g, uint32_t i)
{
    p[0] = g->p[0][i];
    p[1] = g->p[1][i];
    p[2] = g->p[2][i];
}

/* Takes i as the best if it is strictly beyond the face and inside the best's
 * sphere. */
static void consider(struct near *n, uint32_t i)
{
    struct incode_gather *g = &n->t->gather;
    struct incode_tally *tally = &n->t->stats.tally;
    if (i == n->b || i == n->c || i == n->best || i == g->self)
        return;
    double p[3], r[3];
    incode_gather_relative(g, i, r);
    bool any = n->best != INCODE_GATHER_NONE, inside = !any;
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
    copy_point(p, g, i);
    if (!(level > error) && incode_orient3d(tally, n->pv, n->pb, n->pc, p) <= 0)
        return;
    if (!inside &&
        incode_in_sphere(tally, n->pv, n->pb, n->pc, n->store[3], p) < 0)
        return;
    n->best = i;
    memcpy(n->store[3], p, sizeof p);
    incode_sphere_apex(&n->sphere, n->face.b, n->face.c, r);
    if (incode_sphere_is_blurred(&n->sphere))
        incode_sphere_refine(&n->sphere, n->pv, n->pb, n->pc, p, g->scale);
}

/* The first of points [from, to) by approximate Delaunay distance, if it is
 * certain to be beyond the face. */
static void propose(struct near *n, uint32_t from, uint32_t to)
{
    if (!is_regular(&n->face))
        return;
    uint32_t first = incode_gather_first(&n->t->gather, from, to, n->sphere.n,
                                         n->face.m, n->face.nn);
    if (first != INCODE_GATHER_NONE)
        consider(n, first);
}

/* The points [from, to) against the best so far. */
static void contest(struct near *n, uint32_t from, uint32_t to)
{
    uint16_t inside[INCODE_NEAR_ALL];
    n->t->stats.candidates += to - from;
    uint32_t count =
        incode_gather_inside(&n->t->gather, from, to, &n->sphere, inside);
    for (uint32_t k = 0; k < count; k++)
        consider(n, inside[k]);
}

static bool is_certain(const struct near *n, const double rlo[3],
                       const double rhi[3])
{
    return n->best != INCODE_GATHER_NONE &&
           cap_is_within(rlo, rhi, &n->sphere, &n->face);
}

static enum incode_near contest_all(struct near *n)
{
    const struct incode_gather *g = &n->t->gather;
    propose(n, 0, g->inner);
    bool inner = n->best != INCODE_GATHER_NONE;
    if (inner)
        contest(n, 0, g->inner);
    if (is_certain(n, g->inner_lo, g->inner_hi))
        return INCODE_NEAR_FOUND;
    if (!inner)
        propose(n, INCODE_OUTER, g->outer);
    if (n->best != INCODE_GATHER_NONE) {
        if (!inner)
            contest(n, 0, g->inner);
        contest(n, INCODE_OUTER, g->outer);
    } else if (incode_hull_known(n->t, n->pv, n->pb, n->pc)) {
        return INCODE_NEAR_HULL;
    }
    return is_certain(n, g->rlo, g->rhi) ? INCODE_NEAR_FOUND
                                         : INCODE_NEAR_SEARCH;
}

enum incode_near incode_apex_near(struct incode_triangulator *t, uint32_t b,
                                  uint32_t c, uint32_t *apex,
                                  struct incode_search *s)
{
    struct incode_gather *g = &t->gather;
    struct near n;
    n.t = t;
    n.b = b;
    n.c = c;
    n.best = INCODE_GATHER_NONE;
    n.sphere = (struct incode_sphere){.has_apex = false};
    memcpy(n.store[0], g->p0, sizeof g->p0);
    copy_point(n.store[1], g, b);
    copy_point(n.store[2], g, c);
    n.pv = n.store[0];
    n.pb = n.store[1];
    n.pc = n.store[2];
    incode_gather_relative(g, b, n.face.b);
    incode_gather_relative(g, c, n.face.c);
    incode_sphere_plane(&n.sphere, n.face.b, n.face.c);
    if (incode_plane_is_blurred(&n.sphere))
        incode_sphere_refine(&n.sphere, n.pv, n.pb, n.pc, NULL, g->scale);
    set_face(&n.face, &n.sphere);
    uint64_t before = t->stats.candidates;
    enum incode_near r = contest_all(&n);
    uint64_t looked = t->stats.candidates - before;
    *apex = n.best;
    if (r != INCODE_NEAR_SEARCH) {
        incode_count_candidates(t, looked);
        return r;
    }
    const uint32_t f[3] = {g->vertex, g->id[b], g->id[c]};
    incode_search_begin(t, s, f, n.pv, n.pb, n.pc, g->radius * 4);
    s->looked = looked;
    if (n.best == INCODE_GATHER_NONE)
        return INCODE_NEAR_SEARCH;
    struct incode_query *q = &s->query;
    set_final(s);
    incode_query_consider(q, &t->stats.tally, g->id[n.best], n.store[3]);
    q->done = true;
    memcpy(q->done_lo, g->lo, sizeof g->lo);
    memcpy(q->done_hi, g->hi, sizeof g->hi);
    return INCODE_NEAR_SEARCH;
}
