#include <string.h>

#include "search.h"

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

static enum incode_outcome begin(struct incode_maker *m,
                                 struct incode_search *s, const uint32_t f[3]) {
    double p[3][3];
    for (int i = 0; i < 3; i++)
        if (!incode_fetch_point(m, f[i], p[i], &s->page))
            return INCODE_WAIT;
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
    return INCODE_ANSWERED;
}

/* Every page of points in turn, from where the last search stands: several
 * searches share a page that has to be fetched. */
static enum incode_outcome look_at_all(struct incode_maker *m,
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
            return INCODE_WAIT;
        }
        (void)incode_visit_points(&m->walker, &s->query, f, brick,
                                  (UINT32_C(1) << incode_frame_leaves(f)) - 1,
                                  NULL);
        m->sweep = brick;
        s->sweep = brick + 1 < m->tree.bricks ? brick + 1 : 0;
        s->sweep_left--;
        s->advanced = true;
    }
    return s->sweep_left > 0 ? INCODE_MORE : INCODE_ANSWERED;
}

static enum incode_outcome look_at_cells(struct incode_maker *m,
                                         struct incode_search *s) {
    struct incode_query *q = &s->query;
    struct incode_cell_search *c = &s->cells;
    const struct incode_grid grid = grid_of(m);
    bool new_shell = c->any_done;
    enum incode_walk r = incode_cell_search_run(c, &grid, &m->walker, q);
    if (r == INCODE_WALK_WAIT) {
        s->page = q->missing;
        return INCODE_WAIT;
    }
    s->advanced = true;
    if (q->best == INCODE_NONE) {
        /* A facet of the hull?  Its plane may be known from another. */
        if (r == INCODE_WALK_DONE && c->has_below)
            incode_hull_remember(m, q, c->below);
        else if (!new_shell && incode_hull_known(m, q->pv, q->pb, q->pc))
            return INCODE_ANSWERED;
    }
    return r == INCODE_WALK_STOP ? INCODE_MORE : INCODE_ANSWERED;
}

static void set_answer(struct incode_answer *a, const struct incode_query *q) {
    const uint32_t f[4] = {q->v, q->b, q->c, q->best};
    const double *const p[4] = {q->pv, q->pb, q->pc, q->best_p};
    memcpy(a->f, f, sizeof a->f);
    for (int i = 0; i < 4; i++) {
        memcpy(a->p[i], p[i], sizeof a->p[i]);
        a->near[i] = INCODE_LOCAL_NONE;
    }
}

enum incode_outcome incode_maker_face(struct incode_maker *m, unsigned slot,
                                      const uint32_t f[3],
                                      struct incode_answer *a) {
    struct incode_search *s = &m->search[slot];
    enum incode_outcome r = INCODE_ANSWERED;
    s->advanced = false;
    if (s->stage != INCODE_SEARCH_POINTS)
        r = begin(m, s, f);
    if (r != INCODE_ANSWERED)
        return r;
    uint64_t before = m->counts.candidates;
    do {
        r = m->index == INCODE_GRID ? look_at_cells(m, s) : look_at_all(m, s);
    } while (r == INCODE_MORE && m->index == INCODE_GRID &&
             m->walker.left > 0 && s->cells.reach <= SHELLS &&
             s->cells.list == s->cells.end);
    s->looked += m->counts.candidates - before;
    if (r == INCODE_MORE)
        s->page = INCODE_NONE;
    if (r != INCODE_ANSWERED)
        return r;
    incode_count_candidates(m, s->looked);
    set_answer(a, &s->query);
    s->stage = INCODE_SEARCH_NONE;
    return INCODE_ANSWERED;
}
