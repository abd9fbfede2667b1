#include <string.h>

#include "incode/predicates/check.h"
#include "state.h"

/* The paper's InCoDe, face by face: any open face is taken, MakeTetra looks for
 * its apex among all points (index `naive`: every page of points in turn) or
 * among those of the uniform grid (index `grid`, see cells.h), and the faces of
 * the tetrahedron toggle.  The face stays in the active face list until then,
 * as another search may close it meanwhile, and what is found for a face that
 * is no longer open is dropped.
 *
 * Order of work, memory, spilling, seeds (by the tree of boxes, which is there
 * for every index) and commits are those of the stars.  Here a task is one
 * face. */

enum {
    SWEEP_BRICKS = 256, /* a step of index `naive` looks at, at most */
    SWEEP_AHEAD = 4     /* pages asked for together */
};

static enum incode_outcome begin(struct incode_triangulator *t,
                                 struct incode_task *task)
{
    uint32_t pair[1][2];
    bool more;
    if (incode_afl_take(&t->afl, task->v, pair, 1, &more) == 0) {
        task->kind = INCODE_TASK_IDLE;
        return INCODE_OK;
    }
    const uint32_t f[3] = {task->v, pair[0][0], pair[0][1]};
    incode_afl_toggle(&t->afl, f[0], f[1], f[2]);
    double p[3][3];
    for (int i = 0; i < 3; i++)
        if (!incode_fetch_point(t, f[i], p[i], &task->page))
            return INCODE_WAIT;
    t->stats.make_tetra_calls++;
    incode_search_begin(t, &task->search, f, p[0], p[1], p[2], __builtin_inf());
    task->search.query.boxed = task->search.query.strictly_beyond = false;
    task->kind = INCODE_TASK_SEARCH;
    if (t->setup.index == INCODE_GRID) {
        const struct incode_grid grid = {&t->walker, t->setup.lo, t->setup.hi,
                                         t->setup.cells};
        incode_cells_begin(&task->cells, &grid, &task->search.query);
    } else {
        task->sweep = t->sweep;
        task->sweep_left = t->setup.bricks;
    }
    return INCODE_OK;
}

/* Every page of points in turn, from where the last search stands: several
 * searches share a page that has to be fetched. */
static enum incode_outcome look_at_all(struct incode_triangulator *t,
                                       struct incode_task *task)
{
    for (int i = 0; i < SWEEP_BRICKS && task->sweep_left > 0; i++) {
        uint32_t brick = task->sweep;
        const struct incode_frame *f = incode_pager_get(&t->pager, brick);
        if (f == NULL) {
            task->page = brick;
            for (uint32_t k = 1; k < SWEEP_AHEAD && k < task->sweep_left; k++)
                (void)incode_pager_get(&t->pager,
                                       (brick + k) % t->setup.bricks);
            return INCODE_WAIT;
        }
        uint32_t leaves =
            (f->count + INCODE_LEAF_POINTS - 1U) / INCODE_LEAF_POINTS;
        (void)incode_visit_points(&t->walker, &task->search.query, f, brick,
                                  (UINT32_C(1) << leaves) - 1, NULL);
        t->sweep = brick;
        task->sweep = brick + 1 < t->setup.bricks ? brick + 1 : 0;
        task->sweep_left--;
        task->retries = 1; /* it gets on, so it needs no room to itself */
    }
    return task->sweep_left > 0 ? INCODE_MORE : INCODE_OK;
}

static enum incode_outcome look_at_cells(struct incode_triangulator *t,
                                         struct incode_task *task)
{
    struct incode_query *q = &task->search.query;
    struct incode_cells *c = &task->cells;
    const struct incode_grid grid = {&t->walker, t->setup.lo, t->setup.hi,
                                     t->setup.cells};
    bool new_shell = c->any_done;
    enum incode_walk r = incode_cells_run(c, &grid, q);
    if (r == INCODE_WALK_WAIT) {
        task->page = q->missing;
        return INCODE_WAIT;
    }
    task->retries = 1;
    if (q->best == INCODE_NONE) {
        /* A facet of the hull?  Its plane may be known from another. */
        if (r == INCODE_WALK_DONE && c->has_below)
            incode_hull_remember(t, q, c->below);
        else if (!new_shell && incode_hull_known(t, q->pv, q->pb, q->pc))
            return INCODE_OK;
    }
    return r == INCODE_WALK_STOP ? INCODE_MORE : INCODE_OK;
}

/* The search is over: builds the tetrahedron if the face is still open. */
static void use_found(struct incode_triangulator *t,
                      const struct incode_query *q)
{
    const uint32_t f[4] = {q->v, q->b, q->c, q->best};
    const double *const p[4] = {q->pv, q->pb, q->pc, q->best_p};
    unsigned turn;
    if (!incode_front_key(t, f, p, &turn))
        INCODE_ASSERT(false);
    uint32_t key = f[turn], b = f[(turn + 1) % 3], c = f[(turn + 2) % 3];
    if (incode_position(t, key / INCODE_BRICK_POINTS) >= t->spill_from ||
        !incode_afl_close_twin(&t->afl, key, c, b))
        return;
    if (q->best == INCODE_NONE)
        t->stats.hull_facets++;
    else
        incode_star_take(t, f, p, true);
}

enum incode_outcome incode_face_pursue(struct incode_triangulator *t,
                                       struct incode_task *task)
{
    enum incode_outcome r = INCODE_OK;
    if (task->kind != INCODE_TASK_SEARCH)
        r = begin(t, task);
    if (r != INCODE_OK || task->kind == INCODE_TASK_IDLE)
        return r;
    uint64_t before = t->stats.candidates;
    do {
        r = t->setup.index == INCODE_GRID ? look_at_cells(t, task)
                                          : look_at_all(t, task);
    } while (r == INCODE_MORE && t->setup.index == INCODE_GRID &&
             task->cells.reach <= 4 && task->cells.list == task->cells.end);
    task->search.looked += t->stats.candidates - before;
    if (r != INCODE_OK)
        return r;
    incode_count_candidates(t, task->search.looked);
    use_found(t, &task->search.query);
    task->kind = INCODE_TASK_IDLE;
    return INCODE_OK;
}
