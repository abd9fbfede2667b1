#include <string.h>

#include "incode/predicates/check.h"
#include "state.h"

/* A first tetrahedron at a vertex v that none has reached (MakeFirstTetra).
 * v and its nearest neighbour u form a Delaunay edge, ties included.  Around
 * that edge the tetrahedra (v, u, w, a) are the edges of a convex polygon in
 * the plane of directions; from a third point w that is no more than a guess
 * (the paper's smallest circle), looking to and fro, a from w and w from a,
 * ends at one of them: each look settles one side exactly, and both agree only
 * on a true edge. */

static void begin_walk(struct incode_triangulator *t, struct incode_task *task,
                       enum incode_question question,
                       const struct incode_frame *frame, const double p[3])
{
    struct incode_query *q = &task->search.query;
    memset(q, 0, sizeof *q);
    q->question = question;
    q->v = task->v;
    q->b = q->c = q->best = INCODE_NONE;
    memcpy(q->pv, p, sizeof q->pv);
    q->limit = __builtin_inf();
    double extent = 0;
    for (int d = 0; d < 3; d++) {
        for (int leaf = 0; leaf < INCODE_BRICK_LEAVES; leaf++) {
            double e = frame->leaf_hi[d][leaf] - frame->leaf_lo[d][leaf];
            extent = e > extent ? e : extent;
        }
    }
    q->scale = incode_scale_for(extent > 0 ? extent : t->setup.hi[0]);
    if (question == INCODE_QUERY_CIRCLE) {
        q->b = task->seed.u;
        memcpy(q->pb, task->seed.pu, sizeof q->pb);
        for (int d = 0; d < 3; d++)
            q->rb[d] = (q->pb[d] - q->pv[d]) * q->scale;
    }
    /* The vertex's own brick first: it gives a good bound. */
    uint32_t leaves =
        (frame->count + INCODE_LEAF_POINTS - 1U) / INCODE_LEAF_POINTS;
    (void)incode_visit_points(&t->walker, q, frame,
                              task->v / INCODE_BRICK_POINTS,
                              (UINT32_C(1) << leaves) - 1, NULL);
}

static void look(struct incode_triangulator *t, struct incode_task *task,
                 const double pv[3])
{
    struct incode_seed *s = &task->seed;
    double pv0[3] = {pv[0], pv[1], pv[2]};
    const struct incode_frame *f =
        incode_pager_get(&t->pager, task->v / INCODE_BRICK_POINTS);
    double radius = 0;
    for (int d = 0; d < 3; d++) {
        double e = f == NULL ? 0 : f->leaf_hi[d][0] - f->leaf_lo[d][0];
        radius = e > radius ? e : radius;
        double du = __builtin_fabs(s->pu[d] - pv[d]);
        radius = 4 * du > radius ? 4 * du : radius;
    }
    if (s->stage == INCODE_SEED_APEX) {
        const uint32_t face[3] = {task->v, s->u, s->w};
        incode_search_begin(t, &task->search, face, pv0, s->pu, s->pw, radius);
    } else {
        const uint32_t face[3] = {task->v, s->a, s->u};
        incode_search_begin(t, &task->search, face, pv0, s->pa, s->pu, radius);
    }
    t->stats.make_tetra_calls++;
}

static void set_point(uint32_t *v, double p[3], const struct incode_query *q)
{
    *v = q->best;
    memcpy(p, q->best_p, sizeof q->best_p);
}

/* Takes in what one look has found; true: the tetrahedron is settled. */
static bool looked(struct incode_triangulator *t, struct incode_task *task)
{
    struct incode_seed *s = &task->seed;
    const struct incode_query *q = &task->search.query;
    if (s->stage == INCODE_SEED_APEX) {
        if (q->best == INCODE_NONE) { /* only below: look there */
            s->a = s->w;
            memcpy(s->pa, s->pw, sizeof s->pa);
            s->w = INCODE_NONE;
        } else if (q->best == s->a) {
            return true;
        } else {
            set_point(&s->a, s->pa, q);
        }
        s->stage = INCODE_SEED_BACK;
        return false;
    }
    if (q->best == INCODE_NONE)
        t->fault = "no tetrahedron at a vertex: the points lie on one plane";
    else if (q->best == s->w)
        return true;
    else
        set_point(&s->w, s->pw, q);
    s->stage = INCODE_SEED_APEX;
    return false;
}

static void settle(struct incode_triangulator *t, struct incode_task *task,
                   const double pv[3])
{
    const struct incode_seed *s = &task->seed;
    const uint32_t f[4] = {task->v, s->u, s->w, s->a};
    const double *const p[4] = {pv, s->pu, s->pw, s->pa};
    INCODE_ASSERT(incode_orient3d(&t->stats.tally, pv, s->pu, s->pw, s->pa) >
                  0);
    t->stats.seeds++;
    incode_star_take(t, f, p, false);
    task->kind = INCODE_TASK_IDLE;
}

static void start(struct incode_triangulator *t, struct incode_task *task,
                  const struct incode_frame *frame, const double p[3])
{
    memset(&task->seed, 0, sizeof task->seed);
    task->seed.w = task->seed.a = INCODE_NONE;
    task->seed.stage = INCODE_SEED_NEAREST;
    task->kind = INCODE_TASK_SEED;
    begin_walk(t, task, INCODE_QUERY_NEAREST, frame, p);
}

/* Other stars go on while a seed waits for a page. */
static bool is_reached(const struct incode_triangulator *t, uint32_t v)
{
    const struct incode_touched *entry =
        incode_afl_find(&t->afl, v / INCODE_BRICK_POINTS);
    return entry != NULL &&
           (entry->reached >> v % INCODE_BRICK_POINTS & 1) != 0;
}

enum incode_outcome incode_seed_run(struct incode_triangulator *t,
                                    struct incode_task *task)
{
    struct incode_seed *s = &task->seed;
    if (task->kind == INCODE_TASK_SEED && is_reached(t, task->v)) {
        task->kind = INCODE_TASK_IDLE;
        return INCODE_OK;
    }
    struct incode_query *q = &task->search.query;
    double p[3];
    if (!incode_fetch_point(t, task->v, p, &task->page))
        return INCODE_WAIT;
    const struct incode_frame *frame =
        incode_pager_get(&t->pager, task->v / INCODE_BRICK_POINTS);
    if (task->kind != INCODE_TASK_SEED)
        start(t, task, frame, p);
    while (task->kind == INCODE_TASK_SEED && t->fault == NULL) {
        if (s->stage == INCODE_SEED_NEAREST || s->stage == INCODE_SEED_CIRCLE) {
            enum incode_walk r =
                incode_walk(&t->walker, q, incode_visit_points, NULL);
            task->page = q->missing;
            if (r == INCODE_WALK_WAIT)
                return INCODE_WAIT;
            if (q->best == INCODE_NONE) {
                t->fault = "no tetrahedron at a vertex: the points lie on one "
                           "line";
            } else if (s->stage == INCODE_SEED_NEAREST) {
                set_point(&s->u, s->pu, q);
                s->stage = INCODE_SEED_CIRCLE;
                begin_walk(t, task, INCODE_QUERY_CIRCLE, frame, p);
            } else {
                set_point(&s->w, s->pw, q);
                s->stage = INCODE_SEED_APEX;
                look(t, task, p);
            }
            continue;
        }
        if (incode_search_run(t, &task->search) == INCODE_WAIT) {
            task->page = q->missing;
            return INCODE_WAIT;
        }
        if (looked(t, task))
            settle(t, task, p);
        else
            look(t, task, p);
    }
    return INCODE_OK;
}
