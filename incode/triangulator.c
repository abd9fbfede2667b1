#include "triangulator.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "state.h"

/* ---- memory ---- */

enum {
    COPIES_MIN = 16,
    FRAMES_MIN = 48,
    FACES_MIN = 4096,
    BRICKS_MIN = 512,
    FRAMES_MAX = INCODE_NO_FRAME - 1,
    FETCH_AHEAD = 32,  /* bricks */
    LOOKAHEAD_MAX = 48 /* bricks */
};

static size_t round_up(size_t bytes)
{
    return (bytes + 63) & ~(size_t)63;
}

/* Copies of points in single precision, near a vertex: one for 32 KB. */
static uint32_t copies_of(size_t bytes)
{
    size_t copies = bytes >> 15;
    return copies < COPIES_MIN                 ? COPIES_MIN
           : copies > INCODE_NEIGHBOURS_COPIES ? INCODE_NEIGHBOURS_COPIES
                                               : (uint32_t)copies;
}

static size_t control_bytes(size_t bytes)
{
    struct incode_neighbours *v = NULL;
    return round_up(sizeof(struct incode_triangulator)) +
           copies_of(bytes) * sizeof *v->point;
}

/* The active face list takes three eighths of what the control block leaves
 * (the front of a region of 1,250,000 points, with a tenth to spare), the
 * bricks a sixteenth, page frames the rest. */
static bool fill_map(struct incode_map *map, size_t bytes)
{
    memset(map, 0, sizeof *map);
    map->control = control_bytes(bytes);
    map->local_points = sizeof(struct incode_local_points);
    map->tasks = sizeof(struct incode_task) * INCODE_TASKS;
    if (bytes < map->control)
        return false;
    size_t rest = bytes - map->control;
    size_t face = sizeof(struct incode_afl_node) + sizeof(uint32_t);
    size_t brick = sizeof(struct incode_touched) + sizeof(uint32_t);
    map->afl_faces = rest * 3 / 8 / face;
    map->brick_entries = rest / 16 / brick;
    if (map->afl_faces < FACES_MIN)
        map->afl_faces = FACES_MIN;
    if (map->brick_entries < BRICKS_MIN)
        map->brick_entries = BRICKS_MIN;
    size_t both = incode_afl_bytes((uint32_t)map->afl_faces,
                                   (uint32_t)map->brick_entries);
    map->bricks = map->brick_entries * brick;
    map->afl = both - map->bricks;
    size_t used = map->control + round_up(both);
    if (bytes < used)
        return false;
    size_t frames = (bytes - used) / sizeof(struct incode_frame);
    frames = frames > FRAMES_MAX ? FRAMES_MAX : frames;
    while (frames > 0 && incode_pager_bytes((uint32_t)frames) > bytes - used)
        frames--;
    map->frame_count = frames;
    map->frames = incode_pager_bytes((uint32_t)frames);
    map->total = used + map->frames;
    return frames >= FRAMES_MIN;
}

size_t incode_arena_min(const struct incode_setup *setup)
{
    (void)setup;
    size_t bytes = sizeof(struct incode_triangulator);
    struct incode_map map;
    while (!fill_map(&map, bytes))
        bytes += 1024;
    return bytes;
}

struct incode_triangulator *
incode_triangulator_init(void *arena, size_t bytes,
                         const struct incode_setup *setup,
                         const struct incode_outside *outside, const char **why)
{
    struct incode_map map;
    if (!fill_map(&map, bytes)) {
        *why = "the node's memory is too small for this index";
        return NULL;
    }
    if (setup->bricks == 0) {
        *why = "there are no points";
        return NULL;
    }
    struct incode_triangulator *t = arena;
    memset(t, 0, sizeof *t);
    t->setup = *setup;
    t->outside = *outside;
    t->map = map;
    uint8_t *memory = (uint8_t *)arena + map.control;
    incode_afl_init(&t->afl, memory, (uint32_t)map.afl_faces,
                    (uint32_t)map.brick_entries);
    memory += round_up(map.afl + map.bricks);
    incode_pager_init(&t->pager, memory, (uint32_t)map.frame_count,
                      setup->bricks);
    t->pager.request = outside->request;
    t->pager.context = outside->context;
    t->pager.shuffle = setup->shuffle_seed;
    uint32_t cells = setup->index == INCODE_GRID
                         ? setup->cells[0] * setup->cells[1] * setup->cells[2]
                         : 0;
    incode_tree_init(&t->tree, setup->bricks, cells);
    t->walker = (struct incode_walker){&t->pager, &t->tree, &t->stats.tally,
                                       &t->stats.candidates};
    t->local.pages_max = (uint32_t)map.frame_count / 2;
    incode_local_reset(&t->local);
    t->neighbours.centre = INCODE_NONE;
    t->neighbours.point = (void *)((uint8_t *)arena + round_up(sizeof *t));
    t->neighbours.room = copies_of(bytes);
    t->spread = 1.6;
    t->reach = 2;
    t->window = 4;
    t->lookahead = (uint32_t)map.frame_count / 24;
    t->lookahead = t->lookahead < 1               ? 1
                   : t->lookahead > LOOKAHEAD_MAX ? LOOKAHEAD_MAX
                                                  : t->lookahead;
    if (t->tree.pages <= map.frame_count)
        t->lookahead = setup->bricks; /* none pushes another out */
    t->room_faces = 2 * INCODE_STAR_FACES + 4 * INCODE_STAR_BUILT;
    t->room_bricks = (uint32_t)map.brick_entries / 4;
    t->finished = true;
    return t;
}

void incode_triangulator_start(struct incode_triangulator *t,
                               const struct incode_job *job)
{
    INCODE_ASSERT(job->first <= job->last && job->last <= t->setup.bricks);
    t->job = *job;
    incode_afl_clear(&t->afl);
    t->current = t->ahead = 0;
    t->spill_from = t->setup.bricks;
    t->spill_cursor = INCODE_NONE;
    t->spill_count = 0;
    t->spilled_any = t->unspill_pending = false;
    t->foreign = t->finished = false;
    t->hub_count = 0;
    t->draining = INCODE_NONE;
    memset(t->tasks, 0, sizeof t->tasks);
    t->fault = NULL;
}

int incode_triangulator_page(struct incode_triangulator *t, uint32_t page,
                             const void *data, size_t bytes)
{
    return incode_pager_deliver(&t->pager, page, data, bytes);
}

int incode_triangulator_unspill(struct incode_triangulator *t, uint32_t brick,
                                const struct incode_face *faces, size_t count,
                                bool last)
{
    if (!t->unspill_pending || brick != t->unspill_brick)
        return -1;
    struct incode_touched *entry = NULL;
    for (size_t i = 0; i < count; i++) {
        const uint32_t *f = faces[i].v;
        if (f[0] / INCODE_BRICK_POINTS != brick)
            return -1;
        if (t->afl.count + 1 >= t->afl.capacity ||
            t->afl.touched_count + 1 >= t->afl.touched_capacity) {
            t->fault = "the active face list of one brick does not fit; give "
                       "the nodes more memory";
            return 0;
        }
        if (f[1] != INCODE_NONE) {
            incode_afl_toggle(&t->afl, f[0], f[1], f[2]);
            continue;
        }
        entry = incode_afl_touch(&t->afl, brick);
        entry->reached |= UINT64_C(1) << (f[0] % INCODE_BRICK_POINTS);
    }
    if (last) {
        t->unspill_pending = false;
        if (t->spill_from == t->setup.bricks)
            t->spilled_any = false;
    }
    return 0;
}

/* ---- tasks ---- */

static uint64_t bit_of(uint32_t v)
{
    return UINT64_C(1) << (v % INCODE_BRICK_POINTS);
}

static enum incode_step run(struct incode_triangulator *t,
                            struct incode_task *task, bool seed)
{
    uint32_t v = task->v;
    bool fresh = task->retries == 0;
    t->built_max = t->spill_from < t->setup.bricks ? INCODE_SPILL_BUILT
                                                   : INCODE_STAR_BUILT;
    size_t room = t->outside.emit_room(t->outside.context);
    if (t->built_max > room)
        t->built_max = (uint32_t)room;
    enum incode_outcome r;
    if (seed || task->kind == INCODE_TASK_SEED)
        r = incode_seed_run(t, task);
    else if (t->setup.index == INCODE_KD)
        r = incode_star_close(t, task);
    else
        r = incode_face_pursue(t, task);
    t->stats.vertices += fresh;
    task->retries++;
    struct incode_touched *entry =
        incode_afl_touch(&t->afl, v / INCODE_BRICK_POINTS);
    if (r == INCODE_WAIT || r == INCODE_MORE) {
        entry->waiting |= bit_of(v);
        if (task->born == 0)
            task->born = ++t->clock;
        if (r == INCODE_MORE) {
            task->page = INCODE_NONE;
            return INCODE_WORKED;
        }
        t->stats.vertices_waited += fresh;
        t->stats.page_faults++;
        /* Without credit for its page the task can only be tried again. */
        return incode_pager_loading(&t->pager, task->page) ? INCODE_WORKED
                                                           : INCODE_WAITING;
    }
    entry->waiting &= ~bit_of(v);
    if (r == INCODE_OK)
        INCODE_ASSERT(task->kind == INCODE_TASK_IDLE || t->fault != NULL);
    task->kind = INCODE_TASK_IDLE;
    task->born = 0;
    if (!incode_own(t, v) && entry->faces == 0 && entry->waiting == 0)
        incode_afl_drop(&t->afl, entry->brick);
    return INCODE_WORKED;
}

static struct incode_task *idle_task(struct incode_triangulator *t)
{
    for (int i = 0; i < INCODE_TASKS; i++)
        if (t->tasks[i].kind == INCODE_TASK_IDLE)
            return &t->tasks[i];
    return NULL;
}

/* A task whose page has come, the oldest first; *alone: one has waited so
 * often that nothing else may run before it. */
static struct incode_task *ready_task(struct incode_triangulator *t,
                                      bool *alone)
{
    struct incode_task *oldest = NULL, *ready = NULL;
    for (int i = 0; i < INCODE_TASKS; i++) {
        struct incode_task *task = &t->tasks[i];
        if (task->kind == INCODE_TASK_IDLE)
            continue;
        if (oldest == NULL || task->born < oldest->born)
            oldest = task;
        if (!incode_pager_loading(&t->pager, task->page) &&
            (ready == NULL || task->born < ready->born))
            ready = task;
    }
    *alone = oldest != NULL && oldest->retries > INCODE_PATIENCE;
    if (*alone && ready != oldest)
        return NULL;
    return ready;
}

static enum incode_step run_new(struct incode_triangulator *t, uint32_t v,
                                bool seed)
{
    struct incode_task *task = idle_task(t);
    if (task == NULL)
        return INCODE_WAITING;
    task->v = v;
    task->retries = 0;
    task->born = 0;
    task->kind = INCODE_TASK_STAR;
    return run(t, task, seed);
}

/* A task whose brick has been spilled meanwhile is void: its faces are gone
 * with it and come back with it. */
static void drop_spilled_tasks(struct incode_triangulator *t)
{
    for (int i = 0; i < INCODE_TASKS; i++) {
        struct incode_task *task = &t->tasks[i];
        if (task->kind != INCODE_TASK_IDLE &&
            incode_position(t, task->v / INCODE_BRICK_POINTS) >= t->spill_from)
            task->kind = INCODE_TASK_IDLE;
    }
}

/* ---- order of work ---- */

/* Asks for the nearest spilled brick.  From then on its toggles stay in memory
 * and add to those that return; it is not worked on before all are there. */
static void fetch_spilled(struct incode_triangulator *t)
{
    if (t->unspill_pending || !incode_front_flush(t))
        return;
    uint32_t brick = (t->job.first + t->spill_from) % t->setup.bricks;
    if (!t->outside.unspill(t->outside.context, brick))
        return;
    t->unspill_brick = brick;
    t->unspill_pending = true;
    t->spill_from++;
}

/* Brings spilled bricks back before they are needed while there is room. */
static void fetch_ahead(struct incode_triangulator *t)
{
    if (t->spill_from < t->setup.bricks && t->spill_cursor == INCODE_NONE &&
        t->spill_from - t->current < FETCH_AHEAD &&
        t->afl.count < t->afl.capacity / 2 &&
        t->afl.touched_count < t->afl.touched_capacity / 2)
        fetch_spilled(t);
}

/* Asks for the pages of bricks that will be worked on next, and of what lies
 * around them. */
static bool count_brick(struct incode_walker *walker, struct incode_query *q,
                        const struct incode_frame *frame, uint32_t brick,
                        uint32_t leaves, void *context)
{
    uint32_t *left = context;
    (void)walker, (void)q, (void)frame, (void)brick, (void)leaves;
    return --*left > 0;
}

static void look_ahead(struct incode_triangulator *t)
{
    uint32_t own = t->job.last - t->job.first;
    if (t->ahead < t->current)
        t->ahead = t->current;
    if (t->ahead >= own || t->ahead >= t->current + t->lookahead)
        return;
    uint32_t brick = t->job.first + t->ahead;
    const struct incode_frame *f = incode_pager_get(&t->pager, brick);
    if (f == NULL) {
        for (uint32_t i = 1; i < t->lookahead && t->ahead + i < own; i++)
            if (incode_pager_get(&t->pager, brick + i) == NULL &&
                !incode_pager_loading(&t->pager, brick + i))
                break; /* no more can be asked for at present */
        return;
    }
    struct incode_query q;
    memset(&q, 0, sizeof q);
    q.question = INCODE_QUERY_BOX;
    q.boxed = q.ahead = true;
    uint32_t leaves = (f->count + INCODE_LEAF_POINTS - 1U) / INCODE_LEAF_POINTS;
    double extent = 0;
    for (int d = 0; d < 3; d++) {
        q.lo[d] = q.hi[d] = f->leaf_lo[d][0];
        for (uint32_t leaf = 0; leaf < leaves; leaf++) {
            double lo = f->leaf_lo[d][leaf], hi = f->leaf_hi[d][leaf];
            extent = hi - lo > extent ? hi - lo : extent;
            q.lo[d] = lo < q.lo[d] ? lo : q.lo[d];
            q.hi[d] = hi > q.hi[d] ? hi : q.hi[d];
        }
    }
    for (int d = 0; d < 3; d++) {
        q.lo[d] -= extent * t->spread;
        q.hi[d] += extent * t->spread;
    }
    /* No more than a share of the frames: it would push out what is at work. */
    uint32_t left = (uint32_t)t->map.frame_count / 8;
    if (incode_walk(&t->walker, &q, count_brick, &left) != INCODE_WALK_WAIT)
        t->ahead++;
}

/* Passes the current brick: all its lists are empty and all its vertices
 * reached, so none of its stars will open again but those of hubs. */
static enum incode_step pass_brick(struct incode_triangulator *t)
{
    uint32_t brick = t->job.first + t->current;
    if (!incode_front_has_hub(t, brick)) {
        t->outside.commit(t->outside.context, brick);
        incode_afl_drop(&t->afl, brick);
    }
    t->current++;
    return INCODE_WORKED;
}

static enum incode_step work_on_current(struct incode_triangulator *t)
{
    uint32_t brick = t->job.first + t->current;
    const struct incode_frame *f = incode_pager_get(&t->pager, brick);
    if (f == NULL)
        return INCODE_WAITING;
    const struct incode_touched *entry = incode_afl_find(&t->afl, brick);
    uint64_t all = f->count == INCODE_BRICK_POINTS
                       ? ~UINT64_C(0)
                       : (UINT64_C(1) << f->count) - 1;
    uint64_t reached = entry == NULL ? 0 : entry->reached;
    if (entry != NULL && (entry->faces > 0 || entry->waiting != 0))
        return INCODE_WAITING;
    if ((all & ~reached) == 0)
        return pass_brick(t);
    uint32_t slot = (uint32_t)__builtin_ctzll(all & ~reached);
    return run_new(t, brick * INCODE_BRICK_POINTS + slot, true);
}

static bool is_returning(const struct incode_triangulator *t, uint32_t brick)
{
    return t->unspill_pending && t->unspill_brick == brick;
}

/* The next vertex with open faces in the window of own bricks. */
static bool next_own(struct incode_triangulator *t, uint32_t *v)
{
    uint32_t own = t->job.last - t->job.first;
    for (uint32_t i = 0; i < t->window; i++) {
        uint32_t position = t->current + i;
        if (position >= own || position >= t->spill_from ||
            is_returning(t, t->job.first + position))
            return false;
        struct incode_touched *entry =
            incode_afl_find(&t->afl, t->job.first + position);
        if (entry == NULL)
            continue;
        uint64_t ready = entry->pending & ~entry->waiting;
        if (ready == 0)
            continue;
        *v = entry->brick * INCODE_BRICK_POINTS +
             (uint32_t)__builtin_ctzll(ready);
        return true;
    }
    return false;
}

/* The next vertex with open faces anywhere, the lowest position first, so that
 * what is left lies ahead and can be spilled.  Bricks without faces are
 * forgotten on the way. */
static bool next_foreign(struct incode_triangulator *t, uint32_t *v)
{
    const struct incode_touched *best = NULL;
    uint32_t least = 0;
    for (uint32_t i = 0; i < t->afl.touched_max; i++) {
        const struct incode_touched *entry = &t->afl.touched[i];
        if (!incode_touched_used(entry) || is_returning(t, entry->brick))
            continue;
        if (entry->faces == 0 && entry->waiting == 0)
            incode_afl_drop(&t->afl, entry->brick);
        else if ((entry->pending & ~entry->waiting) != 0 &&
                 (best == NULL || incode_position(t, entry->brick) < least)) {
            best = entry;
            least = incode_position(t, entry->brick);
        }
    }
    if (best == NULL)
        return false;
    t->current = least;
    *v = best->brick * INCODE_BRICK_POINTS +
         (uint32_t)__builtin_ctzll(best->pending & ~best->waiting);
    return true;
}

/* Everything is closed: the hubs' bricks are complete, too. */
static enum incode_step finish(struct incode_triangulator *t)
{
    while (t->hub_count > 0) {
        uint32_t brick = t->hubs[--t->hub_count] / INCODE_BRICK_POINTS;
        if (incode_own_brick(t, brick) && !incode_front_has_hub(t, brick))
            t->outside.commit(t->outside.context, brick);
    }
    for (uint32_t i = 0; i < t->afl.touched_max; i++)
        if (incode_touched_used(&t->afl.touched[i]))
            incode_afl_drop(&t->afl, t->afl.touched[i].brick);
    INCODE_ASSERT(t->afl.count == 0 && t->afl.touched_count == 0);
    t->finished = true;
    return INCODE_FINISHED;
}

static enum incode_step work(struct incode_triangulator *t, bool waiting)
{
    uint32_t own = t->job.last - t->job.first, v;
    if (t->current >= own && !t->foreign)
        t->foreign = true;
    if (!t->foreign) {
        if (t->current >= t->spill_from)
            fetch_spilled(t);
        if (is_returning(t, t->job.first + t->current))
            return INCODE_WAITING;
        if (next_own(t, &v))
            return run_new(t, v, false);
        return work_on_current(t);
    }
    if (t->afl.count > 0 && next_foreign(t, &v))
        return run_new(t, v, false);
    if (waiting || t->unspill_pending)
        return INCODE_WAITING;
    INCODE_ASSERT(t->afl.count == 0);
    if (!t->spilled_any)
        return finish(t);
    fetch_spilled(t);
    return INCODE_WAITING;
}

enum { EMIT_ROOM_MIN = 8 }; /* tetrahedra */

static bool any_task(const struct incode_triangulator *t)
{
    for (int i = 0; i < INCODE_TASKS; i++)
        if (t->tasks[i].kind != INCODE_TASK_IDLE)
            return true;
    return false;
}

static enum incode_step step(struct incode_triangulator *t)
{
    bool alone;
    if (!incode_front_room(t)) {
        drop_spilled_tasks(t);
        return t->spill_cursor != INCODE_NONE ? INCODE_WORKED : INCODE_WAITING;
    }
    if (t->outside.emit_room(t->outside.context) < EMIT_ROOM_MIN)
        return INCODE_WAITING;
    if (incode_front_drain(t))
        return INCODE_WORKED;
    struct incode_task *task = ready_task(t, &alone);
    if (task != NULL)
        return run(t, task, false);
    if (alone)
        return INCODE_WAITING;
    look_ahead(t);
    fetch_ahead(t);
    return work(t, any_task(t));
}

enum incode_step incode_triangulator_step(struct incode_triangulator *t)
{
    if (t->fault != NULL)
        return INCODE_BROKEN;
    if (t->finished)
        return INCODE_FINISHED;
    bool released = incode_pager_release(&t->pager, false);
    enum incode_step r = step(t);
    if (t->fault != NULL)
        return INCODE_BROKEN;
    if (r == INCODE_WAITING &&
        (released || incode_pager_release(&t->pager, true)))
        return INCODE_WORKED;
    return r;
}

/* ---- reports ---- */

const struct incode_statistics *
incode_triangulator_statistics(const struct incode_triangulator *t)
{
    struct incode_statistics *s = (struct incode_statistics *)&t->stats;
    s->page_requests = t->pager.requests;
    s->page_evictions = t->pager.evictions;
    s->afl_max = t->afl.count_max;
    s->memory_high_water =
        t->map.total - (t->map.frame_count - t->pager.frames_used) *
                           sizeof(struct incode_frame);
    return s;
}

const struct incode_map *
incode_triangulator_map(const struct incode_triangulator *t)
{
    return &t->map;
}

const char *incode_triangulator_fault(const struct incode_triangulator *t)
{
    return t->fault;
}
