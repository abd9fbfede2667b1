#include <float.h>
#include <string.h>

#include "apex.h"

/* MakeTetra among the bricks around, where the points at hand do not suffice.
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
static void set_walls(double wall[8], const struct incode_vicinity *list,
                      const double pv[3], double scale)
{
    for (int d = 0; d < 3; d++) {
        wall[d] = gap(list->box_hi[d], pv[d]) * scale;
        wall[4 + d] = gap(-list->box_lo[d], -pv[d]) * scale;
    }
    wall[3] = wall[7] = __builtin_inf();
}

/* Box after box, up to that of the list, for a first candidate. */
static enum incode_walk find_first(struct incode_triangulator *t,
                                   struct incode_search *s, incode_visit *visit,
                                   void *context)
{
    struct incode_query *q = &s->query;
    enum incode_walk r = INCODE_WALK_DONE;
    while (r == INCODE_WALK_DONE && q->best == INCODE_NONE && !q->round) {
        s->radius *= 2;
        incode_search_box(t, s);
        if (!q->boxed || !incode_vicinity_holds(&t->vicinity, q->lo, q->hi))
            return INCODE_WALK_STOP;
        r = incode_vicinity_visit(&t->vicinity, &t->walker, q, visit, context);
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
    struct incode_triangulator *t = n->t;
    const struct incode_vicinity *list = &t->vicinity;
    struct incode_query *q = &s->query;
    alignas(64) double wall[8];
    enum incode_walk r = INCODE_WALK_DONE;
    if (q->best == INCODE_NONE) {
        r = find_first(t, s, incode_visit_points, NULL);
        if (r == INCODE_WALK_DONE)
            incode_search_last(s);
    }
    bool whole = q->boxed && incode_vicinity_holds(list, q->lo, q->hi);
    /* Without a ball of its own, a sphere does not fit. */
    if (r != INCODE_WALK_DONE || (!whole && (!q->round || q->lens)) ||
        incode_vicinity_visit(list, &t->walker, q, incode_visit_points, NULL) !=
            INCODE_WALK_DONE)
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

/* What the pass has found: the first of them, ties and what is in doubt. */
static bool settle(struct incode_make *n, struct incode_query *q,
                   const struct incode_hits *hits)
{
    struct incode_tally *tally = &n->t->stats.tally;
    const struct incode_hit *best = NULL;
    double last = incode_pencil_later(&n->pencil, q->t);
    for (uint32_t i = 0; i < hits->count; i++) {
        const struct incode_hit *hit = &hits->hit[i];
        if (hit->placed
                ? hit->t > last
                : !incode_query_holds(q, hit->p) ||
                      incode_orient3d(tally, n->pv, n->pb, n->pc, hit->p) <= 0)
            continue;
        if (best == NULL ||
            incode_in_sphere(tally, n->pv, n->pb, n->pc, best->p, hit->p) > 0)
            best = hit;
    }
    if (best == NULL || !best->placed)
        return false;
    q->best = best->id;
    memcpy(q->best_p, best->p, sizeof q->best_p);
    return true;
}

/* The best at hand goes first. */
static void add_best(struct incode_make *n, struct incode_query *q,
                     struct incode_hits *hits)
{
    const struct incode_gather *g = &n->t->gather;
    double p[3];
    for (int d = 0; d < 3; d++)
        p[d] = g->p[d][n->best];
    q->best = g->id[n->best];
    incode_hit_add(q, hits, q->best, p);
}

static bool search_pencil(struct incode_make *n, struct incode_search *s)
{
    struct incode_triangulator *t = n->t;
    const struct incode_gather *g = &t->gather;
    const struct incode_vicinity *list = &t->vicinity;
    struct incode_query *q = &s->query;
    struct incode_hits hits;
    alignas(64) double wall[8];
    memcpy(q->pv, n->pv, sizeof q->pv);
    q->question = INCODE_QUERY_APEX;
    q->v = g->vertex;
    q->b = g->id[n->b];
    q->c = g->id[n->c];
    q->scale = g->scale;
    q->best = INCODE_NONE;
    q->boxed = q->round = q->timid = q->done = q->shrinking = false;
    q->ceiling.set = false;
    q->pages_max = 0;
    memcpy(q->sphere.n, n->sphere.n, sizeof q->sphere.n);
    memcpy(q->sphere.pn, n->sphere.pn, sizeof q->sphere.pn);
    q->sphere.has_apex = false;
    hits.pencil = &n->pencil;
    hits.count = 0;
    hits.full = false;
    hits.thinned = q->t = __builtin_inf();
    s->radius = g->radius > 0x1p-1022 ? g->radius : 0x1p-1022;
    if (n->best != INCODE_GATHER_NONE) {
        add_best(n, q, &hits);
        memcpy(q->done_lo, g->lo, sizeof g->lo);
        memcpy(q->done_hi, g->hi, sizeof g->hi);
    } else {
        if (find_first(t, s, incode_visit_pencil, &hits) != INCODE_WALK_DONE)
            return false;
        hits.count = 0;
        hits.full = false;
        hits.thinned = __builtin_inf();
        q->t = incode_pencil_later(&n->pencil, q->t);
    }
    if (!q->round) /* the best is too flat */
        return false;
    q->boxed = false;
    q->done = n->best != INCODE_GATHER_NONE;
    if (incode_vicinity_visit(list, &t->walker, q, incode_visit_pencil,
                              &hits) != INCODE_WALK_DONE ||
        hits.full || !settle(n, q, &hits))
        return false;
    set_walls(wall, list, q->pv, q->scale);
    return incode_cap_fits(wall, &n->pencil,
                           incode_pencil_later(&n->pencil, q->t));
}

bool incode_apex_around(struct incode_make *n, struct incode_search *s)
{
    struct incode_triangulator *t = n->t;
    uint64_t before = t->stats.candidates;
    bool found = false;
    if (t->vicinity.count > 0 && n->regular && !n->flat.known)
        found = search_pencil(n, s);
    if (!found) {
        incode_search_from(n, s);
        if (t->vicinity.count > 0)
            found = search_spheres(n, s);
    }
    s->looked = t->gather.near + t->stats.candidates - before;
    return found;
}
