#include <string.h>

#include "search.h"

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

enum incode_outcome incode_maker_first(struct incode_maker *m, unsigned slot,
                                       uint32_t v, struct incode_answer *a) {
    struct incode_search *search = &m->search[slot];
    struct incode_first *s = &search->first;
    struct incode_query *q = &search->query;
    double p[3];
    unsigned looks = 0;
    search->advanced = false;
    if (!incode_fetch_point(m, v, p, &search->page))
        return INCODE_WAIT;
    const struct incode_frame *frame =
        incode_pager_get(&m->pager, v / INCODE_BRICK_POINTS);
    if (search->stage != INCODE_SEARCH_FIRST)
        start(m, search, v, frame, p);
    while (search->stage == INCODE_SEARCH_FIRST && m->fault == NULL) {
        if (s->stage == INCODE_FIRST_NEAREST ||
            s->stage == INCODE_FIRST_CIRCLE) {
            q->pauses = true;
            enum incode_walk r =
                incode_walk(&m->walker, q, incode_visit_points, NULL);
            if (r == INCODE_WALK_WAIT)
                return incode_search_suspend(search);
            walked(m, search, frame, p);
            continue;
        }
        enum incode_outcome r = incode_search_run(m, search);
        if (r != INCODE_ANSWERED)
            return r;
        if (looked(m, search))
            settle(m, search, p, a);
        else
            look(m, search, p);
        if (search->stage == INCODE_SEARCH_FIRST && ++looks == LOOKS) {
            search->page = INCODE_NONE;
            search->advanced = true;
            return INCODE_MORE;
        }
    }
    return INCODE_ANSWERED;
}
