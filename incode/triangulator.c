#include "triangulator.h"

#include <assert.h>
#include <string.h>

#include "incode/pages/sound.h"
#include "incode/predicates/check.h"
#include "state.h"

static_assert((int)INCODE_HINT_NONE == INCODE_LOCAL_NONE, "hints are indices");
static_assert((int)INCODE_TASKS == INCODE_SEARCHES, "a search for each task");

/* ---- memory ---- */

static size_t round_up(size_t bytes)
{
    return (bytes + 63) & ~(size_t)63;
}

static uint32_t between(size_t least, size_t a, size_t most)
{
    return (uint32_t)(a < least ? least : a > most ? most : a);
}

/* The horizon of a maker: a box for 4 KB, a copy for 64 KB. */
static struct incode_maker_share horizon_of(size_t bytes)
{
    size_t boxes = bytes >> 12, copies = bytes >> 16;
    return (struct incode_maker_share){
        between(INCODE_HORIZON_MIN, boxes / 64 * 64, INCODE_HORIZON_MAX),
        between(16, copies, INCODE_HORIZON_COPIES), 0};
}

/* How an arena is divided. */
struct shares {
    struct incode_front_share front;
    struct incode_maker_share maker;
};

/* The active face list takes three eighths of what the control block leaves
 * (the front of a region of 1,250,000 points, with a tenth to spare), the
 * bricks a sixteenth, page frames the rest. */
static bool divide(struct shares *s, struct incode_map *map, size_t bytes)
{
    memset(map, 0, sizeof *map);
    s->maker = horizon_of(bytes);
    size_t horizon = incode_horizon_bytes(s->maker.boxes, s->maker.copies);
    map->control = round_up(sizeof(struct incode_triangulator)) + horizon;
    map->local_points = sizeof(struct incode_local_points);
    map->tasks = (sizeof(struct incode_task) + sizeof(struct incode_search)) *
                 INCODE_TASKS;
    if (bytes < map->control)
        return false;
    size_t rest = bytes - map->control;
    size_t face = sizeof(struct incode_afl_node) + sizeof(uint32_t);
    size_t brick = sizeof(struct incode_touched) + sizeof(uint32_t);
    map->afl_faces = rest * 3 / 8 / face;
    map->brick_entries = rest / 16 / brick;
    if (map->afl_faces < INCODE_FACES_MIN)
        map->afl_faces = INCODE_FACES_MIN;
    if (map->brick_entries < INCODE_ENTRIES_MIN)
        map->brick_entries = INCODE_ENTRIES_MIN;
    s->front = (struct incode_front_share){(uint32_t)map->afl_faces,
                                           (uint32_t)map->brick_entries};
    size_t both = incode_front_bytes(&s->front);
    map->bricks = map->brick_entries * brick;
    map->afl = both - map->bricks;
    size_t used = map->control + round_up(both);
    if (bytes < used)
        return false;
    s->maker.frames = incode_maker_frames(&s->maker, bytes - used + horizon);
    map->frame_count = s->maker.frames;
    map->frames = incode_maker_bytes(&s->maker) - horizon;
    map->total = used + map->frames;
    return map->frame_count >= INCODE_FRAMES_MIN;
}

size_t incode_arena_min(const struct incode_setup *setup)
{
    (void)setup;
    size_t bytes = sizeof(struct incode_triangulator);
    struct incode_map map;
    struct shares shares;
    while (!divide(&shares, &map, bytes))
        bytes += 1024;
    return bytes;
}

static const char *grid_fault(const uint32_t cells[3])
{
    uint64_t product = 1;
    for (int d = 0; d < 3; d++) {
        if (cells[d] < 1 || cells[d] > INCODE_CELLS_MAX)
            return "invalid setup: cells of the grid out of their limits";
        product *= cells[d]; /* below 2^32 times 2^30 */
        if (product >= INCODE_NONE)
            return "invalid setup: too many cells of the grid";
    }
    return NULL;
}

const char *incode_setup_fault(const struct incode_setup *setup)
{
    if (setup->bricks == 0)
        return "there are no points";
    if (setup->bricks > INCODE_NONE / INCODE_BRICK_POINTS)
        return "invalid setup: too many bricks";
    if (setup->index != INCODE_NAIVE && setup->index != INCODE_GRID &&
        setup->index != INCODE_KD)
        return "invalid setup: unknown index";
    if (setup->face_rule != INCODE_FACE_OWN &&
        setup->face_rule != INCODE_FACE_PAPER)
        return "invalid setup: unknown face rule";
    if (setup->reserved != 0 || setup->reserved2 != 0)
        return "invalid setup: what is reserved is not 0";
    for (int d = 0; d < 3; d++)
        if (!__builtin_isfinite(setup->lo[d]) ||
            !__builtin_isfinite(setup->hi[d]) || setup->lo[d] > setup->hi[d])
            return "invalid setup: the box of all points is empty or infinite";
    if (setup->index == INCODE_GRID)
        return grid_fault(setup->cells);
    if (setup->cells[0] != 0 || setup->cells[1] != 0 || setup->cells[2] != 0)
        return "invalid setup: cells without a grid";
    return NULL;
}

struct incode_triangulator *
incode_triangulator_init(void *arena, size_t bytes,
                         const struct incode_setup *setup,
                         const struct incode_outside *outside, const char **why)
{
    struct shares shares;
    struct incode_map map;
    INCODE_ASSERT((uintptr_t)arena % 64 == 0);
    *why = incode_setup_fault(setup);
    if (*why != NULL)
        return NULL;
    if (!divide(&shares, &map, bytes)) {
        *why = "the node's memory is too small for this index";
        return NULL;
    }
    struct incode_triangulator *t = arena;
    struct incode_points points = {.bricks = setup->bricks,
                                   .index = setup->index,
                                   .shuffle_seed = setup->shuffle_seed};
    memcpy(points.lo, setup->lo, sizeof points.lo);
    memcpy(points.hi, setup->hi, sizeof points.hi);
    memcpy(points.cells, setup->cells, sizeof points.cells);
    uint8_t *front = (uint8_t *)arena + round_up(sizeof *t);
    uint8_t *maker = front + round_up(incode_front_bytes(&shares.front));
    t->map = map;
    t->units = UINT32_MAX;
    t->spent = 0;
    incode_front_init(&t->front, front, &shares.front, setup->bricks,
                      (enum incode_face_rule)setup->face_rule, &outside->front);
    incode_maker_init(&t->maker, maker, &shares.maker, &points,
                      &outside->pages);
    return t;
}

void incode_triangulator_start(struct incode_triangulator *t,
                               const struct incode_job *job)
{
    incode_maker_start(&t->maker);
    incode_front_start(&t->front, job);
}

int incode_triangulator_page(struct incode_triangulator *t, uint32_t page,
                             const void *data, size_t bytes)
{
    const struct incode_maker *m = &t->maker;
    if (!incode_pager_loading(&m->pager, page))
        return INCODE_PAGE_UNASKED;
    if (!incode_page_is_sound(&m->tree, m->lo, m->hi, page, data, bytes))
        return INCODE_PAGE_UNSOUND;
    return incode_pager_deliver(&t->maker.pager, page, data, bytes) == 0
               ? 0
               : INCODE_PAGE_UNASKED;
}

uint32_t incode_triangulator_awaited(const struct incode_triangulator *t)
{
    return incode_pager_awaited(&t->maker.pager);
}

int incode_triangulator_unspill(struct incode_triangulator *t, uint32_t brick,
                                const struct incode_face *faces, size_t count,
                                bool last)
{
    return incode_front_unspill(&t->front, brick, faces, count, last);
}

/* ---- what the front asks, the maker answers ---- */

struct corners {
    const double *p[4];
};

static inline struct corners corners_of(const struct incode_answer *a)
{
    return (struct corners){{a->p[0], a->p[1], a->p[2], a->p[3]}};
}

/* One face of the star: that under search goes first, then the last one opened.
 */
static enum incode_outcome advance(struct incode_triangulator *t, unsigned task)
{
    struct incode_answer a;
    struct incode_star_face face;
    enum incode_outcome r;
    if (incode_maker_is_searching(&t->maker, task)) {
        r = incode_maker_resume(&t->maker, task, &a);
        if (r != INCODE_OK || !incode_star_find(&t->front, a.f[1], a.f[2]))
            return r == INCODE_MORE ? INCODE_OK : r;
    } else {
        (void)incode_star_take(&t->front, &face);
        r = incode_maker_apex(&t->maker, task, face.b, face.c, face.hint, &a);
        if (r != INCODE_OK) {
            incode_star_put(&t->front, &face);
            return r == INCODE_MORE ? INCODE_OK : r;
        }
    }
    incode_star_build(&t->front, a.f, corners_of(&a).p, a.near);
    return INCODE_OK;
}

#ifdef INCODE_PLANT_TWICE /* a fault that the simulation has to find */
static void plant(struct incode_triangulator *t)
{
    const struct incode_star *star = &t->front.star;
    if (star->faces > 0 && t->maker.pager.shuffle != 0)
        incode_afl_toggle(&t->front.afl, star->v, star->b[0], star->c[0]);
}
#endif

/* A face is a unit, and so are as many points as a brick has. */
static void spend_candidates(struct incode_triangulator *t, uint64_t before)
{
    uint64_t looked = t->maker.counts.candidates - before;
    incode_walker_spend(&t->maker.walker,
                        1 + (uint32_t)(looked / INCODE_BRICK_POINTS));
}

/* Closes the star of a vertex as far as it goes. */
static enum incode_outcome close_star(struct incode_triangulator *t,
                                      unsigned task)
{
    struct incode_front *front = &t->front;
    uint32_t v = incode_front_vertex(front, task);
    if (!incode_star_open(front, v))
        return INCODE_OK;
    enum incode_outcome r = incode_maker_centre(&t->maker, task, v);
    while (r == INCODE_OK && !incode_star_is_closed(front)) {
        if (incode_star_is_enough(front)) {
            r = INCODE_AGAIN;
            break;
        }
        uint64_t before = t->maker.counts.candidates;
        r = advance(t, task);
        spend_candidates(t, before);
        if (r == INCODE_OK && incode_star_is_full(front))
            r = INCODE_AGAIN; /* the list will find it crowded */
        if (r == INCODE_OK && t->maker.walker.left == 0)
            r = incode_maker_is_searching(&t->maker, task) ? INCODE_MORE
                                                           : INCODE_AGAIN;
    }
#ifdef INCODE_PLANT_TWICE
    plant(t);
#endif
    incode_star_shut(front);
    return r;
}

/* The paper's InCoDe, face by face: any open face of the vertex.  It stays open
 * until its answer comes, as another search may close it meanwhile. */
static enum incode_outcome pursue_face(struct incode_triangulator *t,
                                       unsigned task)
{
    struct incode_answer a;
    uint32_t f[3];
    if (!incode_maker_is_searching(&t->maker, task) &&
        !incode_front_face(&t->front, incode_front_vertex(&t->front, task), f))
        return INCODE_OK;
    enum incode_outcome r = incode_maker_face(&t->maker, task, f, &a);
    if (r == INCODE_OK)
        incode_front_use(&t->front, a.f, corners_of(&a).p);
    return r;
}

static enum incode_outcome build_first(struct incode_triangulator *t,
                                       unsigned task)
{
    struct incode_answer a;
    uint32_t v = incode_front_vertex(&t->front, task);
    /* Other stars go on while a seed waits for a page. */
    if (incode_front_is_reached(&t->front, v))
        return INCODE_OK;
    enum incode_outcome r = incode_maker_first(&t->maker, task, v, &a);
    if (r == INCODE_OK && t->maker.fault == NULL)
        incode_front_seed(&t->front, a.f, corners_of(&a).p);
    return r;
}

/* ---- steps ---- */

static enum incode_step run(struct incode_triangulator *t, unsigned task)
{
    enum incode_outcome r;
    incode_front_run(&t->front, t->maker.walker.left);
    if (incode_front_is_seed(&t->front, task))
        r = build_first(t, task);
    else if (t->maker.index == INCODE_KD)
        r = close_star(t, task);
    else
        r = pursue_face(t, task);
    if (r != INCODE_WAIT && r != INCODE_MORE) {
        incode_front_done(&t->front, task);
        return INCODE_WORKED;
    }
    incode_front_suspend(&t->front, task, r == INCODE_WAIT,
                         incode_maker_has_advanced(&t->maker, task));
    if (r == INCODE_MORE)
        return INCODE_WORKED;
    /* Without credit for its page the task can only be tried again. */
    return incode_maker_waiting(&t->maker, UINT32_C(1) << task) != 0
               ? INCODE_WORKED
               : INCODE_WAITING;
}

static enum incode_turn next(struct incode_triangulator *t, uint32_t *task)
{
    uint32_t first, last;
    incode_front_own_left(&t->front, &first, &last);
    incode_maker_look_ahead(&t->maker, first, last);
    enum incode_turn turn = incode_front_next(&t->front, task);
    if (turn == INCODE_TURN_COUNT) {
        uint32_t count = incode_maker_count(&t->maker, *task);
        turn = count == 0 ? INCODE_TURN_WAIT
                          : incode_front_count(&t->front, count, task);
    }
    if (turn == INCODE_TURN_TASK)
        incode_maker_forget(&t->maker, *task);
    return turn;
}

static enum incode_step step(struct incode_triangulator *t)
{
    uint32_t task;
    uint32_t waiting =
        incode_maker_waiting(&t->maker, incode_front_suspended(&t->front));
    enum incode_turn turn = incode_front_turn(&t->front, waiting, &task);
    if (turn == INCODE_TURN_NEXT)
        turn = next(t, &task);
    switch (turn) {
    case INCODE_TURN_RESUME:
    case INCODE_TURN_TASK:
        return run(t, task);
    case INCODE_TURN_WORKED:
        return INCODE_WORKED;
    case INCODE_TURN_END:
        return INCODE_FINISHED;
    case INCODE_TURN_NEXT:
    case INCODE_TURN_COUNT:
    case INCODE_TURN_WAIT:
    default:
        return INCODE_WAITING;
    }
}

enum incode_step incode_triangulator_step(struct incode_triangulator *t)
{
    if (incode_triangulator_fault(t) != NULL)
        return INCODE_BROKEN;
    if (incode_front_is_finished(&t->front))
        return INCODE_FINISHED;
    bool released = incode_pager_release(&t->maker.pager, false);
    struct incode_walker *walker = &t->maker.walker;
    walker->left = t->units;
    enum incode_step r = step(t);
    t->spent += 1 + (t->units - walker->left);
    if (incode_triangulator_fault(t) != NULL)
        return INCODE_BROKEN;
    if (r == INCODE_WAITING &&
        (released || incode_pager_release(&t->maker.pager, true)))
        return INCODE_WORKED;
    return r;
}

void incode_triangulator_allow(struct incode_triangulator *t, uint32_t units)
{
    t->units = units > 0 ? units : 1;
}

uint64_t incode_triangulator_spent(const struct incode_triangulator *t)
{
    return t->spent;
}

/* ---- reports ---- */

void incode_triangulator_statistics(const struct incode_triangulator *t,
                                    struct incode_statistics *s)
{
    const struct incode_front *front = &t->front;
    const struct incode_maker *maker = &t->maker;
    const struct incode_pager *pager = &maker->pager;
    *s = (struct incode_statistics){
        .tetrahedra_built = front->counts.built,
        .tetrahedra_kept = front->counts.kept,
        .make_tetra_calls = maker->counts.calls,
        .hull_facets = front->counts.hull_facets,
        .candidates = maker->counts.candidates,
        .tree_searches = maker->counts.tree_searches,
        .seeds = front->counts.seeds,
        .vertices = front->counts.vertices,
        .vertices_waited = front->counts.waited,
        .page_requests = pager->requests,
        .page_faults = front->counts.faults,
        .page_evictions = pager->evictions,
        .afl_max = front->afl.count_max,
        .afl_spilled = front->counts.spilled,
        .memory_high_water =
            t->map.total - (t->map.frame_count - pager->frames_used) *
                               sizeof(struct incode_frame),
        .tally = maker->counts.tally};
    memcpy(s->candidates_histogram, maker->counts.histogram,
           sizeof s->candidates_histogram);
}

const struct incode_map *
incode_triangulator_map(const struct incode_triangulator *t)
{
    return &t->map;
}

const char *incode_triangulator_fault(const struct incode_triangulator *t)
{
    if (t->front.afl.fault != NULL)
        return t->front.afl.fault;
    return t->front.fault != NULL ? t->front.fault : t->maker.fault;
}
