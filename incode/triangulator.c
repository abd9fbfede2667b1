#include "triangulator.h"

#include <assert.h>
#include <string.h>

#include "state.h"
#include "incode/front/exchange.h"
#include "incode/pages/pages.h"
#include "incode/predicates/check.h"

static_assert((int)INCODE_HINT_NONE == INCODE_LOCAL_NONE, "hints are indices");
static_assert((int)INCODE_TASKS < INCODE_SEARCHES,
              "a search for each task, and one for what is borrowed");

static const char *grid_fault(const uint32_t cells[3]) {
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

const char *incode_setup_fault(const struct incode_setup *setup) {
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
    if (setup->build > INCODE_BUILD_POINTS)
        return "invalid setup: unknown way to build";
    if (setup->owner_rule > INCODE_OWNER_LOWEST)
        return "invalid setup: unknown owner rule";
    if (setup->reserved2 != 0)
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

static bool may_insert(const struct incode_setup *setup) {
    return setup->index == INCODE_KD && setup->face_rule == INCODE_FACE_OWN &&
           setup->owner_rule == INCODE_OWNER_SMALLEST;
}

struct incode_triangulator *incode_triangulator_init(
    void *arena, size_t bytes, const struct incode_setup *setup,
    const struct incode_outside *outside, const char **why) {
    struct incode_shares shares;
    struct incode_map map;
    INCODE_ASSERT((uintptr_t)arena % 64 == 0);
    *why = incode_setup_fault(setup);
    if (*why != NULL)
        return NULL;
    if (!incode_arena_divide(&shares, &map, setup, bytes)) {
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
    struct incode_yield yield = outside->yield;
    memset(t, 0, sizeof *t);
    incode_yield_after(&yield, INCODE_YIELD_UNITS);
    t->map = map;
    t->shares = shares;
    size_t bits = incode_arena_bits(setup, bytes);
    t->committed = bits > 0 ? (uint64_t *)(t + 1) : NULL;
    t->arena = (uint8_t *)arena + incode_arena_aligned(sizeof *t + bits);
    t->bytes = bytes - incode_arena_aligned(sizeof *t + bits);
    t->units = UINT32_MAX;
    t->build = may_insert(setup) ? (enum incode_build)setup->build
                                 : INCODE_BUILD_FACES;
    t->phase = INCODE_PHASE_IDLE;
    size_t maker = incode_maker_bytes(&shares.maker);
    incode_maker_init(&t->maker, t->arena, &shares.maker, &points,
                      &outside->pages, &yield);
    incode_maker_yield(&t->maker, INCODE_YIELD_UNITS);
    incode_front_init(&t->front, t->arena + maker, &shares.front, setup->bricks,
                      (enum incode_face_rule)setup->face_rule, &outside->front,
                      &t->maker.counts.tally.yield);
    t->front.owner_rule = (enum incode_owner_rule)setup->owner_rule;
    if (outside->peers.share != NULL)
        incode_front_exchange(&t->front, &outside->peers, setup->lo,
                              t->committed);
    incode_insertion_init(&t->insertion, &t->maker, &outside->front);
    return t;
}

/* ---- point by point, or face by face ---- */

/* Whether the bricks of a page of boxes are mostly of a surface: their lifted
 * boxes tell more than those along the axes.  1, 0, or -1: it is missing. */
static int is_surface(struct incode_triangulator *t, uint32_t brick) {
    const struct incode_tree *tree = &t->maker.tree;
    const struct incode_frame *f = incode_pager_get(
        &t->maker.pager, tree->base[1] + brick / INCODE_FANOUT);
    uint32_t lifted = 0, first = brick / INCODE_FANOUT * INCODE_FANOUT;
    uint32_t count = tree->bricks - first;
    if (f == NULL)
        return -1;
    count = count < INCODE_FANOUT ? count : INCODE_FANOUT;
    for (uint32_t i = 0; i < count; i++)
        lifted += f->page.boxes.is_lifted[i];
    return 2 * lifted > count;
}

/* Whether what is not final of a volume of so many bricks takes no more than
 * half the memory: it has some 8 n^(2/3) cells, measured on uniform points. */
static bool fits(const struct incode_triangulator *t, uint32_t bricks) {
    uint64_t points = (uint64_t)bricks * INCODE_BRICK_POINTS;
    uint64_t cells =
        t->bytes / 2 /
        (sizeof(struct incode_cell) + sizeof(struct incode_complex_point) / 4) /
        8;
    cells = cells < UINT32_C(1) << 21 ? cells : (UINT32_C(1) << 21) - 1;
    return points <= UINT32_MAX && points * points <= cells * cells * cells;
}

/* 1: point by point, 0: face by face, -1: a page is missing.  A part of the
 * bricks needs some points of others, too, which for a volume takes as long as
 * the faces do. */
static int choose_points(struct incode_triangulator *t) {
    uint32_t own = t->job.last - t->job.first;
    bool all = own == t->maker.tree.bricks;
    size_t words = (t->maker.tree.bricks + 63) / 64;
    size_t least = INCODE_INSERTION_LEAST + 2 * words * sizeof(uint64_t);
    if (own == 0 || t->committed == NULL || t->build == INCODE_BUILD_FACES ||
        incode_arena_room(t) < least)
        return 0;
    if (t->build == INCODE_BUILD_POINTS || (all && fits(t, own)))
        return 1;
    return all || fits(t, own) ? is_surface(t, t->job.first + own / 2) : 0;
}

/* Begins the job, unless a page is missing, or on its way. */
static enum incode_step choose(struct incode_triangulator *t) {
    int points = choose_points(t);
    if (points == 0 && incode_insertion_is_alone(&t->insertion)) {
        t->phase = INCODE_PHASE_IDLE;
        return INCODE_FULL;
    }
    if (points < 0 || !incode_arena_turn(t, points == 1))
        return INCODE_WAITING;
    t->phase = points == 1 ? INCODE_PHASE_POINTS : INCODE_PHASE_FACES;
    if (points == 0)
        incode_front_start(&t->front, &t->job);
    return INCODE_WORKED;
}

void incode_triangulator_start(struct incode_triangulator *t,
                               const struct incode_job *job) {
    incode_maker_start(&t->maker);
    t->job = *job;
    t->phase = INCODE_PHASE_CHOOSE;
    incode_front_abandon(&t->front);
    if (t->build == INCODE_BUILD_FACES)
        (void)choose(t);
}

int incode_triangulator_page(struct incode_triangulator *t, uint32_t page,
                             const void *data, size_t bytes) {
    return incode_maker_page(&t->maker, page, data, bytes);
}

int incode_triangulator_put(struct incode_triangulator *t, uint32_t page,
                            const void *data, size_t bytes) {
    return incode_maker_put(&t->maker, page, data, bytes);
}

bool incode_triangulator_has(const struct incode_triangulator *t,
                             uint32_t page) {
    return incode_pager_has(&t->maker.pager, page);
}

size_t incode_triangulator_copy(const struct incode_triangulator *t,
                                uint32_t page, void *data) {
    return incode_pager_copy(&t->maker.pager, page, data);
}

uint64_t *incode_triangulator_label(const struct incode_triangulator *t,
                                    uint32_t page) {
    return incode_pager_label(&t->maker.pager, page);
}

bool incode_triangulator_awaits(const struct incode_triangulator *t,
                                uint32_t page) {
    return incode_pager_loading(&t->maker.pager, page);
}

bool incode_triangulator_fetch(struct incode_triangulator *t, uint32_t page) {
    /* No step of this node's own lets go what the shuffle keeps back. */
    while (t->phase == INCODE_PHASE_IDLE &&
           incode_pager_release(&t->maker.pager, true)) {
    }
    return incode_pager_has(&t->maker.pager, page) ||
           incode_maker_fetch(&t->maker, page);
}

uint32_t incode_triangulator_awaited(const struct incode_triangulator *t) {
    return incode_pager_awaited(&t->maker.pager);
}

int incode_triangulator_unspill(struct incode_triangulator *t, uint32_t brick,
                                const struct incode_face *faces, size_t count,
                                bool last) {
    return incode_front_unspill(&t->front, brick, faces, count, last);
}

/* ---- with others ---- */

bool incode_triangulator_may_take(struct incode_triangulator *t,
                                  uint32_t count) {
    return t->phase != INCODE_PHASE_FACES ||
           incode_front_may_take(&t->front, count);
}

int incode_triangulator_take(struct incode_triangulator *t,
                             const uint32_t v[4]) {
    return t->phase == INCODE_PHASE_FACES ? incode_front_take(&t->front, v)
                                          : -1;
}

void incode_triangulator_seed(struct incode_triangulator *t) {
    if (t->phase == INCODE_PHASE_FACES)
        incode_front_seed_all(&t->front);
}

bool incode_triangulator_is_quiet(const struct incode_triangulator *t) {
    return t->phase == INCODE_PHASE_IDLE || incode_front_is_quiet(&t->front);
}

uint32_t incode_triangulator_left(const struct incode_triangulator *t) {
    return incode_front_left(&t->front);
}

/* ---- what the front asks, the maker answers ---- */

struct corners {
    const double *p[4];
};

static inline struct corners corners_of(const struct incode_answer *a) {
    return (struct corners){{a->p[0], a->p[1], a->p[2], a->p[3]}};
}

/* One face of the star: that under search goes first, then the last one opened.
 */
static enum incode_step advance(struct incode_triangulator *t, unsigned task) {
    struct incode_answer a;
    struct incode_star_face face;
    enum incode_step r;
    if (incode_maker_is_searching(&t->maker, task)) {
        r = incode_maker_resume(&t->maker, task, &a);
        if (r != INCODE_FINISHED ||
            !incode_star_find(&t->front, a.f[1], a.f[2]))
            return r == INCODE_WORKED ? INCODE_FINISHED : r;
    } else {
        if (!incode_star_take(&t->front, &face))
            return INCODE_FINISHED;
        r = incode_maker_apex(&t->maker, task, face.b, face.c, face.hint, &a);
        if (r != INCODE_FINISHED) {
            incode_star_put(&t->front, &face);
            return r == INCODE_WORKED ? INCODE_FINISHED : r;
        }
    }
    incode_star_build(&t->front, a.f, corners_of(&a).p, a.near);
    return INCODE_FINISHED;
}

#ifdef INCODE_PLANT_TWICE /* a fault that the simulation has to find */
static void plant(struct incode_triangulator *t) {
    const struct incode_star *star = &t->front.star;
    if (star->faces > 0 && t->maker.pager.shuffle != 0)
        incode_afl_toggle(&t->front.afl, star->v, star->b[0], star->c[0]);
}
#endif

/* A face is a unit, and so are as many points as a brick has. */
static void spend_candidates(struct incode_triangulator *t, uint64_t before) {
    uint64_t looked = t->maker.counts.candidates - before;
    incode_walker_spend(&t->maker.walker,
                        1 + (uint32_t)(looked / INCODE_BRICK_POINTS));
}

/* Closes the star of a vertex as far as it goes. */
static enum incode_step close_star(struct incode_triangulator *t,
                                   unsigned task) {
    struct incode_front *front = &t->front;
    uint32_t v = incode_front_vertex(front, task);
    if (!incode_star_open(front, v))
        return INCODE_FINISHED;
    enum incode_step r = incode_maker_centre(&t->maker, task, v);
    while (r == INCODE_FINISHED && !incode_star_is_closed(front)) {
        if (incode_star_is_enough(front)) {
            r = INCODE_AGAIN;
            break;
        }
        uint64_t before = t->maker.counts.candidates;
        r = advance(t, task);
        spend_candidates(t, before);
        if (r == INCODE_FINISHED && incode_star_is_full(front))
            r = INCODE_AGAIN; /* the list will find it crowded */
        if (r == INCODE_FINISHED && t->maker.walker.left == 0)
            r = incode_maker_is_searching(&t->maker, task) ? INCODE_WORKED
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
static enum incode_step pursue_face(struct incode_triangulator *t,
                                    unsigned task) {
    struct incode_answer a;
    uint32_t f[3];
    if (!incode_maker_is_searching(&t->maker, task) &&
        !incode_front_face(&t->front, incode_front_vertex(&t->front, task), f))
        return INCODE_FINISHED;
    enum incode_step r = incode_maker_face(&t->maker, task, f, &a);
    if (r == INCODE_FINISHED)
        (void)incode_front_use(&t->front, a.f, corners_of(&a).p);
    return r;
}

static enum incode_step build_first(struct incode_triangulator *t,
                                    unsigned task) {
    struct incode_answer a;
    uint32_t v = incode_front_vertex(&t->front, task);
    /* Other stars go on while a seed waits for a page. */
    if (incode_front_is_reached(&t->front, v))
        return INCODE_FINISHED;
    enum incode_step r = incode_maker_first(&t->maker, task, v, &a);
    if (r == INCODE_FINISHED && t->maker.fault == NULL)
        incode_front_seed(&t->front, a.f, corners_of(&a).p);
    return r;
}

/* ---- steps ---- */

static enum incode_step run(struct incode_triangulator *t, unsigned task) {
    enum incode_step r;
    incode_front_run(&t->front, t->maker.walker.left);
    if (incode_front_is_seed(&t->front, task))
        r = build_first(t, task);
    else if (t->maker.index == INCODE_KD)
        r = close_star(t, task);
    else
        r = pursue_face(t, task);
    if (r != INCODE_WAITING && r != INCODE_WORKED) {
        incode_front_done(&t->front, task);
        return INCODE_WORKED;
    }
    incode_front_suspend(&t->front, task, r == INCODE_WAITING,
                         incode_maker_has_advanced(&t->maker, task));
    if (r == INCODE_WORKED)
        return INCODE_WORKED;
    /* Without credit for its page the task can only be tried again. */
    return incode_maker_waiting(&t->maker, UINT32_C(1) << task) != 0
               ? INCODE_WORKED
               : INCODE_WAITING;
}

static enum incode_turn next(struct incode_triangulator *t, uint32_t *task) {
    const struct incode_job *job = &t->job;
    uint32_t first, last;
    incode_front_own_left(&t->front, &first, &last);
    if (t->front.exchange.on)
        incode_maker_look_down(&t->maker, job->last, first - job->first,
                               job->last - job->first);
    else
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

static enum incode_step close_stars(struct incode_triangulator *t) {
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

static enum incode_step insert_points(struct incode_triangulator *t) {
    switch (incode_insertion_step(&t->insertion)) {
    case INCODE_FINISHED:
        t->phase = INCODE_PHASE_IDLE;
        return INCODE_FINISHED;
    case INCODE_FULL:
        if (incode_insertion_is_alone(&t->insertion)) {
            t->phase = INCODE_PHASE_IDLE;
            return INCODE_FULL;
        }
        /* And so it will be for the next job. */
        t->build = INCODE_BUILD_FACES;
        t->phase = INCODE_PHASE_CHOOSE;
        if (t->insertion.emitted) {
            incode_fallback_begin(&t->fallback, &t->insertion);
            t->front.job = t->job;
            t->phase = INCODE_PHASE_HANDOVER;
        }
        return INCODE_WORKED;
    case INCODE_WAITING:
        return INCODE_WAITING;
    case INCODE_WORKED:
    default:
        return INCODE_WORKED;
    }
}

/* What is open goes out, and comes back brick by brick. */
static enum incode_step hand_over(struct incode_triangulator *t) {
    enum incode_step r = incode_fallback_step(&t->fallback, &t->front);
    if (r != INCODE_FINISHED)
        return r == INCODE_WAITING ? INCODE_WAITING : INCODE_WORKED;
    if (!incode_arena_turn(t, false))
        return INCODE_WAITING;
    incode_front_take_over(&t->front, &t->job, t->committed);
    t->phase = INCODE_PHASE_FACES;
    return INCODE_WORKED;
}

static enum incode_step step(struct incode_triangulator *t) {
    enum incode_step r = INCODE_FINISHED;
    switch (t->phase) {
    case INCODE_PHASE_CHOOSE:
        return choose(t);
    case INCODE_PHASE_POINTS:
        return insert_points(t);
    case INCODE_PHASE_HANDOVER:
        return hand_over(t);
    case INCODE_PHASE_FACES:
        r = close_stars(t);
        if (r == INCODE_FINISHED)
            t->phase = INCODE_PHASE_IDLE;
        return r;
    case INCODE_PHASE_IDLE:
    default:
        return r;
    }
}

enum incode_step incode_triangulator_step(struct incode_triangulator *t) {
    if (incode_triangulator_fault(t) != NULL)
        return INCODE_BROKEN;
    if (t->phase == INCODE_PHASE_IDLE)
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

void incode_triangulator_allow(struct incode_triangulator *t, uint32_t units) {
    t->units = units > 0 ? units : 1;
}

uint64_t incode_triangulator_spent(const struct incode_triangulator *t) {
    return t->spent;
}

/* ---- reports ---- */

void incode_triangulator_statistics(const struct incode_triangulator *t,
                                    struct incode_statistics *s) {
    const struct incode_front *front = &t->front;
    const struct incode_maker *maker = &t->maker;
    const struct incode_insertion *insertion = &t->insertion;
    const struct incode_pager *pager = &maker->pager;
    *s = (struct incode_statistics){
        .tetrahedra_built =
            front->counts.built + insertion->kept + insertion->left,
        .tetrahedra_kept = front->counts.kept + insertion->kept,
        .tetrahedra_by_points = insertion->kept,
        .make_tetra_calls =
            maker->counts.calls + insertion->kept + insertion->left,
        .hull_facets = front->counts.hull_facets,
        .candidates = maker->counts.candidates,
        .tree_searches = maker->counts.tree_searches,
        .seeds = front->counts.seeds,
        .vertices = front->counts.vertices + insertion->vertices,
        .vertices_waited = front->counts.waited,
        .stars_lent = front->counts.lent,
        .tetrahedra_late = front->counts.late,
        .page_requests = pager->requests,
        .page_faults = front->counts.faults,
        .page_evictions = pager->evictions,
        .afl_max = front->afl.count_max,
        .afl_spilled = front->counts.spilled,
        .memory_high_water = incode_arena_high_water(t),
        .tally = {maker->counts.tally.exact_orient3d,
                  maker->counts.tally.exact_in_sphere}};
    memcpy(s->candidates_histogram, maker->counts.histogram,
           sizeof s->candidates_histogram);
}

void incode_triangulator_gauge(const struct incode_triangulator *t,
                               struct incode_gauge *gauge) {
    const struct incode_pager *pager = &t->maker.pager;
    const struct incode_afl *afl = &t->front.afl;
    gauge->pages = pager->frame_count;
    gauge->held = pager->frames_used;
    gauge->faces = t->by_points ? 0 : afl->capacity;
    gauge->open = t->by_points ? 0 : afl->count;
}

const struct incode_map *
incode_triangulator_map(const struct incode_triangulator *t) {
    return &t->map;
}

const char *incode_triangulator_fault(const struct incode_triangulator *t) {
    if (t->front.afl.fault != NULL)
        return t->front.afl.fault;
    return t->front.fault != NULL ? t->front.fault : t->maker.fault;
}
