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

/* Whether the face lies on a hull plane already certified, facing out. */
static bool on_hull(struct incode_triangulator *t, const double pv[3],
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

/* Remembers a certified hull facet, if some gathered point is below it. */
static void remember_plane(struct incode_triangulator *t,
                           const struct incode_query *q)
{
    const struct incode_gather *g = &t->gather;
    for (uint32_t i = 0; i < g->count; i++) {
        double p[3] = {g->p[0][i], g->p[1][i], g->p[2][i]};
        if (incode_orient3d(&t->stats.tally, q->pv, q->pb, q->pc, p) >= 0)
            continue;
        struct incode_hull_plane *h = &t->planes[t->plane_next];
        memcpy(h->p[0], q->pv, sizeof q->pv);
        memcpy(h->p[1], q->pb, sizeof q->pb);
        memcpy(h->p[2], q->pc, sizeof q->pc);
        memcpy(h->below, p, sizeof p);
        t->plane_next = (t->plane_next + 1) % INCODE_HULL_PLANES;
        if (t->plane_count < INCODE_HULL_PLANES)
            t->plane_count++;
        return;
    }
}

/* ---- the search of the whole set ---- */

static void set_box(struct incode_triangulator *t, struct incode_search *s)
{
    struct incode_query *q = &s->query;
    bool all = true;
    for (int d = 0; d < 3; d++) {
        q->lo[d] = q->pv[d] - s->radius;
        q->hi[d] = q->pv[d] + s->radius;
        all = all && q->lo[d] <= t->setup.lo[d] && q->hi[d] >= t->setup.hi[d];
    }
    q->boxed = !all && q->best == INCODE_NONE;
    s->final = !q->boxed;
    q->cursor = 0;
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
    s->radius = radius;
    set_box(t, s);
}

enum incode_outcome incode_search_run(struct incode_triangulator *t,
                                      struct incode_search *s)
{
    struct incode_query *q = &s->query;
    for (;;) {
        enum incode_walk r =
            incode_walk(&t->walker, q, incode_visit_points, NULL);
        if (r == INCODE_WALK_WAIT)
            return INCODE_WAIT;
        if (s->final) {
            if (q->best == INCODE_NONE)
                remember_plane(t, q);
            return INCODE_OK;
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
    double n[3];       /* unit normal, outward */
    double c2[3];      /* twice the circumcentre */
    bool regular;      /* n and c2 are numbers of moderate size */
};

static void set_face(struct face *f, const struct incode_sphere *s)
{
    double bb = incode_dot(f->b, f->b), cc = incode_dot(f->c, f->c);
    double nn = incode_dot(s->n, s->n), cn[3], nb[3];
    incode_cross(cn, f->c, s->n);
    incode_cross(nb, s->n, f->b);
    double inverse = 1 / nn, unit = __builtin_sqrt(inverse);
    f->regular = nn > 1e-60 && nn < 1e60;
    for (int d = 0; d < 3; d++) {
        f->n[d] = s->n[d] * unit;
        f->c2[d] = (bb * cn[d] + cc * nb[d]) * inverse;
        f->regular = f->regular && __builtin_fabs(f->c2[d]) < 1e15;
    }
}

/* Whether the closed cap of the sphere beyond the face lies strictly inside
 * the gathered box.  Conservative: everything is widened by 1e-6 of the
 * sphere's size, and an ill-conditioned sphere is never accepted. */
static bool cap_is_gathered(const struct incode_gather *g,
                            const struct incode_sphere *s, const struct face *f)
{
    if (!(s->det > 1e9 * INCODE_SPHERE_EPS * s->pdet) || !f->regular)
        return false;
    double half = 0.5 / s->det, centre[3], slack = 0;
    for (int d = 0; d < 3; d++) {
        centre[d] = s->m[d] * half;
        slack += s->pm[d];
    }
    slack = 4 * INCODE_SPHERE_EPS * slack * half;
    double radius = __builtin_sqrt(incode_dot(centre, centre));
    double circle = 0.5 * __builtin_sqrt(incode_dot(f->c2, f->c2));
    double wide = radius * 1e-6 + slack;
    for (int d = 0; d < 3; d++) {
        double hi = centre[d] + radius, lo = centre[d] - radius;
        if (hi + wide < g->rhi[d] && lo - wide > g->rlo[d])
            continue;
        /* The extreme points of the sphere that lie on the known side give
         * way to those of the face's circle. */
        double level = incode_dot(f->n, centre);
        double flat = 1 - f->n[d] * f->n[d];
        double rim = circle * (flat > 0 ? __builtin_sqrt(flat) : 0);
        if (level + radius * f->n[d] < 0)
            hi = 0.5 * f->c2[d] + rim;
        if (level - radius * f->n[d] < 0)
            lo = 0.5 * f->c2[d] - rim;
        if (!(hi + wide < g->rhi[d] && lo - wide > g->rlo[d]))
            return false;
    }
    return true;
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
    if (i == n->b || i == n->c || i == n->best || g->id[i] == g->vertex)
        return;
    double p[3], r[3];
    incode_gather_relative(g, i, r);
    if (n->best != INCODE_GATHER_NONE &&
        incode_sphere_value(&n->sphere, r) <
            -incode_sphere_error(&n->sphere, r))
        return;
    copy_point(p, g, i);
    if (incode_orient3d(tally, n->pv, n->pb, n->pc, p) <= 0)
        return;
    if (n->best != INCODE_GATHER_NONE &&
        incode_in_sphere(tally, n->pv, n->pb, n->pc, n->store[3], p) < 0)
        return;
    n->best = i;
    memcpy(n->store[3], p, sizeof p);
    incode_sphere_apex(&n->sphere, n->face.b, n->face.c, r);
}

static void tournament(struct near *n)
{
    struct incode_gather *g = &n->t->gather;
    if (n->face.regular) {
        uint32_t first = incode_gather_first(g, n->face.n, n->face.c2);
        if (first != INCODE_GATHER_NONE)
            consider(n, first);
    }
    if (n->best == INCODE_GATHER_NONE) {
        /* Nothing clearly beyond the face: the predicates must look at all
         * that is not clearly short of it. */
        for (uint32_t i = 0; i < g->count; i++) {
            double r[3], level = 0, error = INCODE_SPHERE_TINY;
            incode_gather_relative(g, i, r);
            for (int d = 0; d < 3; d++) {
                level += n->sphere.n[d] * r[d];
                error +=
                    INCODE_SPHERE_EPS * n->sphere.pn[d] * __builtin_fabs(r[d]);
            }
            if (!(level < -error))
                consider(n, i);
        }
        return;
    }
    uint16_t inside[INCODE_GATHER_ALL];
    uint32_t count = incode_gather_inside(g, &n->sphere, inside);
    for (uint32_t k = 0; k < count; k++)
        consider(n, inside[k]);
}

enum incode_near incode_apex_near(struct incode_triangulator *t, uint32_t b,
                                  uint32_t c, uint32_t *apex,
                                  struct incode_search *s)
{
    struct incode_gather *g = &t->gather;
    struct near n = {.t = t, .b = b, .c = c, .best = INCODE_GATHER_NONE};
    memcpy(n.store[0], g->p0, sizeof g->p0);
    copy_point(n.store[1], g, b);
    copy_point(n.store[2], g, c);
    n.pv = n.store[0];
    n.pb = n.store[1];
    n.pc = n.store[2];
    incode_gather_relative(g, b, n.face.b);
    incode_gather_relative(g, c, n.face.c);
    incode_sphere_plane(&n.sphere, n.face.b, n.face.c);
    set_face(&n.face, &n.sphere);
    t->stats.candidates += g->count;
    tournament(&n);
    if (n.best != INCODE_GATHER_NONE &&
        cap_is_gathered(g, &n.sphere, &n.face)) {
        *apex = n.best;
        return INCODE_NEAR_FOUND;
    }
    if (n.best == INCODE_GATHER_NONE && on_hull(t, n.pv, n.pb, n.pc))
        return INCODE_NEAR_HULL;
    const uint32_t f[3] = {g->vertex, g->id[b], g->id[c]};
    incode_search_begin(t, s, f, n.pv, n.pb, n.pc, g->radius * 4);
    struct incode_query *q = &s->query;
    q->done = true;
    memcpy(q->done_lo, g->lo, sizeof g->lo);
    memcpy(q->done_hi, g->hi, sizeof g->hi);
    if (n.best != INCODE_GATHER_NONE) {
        incode_query_consider(q, &t->stats.tally, g->id[n.best], n.store[3]);
        set_box(t, s);
    }
    return INCODE_NEAR_SEARCH;
}
