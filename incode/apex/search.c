#include "search.h"

#include <float.h>
#include <string.h>

bool incode_fetch_point(struct incode_maker *m, uint32_t v, double p[3],
                        uint32_t *page) {
    uint32_t brick = v / INCODE_BRICK_POINTS, slot = v % INCODE_BRICK_POINTS;
    const struct incode_frame *f = incode_pager_get(&m->pager, brick);
    *page = brick;
    if (f == NULL)
        return false;
    if (slot >= f->count) {
        m->fault = INCODE_NO_VERTEX;
        return false;
    }
    p[0] = f->page.brick.x[slot];
    p[1] = f->page.brick.y[slot];
    p[2] = f->page.brick.z[slot];
    return true;
}

/* ---- hull planes ---- */

bool incode_hull_known(struct incode_maker *m, const double pv[3],
                       const double pb[3], const double pc[3]) {
    struct incode_tally *tally = &m->counts.tally;
    for (uint32_t i = 0; i < m->plane_count; i++) {
        const struct incode_hull_plane *h = &m->planes[i];
        const double *a = h->p[0], *b = h->p[1], *c = h->p[2];
        incode_breathe(&tally->pause, 2);
        if (incode_orient3d(tally, a, b, c, pv) == 0 &&
            incode_orient3d(tally, a, b, c, pb) == 0 &&
            incode_orient3d(tally, a, b, c, pc) == 0)
            return incode_orient3d(tally, pv, pb, pc, h->below) < 0;
    }
    return false;
}

void incode_hull_remember(struct incode_maker *m, const struct incode_query *q,
                          const double below[3]) {
    struct incode_hull_plane *h = &m->planes[m->plane_next];
    memcpy(h->p[0], q->pv, sizeof q->pv);
    memcpy(h->p[1], q->pb, sizeof q->pb);
    memcpy(h->p[2], q->pc, sizeof q->pc);
    memcpy(h->below, below, sizeof h->below);
    m->plane_next = (m->plane_next + 1) % INCODE_HULL_PLANES;
    if (m->plane_count < INCODE_HULL_PLANES)
        m->plane_count++;
}

/* The length of an edge off its first vertex, against the normal's largest
 * component; where the normal is not known, along any axis. */
void incode_hull_learn(struct incode_maker *m, const struct incode_query *q) {
    const double *n = q->sphere.n;
    double side = 1 / q->scale;
    unsigned largest = 0;
    for (unsigned d = 1; d < 3; d++)
        if (__builtin_fabs(n[d]) > __builtin_fabs(n[largest]))
            largest = d;
    for (unsigned i = 0; i < 6; i++) {
        unsigned d = (largest + i / 2) % 3;
        double below[3] = {q->pv[0], q->pv[1], q->pv[2]};
        below[d] += (n[d] > 0) == (i % 2 == 0) ? -side : side;
        incode_maker_breathe(m, 1);
        if (__builtin_fabs(below[d]) <= DBL_MAX &&
            incode_orient3d(&m->counts.tally, q->pv, q->pb, q->pc, below) < 0) {
            incode_hull_remember(m, q, below);
            return;
        }
    }
}

/* ---- the search of the whole set ---- */

/* Begins a walk.  Where pages are replaced, one walk goes up and the next down:
 * it begins with the pages that the last walk used last.  Walks in one
 * direction would find each page evicted just before they come to it. */
static void begin_walk(struct incode_maker *m, struct incode_query *q) {
    m->walks_down = !m->walks_down && !incode_pager_has_free(&m->pager);
    q->down = m->walks_down;
    q->cursor = 0;
}

/* The box of the next look: only points that are clearly beyond the face count
 * there, so that those in its plane need not be told apart in vain. */
void incode_search_box(struct incode_maker *m, struct incode_search *s) {
    struct incode_query *q = &s->query;
    bool all = true;
    for (int d = 0; d < 3; d++) {
        q->lo[d] = q->pv[d] - s->radius;
        q->hi[d] = q->pv[d] + s->radius;
        all = all && q->lo[d] <= m->lo[d] && q->hi[d] >= m->hi[d];
    }
    q->boxed = !all;
    q->strictly_beyond = !s->degenerate;
    begin_walk(m, q);
}

void incode_search_last(struct incode_maker *m, struct incode_search *s) {
    struct incode_query *q = &s->query;
    s->final = true;
    q->done = q->strictly_beyond = false;
    begin_walk(m, q);
    incode_query_shrink(q);
}

void incode_search_begin(struct incode_maker *m, struct incode_search *s,
                         const uint32_t f[3], const double pv[3],
                         const double pb[3], const double pc[3],
                         double radius) {
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
    incode_search_box(m, s);
}

void incode_count_candidates(struct incode_maker *m, uint64_t looked) {
    uint64_t n = looked < 2 ? 2 : looked;
    uint32_t octave = 63 - (uint32_t)__builtin_clzll(n);
    uint32_t half = 2 * octave + (uint32_t)(n >> (octave - 1) & 1);
    uint32_t last =
        sizeof m->counts.histogram / sizeof m->counts.histogram[0] - 1;
    m->counts.histogram[half < last ? half : last]++;
}

enum { MANY = 1024 /* points */ };

void incode_search_learn(struct incode_maker *m, const struct incode_query *q,
                         uint64_t looked) {
    const double *const p[4] = {q->pv, q->pb, q->pc, q->best_p};
    if (q->best != INCODE_NONE && looked >= MANY)
        incode_empty_spheres_add(&m->empty, p, q->scale);
}

enum incode_outcome incode_search_suspend(struct incode_search *s) {
    s->page = s->query.missing;
    s->advanced = s->page == INCODE_NONE;
    return s->advanced ? INCODE_MORE : INCODE_WAIT;
}

enum incode_outcome incode_search_run(struct incode_maker *m,
                                      struct incode_search *s) {
    struct incode_query *q = &s->query;
    for (;;) {
        uint64_t before = m->counts.candidates;
        q->pauses = true;
        enum incode_walk r =
            incode_walk(&m->walker, q, incode_visit_points, NULL);
        s->looked += m->counts.candidates - before;
        if (r == INCODE_WALK_WAIT)
            return incode_search_suspend(s);
        if (q->question == INCODE_QUERY_HALF_SPACE) {
            m->half_spaces[m->half_space_next] = q->half_space;
            m->half_space_next = (m->half_space_next + 1) % INCODE_HALF_SPACES;
            if (m->half_space_count < INCODE_HALF_SPACES)
                m->half_space_count++;
            return INCODE_ANSWERED;
        }
        if (s->final) {
            incode_count_candidates(m, s->looked);
            if (q->best == INCODE_NONE)
                incode_hull_learn(m, q);
            return INCODE_ANSWERED;
        }
        if (q->best != INCODE_NONE || !q->boxed) {
            incode_maker_breathe(m, INCODE_LESSEN_UNITS);
            incode_search_last(m, s);
            continue;
        }
        q->done = true;
        memcpy(q->done_lo, q->lo, sizeof q->lo);
        memcpy(q->done_hi, q->hi, sizeof q->hi);
        s->radius *= s->degenerate ? 2 : 4;
        incode_search_box(m, s);
    }
}
