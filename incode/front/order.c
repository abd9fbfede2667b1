#include "front.h"

#include "exchange.h"
#include "incode/predicates/check.h"

/* The order of work: own bricks in their order, in each the vertices with open
 * faces, then those that no tetrahedron has; last, what is open elsewhere.
 * What is spilled is brought back before it is needed. */

enum {
    FETCH_AHEAD = 32,  /* bricks */
    EMIT_ROOM_MIN = 8, /* tetrahedra */
    LEND_FACES = 32,   /* of a vertex, at a time */
    ALL_TASKS = (1 << INCODE_TASKS) - 1
};

/* ---- tasks ---- */

static uint64_t bit_of(uint32_t v) {
    return UINT64_C(1) << (v % INCODE_BRICK_POINTS);
}

enum incode_turn incode_front_begin(struct incode_front *front, uint32_t v,
                                    bool seed, uint32_t *which) {
    uint32_t idle = ~front->busy & ALL_TASKS;
    if (idle == 0)
        return INCODE_TURN_WAIT;
    *which = (uint32_t)__builtin_ctz(idle);
    front->task[*which] = (struct incode_task){.v = v, .seed = seed};
    return INCODE_TURN_TASK;
}

void incode_front_run(struct incode_front *front, uint32_t most) {
    front->built_max = front->spill_from < front->bricks ? INCODE_SPILL_BUILT
                                                         : INCODE_STAR_BUILT;
    size_t room = front->outside.emit_room(front->outside.context);
    if (front->exchange.on) {
        const struct incode_front_peers *peers = &front->exchange.peers;
        size_t shares = peers->room(peers->context);
        room = room < shares ? room : shares;
    }
    if (front->built_max > room)
        front->built_max = (uint32_t)room;
    most = most > 0 ? most : 1;
    if (front->built_max > most)
        front->built_max = most;
}

/* The brick of a task that has run; one that ran for the first time counts. */
static struct incode_touched *count_run(struct incode_front *front,
                                        struct incode_task *task) {
    front->counts.vertices += task->born == 0;
    task->retries++;
    return incode_afl_touch(&front->afl, task->v / INCODE_BRICK_POINTS);
}

void incode_front_suspend(struct incode_front *front, unsigned task, bool fault,
                          bool advanced) {
    struct incode_task *t = &front->task[task];
    t->retries = advanced ? 1 : t->retries;
    front->counts.waited += fault && t->born == 0;
    front->counts.faults += fault;
    count_run(front, t)->waiting |= bit_of(t->v);
    if (t->born == 0)
        t->born = ++front->clock;
    front->busy |= UINT32_C(1) << task;
}

void incode_front_done(struct incode_front *front, unsigned task) {
    struct incode_task *t = &front->task[task];
    struct incode_touched *entry = count_run(front, t);
    entry->waiting &= ~bit_of(t->v);
    front->busy &= ~(UINT32_C(1) << task);
    if (front->exchange.on && entry->pending != 0)
        incode_exchange_ready(front, t->v);
    if (!incode_own(front, t->v) && entry->faces == 0 && entry->waiting == 0)
        incode_afl_drop(&front->afl, entry->brick);
}

/* A task that may go on, the oldest first; INCODE_TURN_WAIT: one has been
 * suspended so often that nothing else may run before it. */
static enum incode_turn ready_task(const struct incode_front *front,
                                   uint32_t waiting, uint32_t *task) {
    const struct incode_task *oldest = NULL, *ready = NULL;
    for (uint32_t left = front->busy; left != 0; left &= left - 1) {
        unsigned i = (unsigned)__builtin_ctz(left);
        const struct incode_task *t = &front->task[i];
        if (oldest == NULL || t->born < oldest->born)
            oldest = t;
        if ((waiting >> i & 1) == 0 && (ready == NULL || t->born < ready->born))
            ready = t;
    }
    bool alone = oldest != NULL && oldest->retries > INCODE_PATIENCE;
    if (alone && ready != oldest)
        return INCODE_TURN_WAIT;
    if (ready == NULL)
        return INCODE_TURN_NEXT;
    *task = (unsigned)(ready - front->task);
    return INCODE_TURN_RESUME;
}

/* A task whose brick has been spilled meanwhile is void: its faces are gone
 * with it and come back with it. */
static void drop_spilled_tasks(struct incode_front *front) {
    for (uint32_t left = front->busy; left != 0; left &= left - 1) {
        unsigned i = (unsigned)__builtin_ctz(left);
        uint32_t brick = front->task[i].v / INCODE_BRICK_POINTS;
        if (incode_position(front, brick) >= front->spill_from)
            front->busy &= ~(UINT32_C(1) << i);
    }
}

enum incode_turn incode_front_turn(struct incode_front *front, uint32_t waiting,
                                   uint32_t *task) {
    if (front->finished)
        return INCODE_TURN_END;
    if (!incode_front_room(front)) {
        drop_spilled_tasks(front);
        return front->spill_cursor != INCODE_NONE ? INCODE_TURN_WORKED
                                                  : INCODE_TURN_WAIT;
    }
    const struct incode_front_peers *peers = &front->exchange.peers;
    if (front->outside.emit_room(front->outside.context) < EMIT_ROOM_MIN ||
        (front->exchange.on && peers->room(peers->context) < EMIT_ROOM_MIN))
        return INCODE_TURN_WAIT;
    if (incode_front_drain(front))
        return INCODE_TURN_WORKED;
    return ready_task(front, waiting, task);
}

/* ---- the next vertex ---- */

/* Asks for the nearest spilled brick.  From then on its toggles stay in memory
 * and add to those that return; it is not worked on before all are there. */
static void fetch_spilled(struct incode_front *front) {
    if (front->unspill_pending || !incode_front_flush(front))
        return;
    uint32_t brick = incode_brick_at(front, front->spill_from);
    if (!front->outside.unspill(front->outside.context, brick))
        return;
    front->unspill_brick = brick;
    front->unspill_pending = true;
    front->spill_from++;
}

bool incode_front_fetch(struct incode_front *front) {
    if (front->spill_from == front->bricks ||
        front->spill_cursor != INCODE_NONE || !incode_front_has_room(front))
        return false;
    fetch_spilled(front);
    return true;
}

/* Brings spilled bricks back before they are needed while there is room. */
static void fetch_ahead(struct incode_front *front) {
    if (front->spill_from < front->bricks &&
        front->spill_cursor == INCODE_NONE &&
        front->spill_from - front->current < FETCH_AHEAD &&
        front->afl.count < front->afl.capacity / 2 &&
        front->afl.touched_count < front->afl.touched_capacity / 2)
        fetch_spilled(front);
}

static bool is_returning(const struct incode_front *front, uint32_t brick) {
    return front->unspill_pending && front->unspill_brick == brick;
}

/* The next own brick of the window with open faces; NULL: there is none. */
static struct incode_touched *next_own(struct incode_front *front) {
    uint32_t own = front->job.last - front->job.first;
    for (uint32_t i = 0; i < front->window; i++) {
        uint32_t position = front->current + i;
        if (position >= own || position >= front->spill_from ||
            is_returning(front, front->job.first + position))
            return NULL;
        struct incode_touched *entry =
            incode_afl_find(&front->afl, front->job.first + position);
        if (entry != NULL && (entry->pending & ~entry->waiting) != 0)
            return entry;
    }
    return NULL;
}

/* The next brick with open faces anywhere, the lowest position first, so that
 * what is left lies ahead and can be spilled.  Bricks without faces are
 * forgotten on the way. */
static struct incode_touched *next_foreign(struct incode_front *front) {
    struct incode_touched *best = NULL;
    uint32_t least = 0;
    for (uint32_t i = 0; i < front->afl.touched_max; i++) {
        struct incode_touched *entry = &front->afl.touched[i];
        incode_afl_breathe_at(&front->afl, i);
        if (!incode_touched_used(entry) || is_returning(front, entry->brick))
            continue;
        if (entry->faces == 0 && entry->waiting == 0)
            incode_afl_drop(&front->afl, entry->brick);
        else if ((entry->pending & ~entry->waiting) != 0 &&
                 (best == NULL ||
                  incode_position(front, entry->brick) < least)) {
            best = entry;
            least = incode_position(front, entry->brick);
        }
    }
    if (best != NULL)
        front->current = least;
    return best;
}

/* The first vertex of a brick that may have open faces. */
static uint32_t first_pending(const struct incode_touched *entry) {
    return entry->brick * INCODE_BRICK_POINTS +
           (uint32_t)__builtin_ctzll(entry->pending & ~entry->waiting);
}

/* Everything is closed: the hubs' bricks are complete, too. */
static enum incode_turn finish(struct incode_front *front) {
    while (front->hub_count > 0) {
        uint32_t brick = front->hubs[--front->hub_count] / INCODE_BRICK_POINTS;
        if (incode_own_brick(front, brick) &&
            !incode_front_has_hub(front, brick))
            front->outside.commit(front->outside.context, brick);
    }
    for (uint32_t i = 0; i < front->afl.touched_max; i++) {
        incode_afl_breathe_at(&front->afl, i);
        if (incode_touched_used(&front->afl.touched[i]))
            incode_afl_drop(&front->afl, front->afl.touched[i].brick);
    }
    front->finished = front->afl.fault == NULL;
    return INCODE_TURN_END;
}

/* Passes the current brick if it has been committed before: nothing of it is
 * open, so nothing of it is spilled. */
static bool skip_passed(struct incode_front *front) {
    uint32_t brick = front->job.first + front->current;
    if (front->passed == NULL || brick >= front->job.last ||
        is_returning(front, brick) ||
        (front->passed[brick / 64] >> brick % 64 & 1) == 0)
        return false;
    if (front->spill_from == front->current)
        front->spill_from++;
    front->current++;
    return true;
}

enum incode_turn incode_front_next(struct incode_front *front,
                                   uint32_t *which) {
    uint32_t own = front->job.last - front->job.first;
    const struct incode_touched *entry;
    if (front->exchange.on)
        return incode_exchange_next(front, which);
    if (skip_passed(front))
        return INCODE_TURN_WORKED;
    fetch_ahead(front);
    if (front->current >= own && !front->foreign)
        front->foreign = true;
    if (!front->foreign) {
        if (front->current >= front->spill_from)
            fetch_spilled(front);
        if (front->current >= front->spill_from ||
            is_returning(front, front->job.first + front->current))
            return INCODE_TURN_WAIT;
        entry = next_own(front);
        if (entry != NULL)
            return incode_front_begin(front, first_pending(entry), false,
                                      which);
        *which = front->job.first + front->current;
        return INCODE_TURN_COUNT;
    }
    entry = front->afl.count > 0 ? next_foreign(front) : NULL;
    if (entry != NULL)
        return incode_front_begin(front, first_pending(entry), false, which);
    if (front->busy != 0 || front->unspill_pending || front->afl.held_count > 0)
        return INCODE_TURN_WAIT;
    if (front->afl.count > 0) {
        front->fault = "faces are left whose vertices are none";
        return INCODE_TURN_WAIT;
    }
    if (!front->spilled_any)
        return finish(front);
    fetch_spilled(front);
    return INCODE_TURN_WAIT;
}

uint32_t incode_front_lend(struct incode_front *front, uint32_t (*faces)[3],
                           uint32_t most) {
    uint32_t count = 0;
    bool moving =
        front->spill_cursor != INCODE_NONE || front->draining != INCODE_NONE;
    while (!front->finished && !moving && count < most) {
        const struct incode_touched *entry =
            front->foreign ? next_foreign(front) : next_own(front);
        if (entry == NULL)
            break;
        while ((entry->pending & ~entry->waiting) != 0 && count < most) {
            uint32_t v = first_pending(entry), pairs[LEND_FACES][2];
            uint32_t limit =
                most - count < LEND_FACES ? most - count : (uint32_t)LEND_FACES;
            uint32_t n = incode_afl_hold(&front->afl, v, pairs, limit);
            for (uint32_t i = 0; i < n; i++, count++) {
                faces[count][0] = v;
                faces[count][1] = pairs[i][0];
                faces[count][2] = pairs[i][1];
            }
        }
    }
    return count;
}

/* Passes the current brick: all its lists are empty and all its vertices
 * reached, so none of its stars will open again but those of hubs. */
static enum incode_turn pass_brick(struct incode_front *front) {
    uint32_t brick = front->job.first + front->current;
    if (!incode_front_has_hub(front, brick)) {
        front->outside.commit(front->outside.context, brick);
        incode_afl_drop(&front->afl, brick);
    }
    front->current++;
    return INCODE_TURN_WORKED;
}

enum incode_turn incode_front_count(struct incode_front *front, uint32_t count,
                                    uint32_t *which) {
    INCODE_ASSERT(count >= 1 && count <= INCODE_BRICK_POINTS);
    if (front->exchange.on)
        return incode_exchange_count(front, count);
    uint32_t brick = front->job.first + front->current;
    const struct incode_touched *entry = incode_afl_find(&front->afl, brick);
    uint64_t all = ~UINT64_C(0) >> (INCODE_BRICK_POINTS - count);
    uint64_t reached = entry == NULL ? 0 : entry->reached;
    if (entry != NULL && (entry->faces > 0 || entry->waiting != 0))
        return INCODE_TURN_WAIT;
    if ((all & ~reached) == 0)
        return pass_brick(front);
    uint32_t slot = (uint32_t)__builtin_ctzll(all & ~reached);
    return incode_front_begin(front, brick * INCODE_BRICK_POINTS + slot, true,
                              which);
}
