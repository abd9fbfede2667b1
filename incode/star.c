#include <string.h>

#include "incode/predicates/check.h"
#include "incode/maker/simd.h"
#include "state.h"

/* Closing the star of a vertex: its open faces are taken out of the active face
 * list, each gets its tetrahedron, and the new faces toggle, those at the
 * vertex at hand, the others in the list.  What is left when a page is missing
 * goes back, the face under search too: its tetrahedron may be built from
 * another side meanwhile. */

static void put_back(struct incode_triangulator *t)
{
    struct incode_star *star = &t->star;
    for (uint32_t i = 0; i < star->faces; i++)
        incode_afl_toggle(&t->afl, star->v, star->b[i], star->c[i]);
#ifdef INCODE_PLANT_TWICE /* a fault that the simulation has to find */
    if (star->faces > 0 && t->setup.shuffle_seed != 0)
        incode_afl_toggle(&t->afl, star->v, star->b[0], star->c[0]);
#endif
    star->faces = 0;
}

static void push_face(struct incode_star *star,
                      const struct incode_star_face *face)
{
    INCODE_ASSERT(star->faces < INCODE_STAR_FACES);
    uint32_t i = star->faces++;
    star->b[i] = face->b;
    star->c[i] = face->c;
    star->ib[i] = face->ib;
    star->ic[i] = face->ic;
}

static void take_faces(struct incode_triangulator *t, uint32_t limit)
{
    struct incode_star *star = &t->star;
    uint32_t pairs[INCODE_STAR_FACES][2];
    uint32_t n = incode_afl_take(&t->afl, star->v, pairs, limit, &star->more);
    star->faces = 0;
    for (uint32_t i = 0; i < n; i++)
        push_face(star, &(struct incode_star_face){pairs[i][0], pairs[i][1],
                                                   INCODE_LOCAL_NONE,
                                                   INCODE_LOCAL_NONE});
}

static bool remove_face(struct incode_star *star, uint32_t b, uint32_t c)
{
    incode_vi bs = incode_vi_all((int32_t)b), cs = incode_vi_all((int32_t)c);
    for (uint32_t i = 0; i < star->faces; i += INCODE_VF_LANES) {
        uint32_t found = incode_vf_mask((incode_vi_load(star->b + i) == bs) &
                                        (incode_vi_load(star->c + i) == cs));
        if (star->faces - i < INCODE_VF_LANES)
            found &= (UINT32_C(1) << (star->faces - i)) - 1;
        if (found == 0)
            continue;
        uint32_t k = i + (uint32_t)__builtin_ctz(found);
        uint32_t last = --star->faces;
        star->b[k] = star->b[last];
        star->c[k] = star->c[last];
        star->ib[k] = star->ib[last];
        star->ic[k] = star->ic[last];
        return true;
    }
    return false;
}

static void toggle_here(struct incode_triangulator *t, uint32_t b, uint32_t c,
                        uint16_t ib, uint16_t ic)
{
    struct incode_star *star = &t->star;
    if (remove_face(star, c, b))
        return;
    if (star->more && incode_afl_close_twin(&t->afl, star->v, b, c))
        return;
    push_face(star, &(struct incode_star_face){b, c, ib, ic});
}

static void toggle_face(struct incode_triangulator *t, const uint32_t v[3],
                        const double *const p[3], const uint16_t i[3])
{
    unsigned turn;
    if (!incode_front_key(t, v, p, &turn))
        return;
    const uint32_t f[3] = {v[turn], v[(turn + 1) % 3], v[(turn + 2) % 3]};
    if (f[0] != t->star.v) {
        incode_front_toggle(t, f);
        return;
    }
    toggle_here(t, f[1], f[2], i[(turn + 1) % 3], i[(turn + 2) % 3]);
}

/* The region of the lexicographically smallest vertex keeps a tetrahedron. */
static bool is_kept(const struct incode_triangulator *t, const uint32_t f[4],
                    const double *const p[4])
{
    bool own[4], all = true;
    for (int i = 0; i < 4; i++) {
        own[i] = incode_own(t, f[i]);
        all = all && own[i];
    }
    if (all)
        return true;
    int least = 0;
    for (int i = 1; i < 4; i++)
        if (incode_lexicographic(p[i], p[least]) < 0)
            least = i;
    return own[least];
}

/* Emits the tetrahedron f of positive orientation if it is the region's own,
 * and toggles its faces; `through`: the face (f[0], f[1], f[2]) was open and is
 * taken out already.  index: of f among the local points. */
static void star_build(struct incode_triangulator *t, const uint32_t f[4],
                       const double *const p[4], const uint16_t index[4],
                       bool through)
{
    struct incode_star *star = &t->star;
    star->built++;
    t->stats.tetrahedra_built++;
    if (is_kept(t, f, p)) {
        memcpy(star->apexes[star->kept++], f + 1, 3 * sizeof *f);
        t->stats.tetrahedra_kept++;
        INCODE_ASSERT(star->kept <= INCODE_STAR_BUILT);
    }
    incode_front_reached(t, f[3]);
    /* Faces with their unknown side outward: of (v, b, c, a) these are
     * (v, c, b) behind, (v, a, c), (v, b, a) and (b, c, a). */
    static const uint8_t face[4][3] = {
        {0, 3, 2}, {0, 1, 3}, {1, 2, 3}, {0, 2, 1}};
    for (int k = 0; k < (through ? 3 : 4); k++) {
        const uint8_t *j = face[k];
        const uint32_t v[3] = {f[j[0]], f[j[1]], f[j[2]]};
        const double *const q[3] = {p[j[0]], p[j[1]], p[j[2]]};
        const uint16_t i[3] = {index[j[0]], index[j[1]], index[j[2]]};
        toggle_face(t, v, q, i);
    }
}

/* Hands the star's own tetrahedra out. */
static void star_emit(struct incode_triangulator *t)
{
    struct incode_star *star = &t->star;
    if (star->kept > 0)
        t->outside.emit(t->outside.context, star->v,
                        (const uint32_t(*)[3])star->apexes, star->kept);
    star->kept = 0;
}

/* ---- local points ---- */

enum { NEAR_WANTED = 96, COPY_TRIES = 64 };

/* Half-width of the box of local points: the extent of the leaf, times what has
 * lately given the wanted number of points around a vertex. */
static double first_radius(const struct incode_triangulator *t,
                           const double lo[3], const double hi[3])
{
    double extent = 0;
    for (int d = 0; d < 3; d++)
        extent = hi[d] - lo[d] > extent ? hi[d] - lo[d] : extent;
    if (!(extent > 0)) {
        for (int d = 0; d < 3; d++) {
            double e = t->setup.hi[d] * 0x1p-10 - t->setup.lo[d] * 0x1p-10;
            extent = e > extent ? e : extent;
        }
    }
    double radius = extent * t->spread;
    radius = radius > 0x1p-1070 ? radius : 0x1p-1070; /* it must grow by 4s */
    return radius < 0x1p1000 ? radius : 0x1p1000;
}

static void learn_spread(struct incode_triangulator *t, uint32_t points)
{
    if (points > NEAR_WANTED * 9 / 8)
        t->spread *= 0.98;
    else if (points < NEAR_WANTED * 7 / 8)
        t->spread *= 1.02;
    t->spread = t->spread < 0.25 ? 0.25 : t->spread > 16 ? 16 : t->spread;
}

/* Brings the points around the leaf of a vertex to hand. */
static enum incode_outcome copy_around_leaf(struct incode_triangulator *t,
                                            struct incode_task *task,
                                            const struct incode_frame *f)
{
    struct incode_local_points *local = &t->local;
    uint32_t leaf = task->v % INCODE_BRICK_POINTS / INCODE_LEAF_POINTS;
    double lo[3], hi[3];
    for (int d = 0; d < 3; d++) {
        lo[d] = f->leaf_lo[d][leaf];
        hi[d] = f->leaf_hi[d][leaf];
    }
    double radius = first_radius(t, lo, hi);
    for (int tries = 0;; tries++) {
        enum incode_local_outcome r =
            incode_local_around(local, &t->walker, &t->neighbours,
                                task->v / INCODE_LEAF_POINTS, lo, hi, radius);
        task->page = local->query.missing;
        if (r == INCODE_LOCAL_WAIT)
            return INCODE_WAIT;
        if (r == INCODE_LOCAL_READY || tries == COPY_TRIES)
            return INCODE_OK;
        radius *= 0.75;
        t->spread *= 0.9;
    }
}

enum {
    NEIGHBOURS_WANTED = 64, /* bricks, at least */
    NEIGHBOURS_TRIES = 12
};

/* Lists the bricks around that of a vertex: more of them where there are few,
 * none where there are too many whatever the box. */
static enum incode_outcome list_bricks(struct incode_triangulator *t,
                                       struct incode_task *task,
                                       const struct incode_frame *f)
{
    struct incode_neighbours *v = &t->neighbours;
    uint32_t brick = task->v / INCODE_BRICK_POINTS;
    double lo[3], hi[3], extent = 0;
    bool full = false;
    incode_frame_box(f, lo, hi);
    for (int d = 0; d < 3; d++)
        extent = hi[d] - lo[d] > extent ? hi[d] - lo[d] : extent;
    for (int tries = 0; tries < NEIGHBOURS_TRIES; tries++) {
        double radius = extent * t->reach, around_lo[3], around_hi[3];
        bool all = true;
        for (int d = 0; d < 3; d++) {
            around_lo[d] = lo[d] - radius;
            around_hi[d] = hi[d] + radius;
            all = all && around_lo[d] <= t->setup.lo[d] &&
                  around_hi[d] >= t->setup.hi[d];
        }
        enum incode_listed r = incode_neighbours_make(
            v, &t->walker, brick, around_lo, around_hi, &task->page);
        if (r == INCODE_LIST_WAIT)
            return INCODE_WAIT;
        if (r == INCODE_LISTED &&
            (full || all || v->count >= NEIGHBOURS_WANTED))
            break;
        full = full || r == INCODE_LIST_FULL;
        t->reach *= full ? 0.75 : 1.25;
        t->reach = t->reach < 0x1p-10  ? 0x1p-10
                   : t->reach > 0x1p10 ? 0x1p10
                                       : t->reach;
    }
    for (int d = 0; d < 3; d++) {
        if (v->box_lo[d] <= t->setup.lo[d])
            v->box_lo[d] = -__builtin_inf();
        if (v->box_hi[d] >= t->setup.hi[d])
            v->box_hi[d] = __builtin_inf();
    }
    return INCODE_OK;
}

static enum incode_outcome star_points(struct incode_triangulator *t,
                                       struct incode_task *task)
{
    struct incode_local_points *local = &t->local;
    uint32_t v = task->v, slot = v % INCODE_BRICK_POINTS;
    const struct incode_frame *f =
        incode_pager_get(&t->pager, v / INCODE_BRICK_POINTS);
    task->page = v / INCODE_BRICK_POINTS;
    if (f == NULL)
        return INCODE_WAIT;
    if (t->neighbours.centre != v / INCODE_BRICK_POINTS &&
        list_bricks(t, task, f) == INCODE_WAIT)
        return INCODE_WAIT;
    if (local->leaf != v / INCODE_LEAF_POINTS &&
        copy_around_leaf(t, task, f) == INCODE_WAIT)
        return INCODE_WAIT;
    const double p[3] = {f->page.brick.x[slot], f->page.brick.y[slot],
                         f->page.brick.z[slot]};
    bool again = local->vertex == v; /* after a wait: nothing new to learn */
    incode_local_centre(local, v, p, local->radius, t->setup.lo, t->setup.hi);
    if (!again)
        learn_spread(t, local->near);
    return INCODE_OK;
}

/* ---- the star ---- */

/* Index of vertex `id` among the local points, fetched and appended if it is
 * far; INCODE_AGAIN: the room for far vertices is used up. */
static enum incode_outcome resolve(struct incode_triangulator *t, uint32_t id,
                                   uint16_t *index, uint32_t *page)
{
    if (*index != INCODE_LOCAL_NONE)
        return INCODE_OK;
    uint32_t i = incode_local_find(&t->local, id);
    if (i == INCODE_LOCAL_NONE) {
        double p[3];
        if (!incode_fetch_point(t, id, p, page))
            return INCODE_WAIT;
        i = incode_local_append(&t->local, id, p);
        if (i == INCODE_LOCAL_NONE)
            return INCODE_AGAIN;
    }
    *index = (uint16_t)i;
    return INCODE_OK;
}

static void build_at(struct incode_triangulator *t, uint16_t ib, uint16_t ic,
                     uint16_t ia)
{
    const struct incode_local_points *local = &t->local;
    const uint16_t index[4] = {INCODE_LOCAL_NONE, ib, ic, ia};
    const uint32_t f[4] = {local->vertex, local->id[ib], local->id[ic],
                           local->id[ia]};
    double p[4][3];
    for (int d = 0; d < 3; d++) {
        p[0][d] = local->p0[d];
        p[1][d] = local->p[d][ib];
        p[2][d] = local->p[d][ic];
        p[3][d] = local->p[d][ia];
    }
    const double *const q[4] = {p[0], p[1], p[2], p[3]};
    star_build(t, f, q, index, true);
}

/* MakeTetra for one face of the star, which has been taken out of it. */
static enum incode_outcome pursue(struct incode_triangulator *t,
                                  struct incode_task *task,
                                  struct incode_star_face *face)
{
    enum incode_outcome r = resolve(t, face->b, &face->ib, &task->page);
    if (r == INCODE_OK)
        r = resolve(t, face->c, &face->ic, &task->page);
    if (r != INCODE_OK)
        return r;
    uint32_t apex;
    t->stats.make_tetra_calls++;
    enum incode_near near =
        incode_apex_near(t, face->ib, face->ic, &apex, &task->search);
    if (near == INCODE_NEAR_HULL) {
        t->stats.hull_facets++;
        return INCODE_OK;
    }
    if (near == INCODE_NEAR_FOUND) {
        build_at(t, face->ib, face->ic, (uint16_t)apex);
        return INCODE_OK;
    }
    t->stats.tree_searches++;
    task->kind = INCODE_TASK_SEARCH;
    return INCODE_AGAIN;
}

/* The task's search is over: builds what it found if its face is still open. */
static enum incode_outcome use_found(struct incode_triangulator *t,
                                     struct incode_task *task)
{
    const struct incode_query *q = &task->search.query;
    struct incode_star *star = &t->star;
    uint16_t index[3] = {INCODE_LOCAL_NONE, INCODE_LOCAL_NONE,
                         INCODE_LOCAL_NONE};
    if (q->best != INCODE_NONE) {
        uint32_t i = incode_local_find(&t->local, q->best);
        if (i == INCODE_LOCAL_NONE)
            i = incode_local_append(&t->local, q->best, q->best_p);
        index[2] = (uint16_t)i;
        enum incode_outcome r = resolve(t, q->b, &index[0], &task->page);
        if (r == INCODE_OK)
            r = resolve(t, q->c, &index[1], &task->page);
        if (r != INCODE_OK || i == INCODE_LOCAL_NONE)
            return r != INCODE_OK ? r : INCODE_AGAIN;
    }
    task->kind = INCODE_TASK_STAR;
    if (q->question == INCODE_QUERY_HALF_SPACE)
        return INCODE_OK; /* the face is tried again with it */
    incode_search_learn(t, q);
    bool open = remove_face(star, q->b, q->c);
    if (!open && star->more) {
        /* It may be among those that did not fit at hand. */
        open = incode_afl_close_twin(&t->afl, star->v, q->c, q->b);
    }
    if (!open)
        return INCODE_OK;
    if (q->best == INCODE_NONE)
        t->stats.hull_facets++;
    else
        build_at(t, index[0], index[1], index[2]);
    return INCODE_OK;
}

/* One face: the search under way goes first, then the last one opened. */
static enum incode_outcome advance(struct incode_triangulator *t,
                                   struct incode_task *task)
{
    struct incode_star *star = &t->star;
    if (task->kind == INCODE_TASK_SEARCH) {
        if (incode_search_run(t, &task->search) == INCODE_WAIT) {
            task->page = task->search.query.missing;
            return INCODE_WAIT;
        }
        task->kind = INCODE_TASK_FOUND;
    }
    if (task->kind == INCODE_TASK_FOUND)
        return use_found(t, task);
    uint32_t i = --star->faces;
    struct incode_star_face face = {star->b[i], star->c[i], star->ib[i],
                                    star->ic[i]};
    enum incode_outcome r = pursue(t, task, &face);
    if (r != INCODE_OK)
        push_face(star, &face);
    return r == INCODE_AGAIN && task->kind == INCODE_TASK_SEARCH ? INCODE_OK
                                                                 : r;
}

void incode_star_take(struct incode_triangulator *t, const uint32_t f[4],
                      const double *const p[4], bool through)
{
    static const uint16_t far[4] = {INCODE_LOCAL_NONE, INCODE_LOCAL_NONE,
                                    INCODE_LOCAL_NONE, INCODE_LOCAL_NONE};
    struct incode_star *star = &t->star;
    star->v = f[0];
    star->faces = star->built = star->kept = 0;
    star->more = true;
    for (int i = 0; i < 3 && !through; i++)
        incode_front_reached(t, f[i]);
    star_build(t, f, p, far, through);
    put_back(t);
    star_emit(t);
}

enum incode_outcome incode_star_close(struct incode_triangulator *t,
                                      struct incode_task *task)
{
    struct incode_star *star = &t->star;
    star->v = task->v;
    star->built = star->kept = 0;
    take_faces(t, INCODE_STAR_FACES / 2);
    if (star->faces == 0) {
        task->kind = INCODE_TASK_IDLE;
        return INCODE_OK;
    }
    enum incode_outcome r = star_points(t, task);
    while (r == INCODE_OK && star->faces > 0) {
        if (star->built >= t->built_max) {
            r = INCODE_AGAIN;
            break;
        }
        r = advance(t, task);
        if (r == INCODE_OK && star->faces > INCODE_STAR_FACES - 4)
            r = INCODE_AGAIN; /* the list will find it crowded */
    }
    put_back(t);
    star_emit(t);
    if (r == INCODE_OK && task->kind != INCODE_TASK_SEARCH)
        task->kind = INCODE_TASK_IDLE;
    return r;
}
