#include <string.h>

#include "front.h"
#include "exchange.h"
#include "incode/predicates/check.h"
#include "incode/predicates/simd.h"

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
        incode_afl_yield_at(&front->afl, i);
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
        incode_afl_yield_at(&front->afl, i);
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

/* --- star ----------------------------------------------------------------- */

/* Closing the star of a vertex: its open faces are taken out of the active face
 * list, each gets its tetrahedron, and the new faces toggle, those at the
 * vertex at hand, the others in the list.  What is left when an answer is
 * missing goes back, the face asked about too: its tetrahedron may be built
 * from another side meanwhile. */

static const uint16_t NO_HINTS[4] = {INCODE_HINT_NONE, INCODE_HINT_NONE,
                                     INCODE_HINT_NONE, INCODE_HINT_NONE};

static void put_back(struct incode_front *front) {
    struct incode_star *star = &front->star;
    for (uint32_t i = 0; i < star->faces; i++) {
        const uint32_t f[3] = {star->v, star->b[i], star->c[i]};
        if (front->exchange.on)
            incode_exchange_toggle(front, f, INCODE_FACE_OPEN);
        else
            incode_afl_toggle(&front->afl, f[0], f[1], f[2]);
    }
    star->faces = 0;
}

static inline void push_face(struct incode_star *star, uint32_t b, uint32_t c,
                             uint16_t ib, uint16_t ic) {
    INCODE_ASSERT(star->faces < INCODE_STAR_FACES);
    uint32_t i = star->faces++;
    star->b[i] = b;
    star->c[i] = c;
    star->ib[i] = ib;
    star->ic[i] = ic;
}

static bool remove_face(struct incode_star *star, uint32_t b, uint32_t c) {
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

static void toggle_here(struct incode_front *front, uint32_t b, uint32_t c,
                        uint16_t ib, uint16_t ic) {
    struct incode_star *star = &front->star;
    if (remove_face(star, c, b))
        return;
    if (star->more && incode_afl_close_twin(&front->afl, star->v, b, c))
        return;
    push_face(star, b, c, ib, ic);
}

/* Toggles what has waited, when the lists of the last ones are there, too. */
static void toggle_later(struct incode_front *front) {
    enum { ROUNDS = 3 };
    struct incode_star *star = &front->star;
    for (unsigned i = 0; i < ROUNDS && star->links > 0; i++)
        star->links = incode_afl_fetch(&front->afl, star->link, star->links);
    for (uint32_t i = 0; i < star->later_count; i++)
        incode_front_toggle(front, star->later[i], false);
    star->later_count = star->links = 0;
}

/* A face toggles in another vertex's list: where nobody else looks there before
 * the star is shut, it waits until then, and its list comes meanwhile. */
static void toggle_there(struct incode_front *front, const uint32_t f[3],
                         bool held) {
    struct incode_star *star = &front->star;
    if (held) {
        incode_front_toggle(front, f, true);
        return;
    }
    memcpy(star->later[star->later_count++], f, sizeof star->later[0]);
    star->links = incode_afl_fetch(&front->afl, star->link, star->links);
    const uint32_t *link = incode_afl_list(&front->afl, f[0], f[1], f[2]);
    __builtin_prefetch(link, 1);
    star->link[star->links++] = link;
    if (star->later_count == INCODE_STAR_LATER)
        toggle_later(front);
}

/* A tetrahedron is inside where all its vertices are own and none is a hub. */
static void toggle_face(struct incode_front *front, const uint32_t v[3],
                        const double *const p[3], const uint16_t hint[3],
                        bool inside, bool near) {
    unsigned turn;
    if (inside)
        turn = incode_front_first(front, v);
    else if (!incode_front_key(front, v, p, &turn))
        return;
    const uint32_t f[3] = {v[turn], v[(turn + 1) % 3], v[(turn + 2) % 3]};
    bool held = near && incode_exchange_is_outward(front, p);
    if (f[0] != front->star.v ||
        (!inside && incode_exchange_is_foreign(front, f, 3))) {
        toggle_there(front, f, held);
        return;
    }
    if (held) {
        if (!remove_face(&front->star, f[2], f[1])) {
            incode_front_toggle(front, f, true);
            front->star.more = true;
        }
        return;
    }
    toggle_here(front, f[1], f[2], hint[(turn + 1) % 3], hint[(turn + 2) % 3]);
}

static bool all_own(const struct incode_front *front, const uint32_t v[4]) {
    return incode_own(front, v[0]) && incode_own(front, v[1]) &&
           incode_own(front, v[2]) && incode_own(front, v[3]);
}

/* Emits the tetrahedron v of positive orientation if it is the region's own,
 * and toggles its faces; `through`: the face (v[0], v[1], v[2]) was open and is
 * taken out already. */
static void build(struct incode_front *front, const uint32_t v[4],
                  const double *const p[4], const uint16_t hint[4],
                  bool through) {
    struct incode_star *star = &front->star;
    bool all = all_own(front, v);
    star->built++;
    front->counts.built++;
    /* The region of its owner keeps it. */
    if (all || incode_own(front, v[incode_owner(front->owner_rule, v, p)])) {
        memcpy(star->apexes[star->kept++], v + 1, 3 * sizeof *v);
        front->counts.kept++;
        INCODE_ASSERT(star->kept <= INCODE_STAR_BUILT);
    }
    incode_front_reached(front, v[3]);
    bool near = false;
    if (front->exchange.on) {
        near = p[0] != NULL && incode_exchange_is_near(front, p);
        incode_exchange_share(front, v, !all);
    }
    bool inside = all && front->hub_count == 0;
    /* Faces with their unknown side outward: of (v, b, c, a) these are
     * (v, c, b) behind, (v, a, c), (v, b, a) and (b, c, a). */
    static const uint8_t face[4][3] = {
        {0, 3, 2}, {0, 1, 3}, {1, 2, 3}, {0, 2, 1}};
    for (int k = 0; k < (through ? 3 : 4); k++) {
        const uint8_t *j = face[k];
        const uint32_t f[3] = {v[j[0]], v[j[1]], v[j[2]]};
        const double *const q[3] = {p[j[0]], p[j[1]], p[j[2]]};
        const uint16_t i[3] = {hint[j[0]], hint[j[1]], hint[j[2]]};
        toggle_face(front, f, q, i, inside, near);
    }
}

/* A fault that the simulation has to find: a face that is its owner's to pursue
 * is pursued here as well. */
static bool is_planted(const struct incode_front *front) {
#ifdef INCODE_PLANT_KEPT
    return front->counts.built % 16 == 0;
#else
    (void)front;
    return false;
#endif
}

/* The face (v[0], v[1], v[2]) is of the hull. */
static void find_hull(struct incode_front *front, const uint32_t v[4]) {
    front->counts.hull_facets++;
    if (front->exchange.on) {
        front->star.built++; /* it takes as much room */
        bool all = incode_own(front, v[0]) && incode_own(front, v[1]) &&
                   incode_own(front, v[2]);
        incode_exchange_share(front, v, !all);
    }
}

/* The tetrahedron beside the face that was taken out, whose first vertex has it
 * in its list, is another's: the face stays open until it comes. */
static void leave(struct incode_front *front, const uint32_t v[4]) {
    front->star.built++;
    front->counts.built++;
    front->counts.foreign++;
    incode_exchange_toggle(front, v, INCODE_FACE_FOREIGN);
}

static void emit(struct incode_front *front) {
    struct incode_star *star = &front->star;
    if (star->kept > 0)
        front->outside.emit(front->outside.context, star->v,
                            (const uint32_t(*)[3])star->apexes, star->kept);
    star->kept = 0;
}

/* ---- a whole star ---- */

bool incode_star_open(struct incode_front *front, uint32_t v) {
    struct incode_star *star = &front->star;
    uint32_t pairs[INCODE_STAR_FACES / 2][2];
    star->v = v;
    star->faces = star->built = star->kept = 0;
    star->later_count = star->links = 0;
    uint32_t n = incode_afl_take(&front->afl, v, pairs, INCODE_STAR_FACES / 2,
                                 &star->more);
    for (uint32_t i = 0; i < n; i++)
        push_face(star, pairs[i][0], pairs[i][1], INCODE_HINT_NONE,
                  INCODE_HINT_NONE);
    return n > 0;
}

void incode_star_put(struct incode_front *front,
                     const struct incode_star_face *face) {
    push_face(&front->star, face->b, face->c, face->hint[0], face->hint[1]);
}

bool incode_star_find(struct incode_front *front, uint32_t b, uint32_t c) {
    struct incode_star *star = &front->star;
    /* It may be among those that did not fit at hand. */
    return remove_face(star, b, c) ||
           (star->more && incode_afl_close_twin(&front->afl, star->v, c, b));
}

void incode_star_build(struct incode_front *front, const uint32_t v[4],
                       const double *const p[4], const uint16_t hint[4]) {
    if (v[3] == INCODE_NONE)
        find_hull(front, v);
    else if (incode_exchange_is_foreign(front, v, 4) && !is_planted(front))
        leave(front, v);
    else
        build(front, v, p, hint, true);
}

void incode_star_shut(struct incode_front *front) {
    toggle_later(front);
    put_back(front);
    emit(front);
}

/* ---- by itself ---- */

static void build_alone(struct incode_front *front, const uint32_t v[4],
                        const double *const p[4], bool through) {
    struct incode_star *star = &front->star;
    star->v = v[0];
    star->faces = star->built = star->kept = 0;
    star->later_count = star->links = 0;
    star->more = true;
    build(front, v, p, NO_HINTS, through);
    incode_star_shut(front);
}

bool incode_front_face(struct incode_front *front, uint32_t v,
                       uint32_t face[3]) {
    uint32_t pair[1][2];
    bool more;
    if (incode_afl_take(&front->afl, v, pair, 1, &more) == 0)
        return false;
    face[0] = v;
    face[1] = pair[0][0];
    face[2] = pair[0][1];
    incode_afl_toggle(&front->afl, v, face[1], face[2]);
    if (front->exchange.on)
        incode_exchange_ready(front, v);
    return true;
}

bool incode_front_use(struct incode_front *front, const uint32_t v[4],
                      const double *const p[4]) {
    unsigned turn;
    if (!incode_front_key(front, v, p, &turn)) {
        front->fault = "a vertex has moved while its face was under search";
        return false;
    }
    uint32_t key = v[turn], b = v[(turn + 1) % 3], c = v[(turn + 2) % 3];
    uint32_t brick = key / INCODE_BRICK_POINTS;
    /* Of a brick that is not wholly here it is not known what is open. */
    if (incode_position(front, brick) >= front->spill_from ||
        (front->unspill_pending && front->unspill_brick == brick) ||
        !incode_afl_close_twin(&front->afl, key, c, b))
        return false;
    const uint32_t f[4] = {key, b, c, v[3]};
    if (v[3] == INCODE_NONE)
        find_hull(front, v);
    else if (incode_exchange_is_foreign(front, v, 4))
        leave(front, f);
    else
        build_alone(front, v, p, true);
    return true;
}

void incode_front_seed(struct incode_front *front, const uint32_t v[4],
                       const double *const p[4]) {
    if (incode_exchange_is_foreign(front, v, 4)) {
        front->counts.built++; /* in vain */
        front->counts.foreign++;
        return;
    }
    front->counts.seeds++;
    front->exchange.tries = UINT32_MAX; /* enough */
    for (int i = 0; i < 3; i++)
        incode_front_reached(front, v[i]);
    build_alone(front, v, p, false);
}
