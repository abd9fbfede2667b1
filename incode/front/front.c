#include "front.h"

#include <string.h>

#include "exchange.h"
#include "incode/predicates/check.h"

/* Which faces are pursued, in whose list they wait, and where the list goes
 * when it does not fit.  A face belongs to its lowest own vertex that is no
 * hub; a face without such a vertex (it has only hubs of its own, or the rule
 * `paper` pursues it) to its lowest vertex that is no hub, or to its lowest. */

enum { WINDOW = 4 /* bricks */ };

static const char *const TOO_SMALL =
    "the active face list of one brick does not fit; give the nodes more "
    "memory";

/* ---- memory ---- */

size_t incode_front_bytes(const struct incode_front_share *share) {
    return incode_afl_bytes(share->faces, share->entries);
}

void incode_front_init(struct incode_front *front, void *memory,
                       const struct incode_front_share *share, uint32_t bricks,
                       enum incode_face_rule rule,
                       const struct incode_front_outside *outside,
                       struct incode_yield *yield) {
    INCODE_ASSERT(bricks > 0);
    memset(front, 0, sizeof *front);
    front->afl.yield = yield;
    front->bricks = bricks;
    front->face_rule = rule;
    front->outside = *outside;
    front->window = WINDOW;
    front->room_faces = 2 * INCODE_STAR_FACES + 4 * INCODE_STAR_BUILT;
    front->finished = true;
    incode_front_move(front, memory, share);
}

void incode_front_abandon(struct incode_front *front) {
    front->finished = true;
    front->unspill_pending = false;
    front->afl.count = 0;
    front->fault = front->afl.fault = NULL;
}

void incode_front_move(struct incode_front *front, void *memory,
                       const struct incode_front_share *share) {
    uint32_t most = front->afl.count_max;
    INCODE_ASSERT(front->finished && share->faces >= INCODE_FACES_MIN &&
                  (share->entries >= INCODE_ENTRIES_MIN ||
                   share->entries >= incode_front_entries(front->bricks)));
    incode_afl_init(&front->afl, memory, share->faces, share->entries,
                    front->afl.yield);
    front->afl.count_max = most;
    front->room_entries = share->entries / 4;
}

void incode_front_start(struct incode_front *front,
                        const struct incode_job *job) {
    INCODE_ASSERT(job->first <= job->last && job->last <= front->bricks);
    front->job = *job;
    incode_afl_clear(&front->afl);
    front->current = 0;
    front->spill_from = front->bricks;
    front->spill_cursor = INCODE_NONE;
    front->spill_count = 0;
    front->spilled_any = front->unspill_pending = false;
    front->foreign = front->finished = false;
    front->hub_count = 0;
    front->draining = INCODE_NONE;
    front->busy = 0;
    front->fault = NULL;
    front->passed = NULL;
    if (front->exchange.on)
        incode_exchange_start(front);
}

void incode_front_take_over(struct incode_front *front,
                            const struct incode_job *job,
                            const uint64_t *passed) {
    incode_front_start(front, job);
    front->passed = passed;
    front->spill_from = 0;
    front->spilled_any = true;
}

/* ---- faces ---- */

static bool is_hub(const struct incode_front *front, uint32_t v) {
    for (uint32_t i = 0; i < front->hub_count; i++)
        if (front->hubs[i] == v)
            return true;
    return false;
}

bool incode_front_has_hub(const struct incode_front *front, uint32_t brick) {
    for (uint32_t i = 0; i < front->hub_count; i++)
        if (front->hubs[i] / INCODE_BRICK_POINTS == brick)
            return true;
    return false;
}

/* Does the triangle's box meet the region's?  A function of the face alone, so
 * that both its tetrahedra agree. */
static bool in_region(const struct incode_front *front,
                      const double *const p[3]) {
    for (int d = 0; d < 3; d++) {
        double a = p[0][d], b = p[1][d], c = p[2][d];
        double lo = a < b ? a : b, hi = a < b ? b : a;
        lo = c < lo ? c : lo;
        hi = c > hi ? c : hi;
        if (hi < front->job.lo[d] || lo > front->job.hi[d])
            return false;
    }
    return true;
}

static unsigned key_of(const struct incode_front *front, const uint32_t f[3]) {
    unsigned best = 0;
    int best_class = 4;
    for (unsigned i = 0; i < 3; i++) {
        bool own = incode_own(front, f[i]), hub = is_hub(front, f[i]);
        int class = (own && !hub) ? 0 : !hub ? 1 : 2;
        if (class < best_class ||
            (class == best_class && incode_precedes(front, f[i], f[best]))) {
            best = i;
            best_class = class;
        }
    }
    return best;
}

bool incode_front_key_slow(const struct incode_front *front,
                           const uint32_t f[3], const double *const p[3],
                           unsigned *turn) {
    if (!incode_own(front, f[0]) && !incode_own(front, f[1]) &&
        !incode_own(front, f[2]) &&
        (front->face_rule != INCODE_FACE_PAPER || !in_region(front, p)))
        return false;
    *turn = key_of(front, f);
    return true;
}

static void spill_one(struct incode_front *front, const uint32_t f[3]) {
    INCODE_ASSERT(front->spill_count < INCODE_SPILL_FACES);
    memcpy(front->spill[front->spill_count++].v, f, sizeof front->spill[0].v);
    front->spilled_any = true;
    front->counts.spilled++;
    if (front->spill_count == INCODE_SPILL_FACES)
        (void)incode_front_flush(front);
}

bool incode_front_flush(struct incode_front *front) {
    if (front->spill_count == 0)
        return true;
    if (!front->outside.spill(front->outside.context, front->spill,
                              front->spill_count))
        return false;
    front->spill_count = 0;
    return true;
}

static bool is_spilled(const struct incode_front *front, uint32_t brick) {
    return incode_position(front, brick) >= front->spill_from;
}

/* In the list, which is at hand. */
static void toggle_at_hand(struct incode_front *front, const uint32_t f[3],
                           bool held) {
    if (!front->exchange.on)
        incode_afl_toggle(&front->afl, f[0], f[1], f[2]);
    else if (!incode_afl_close_twin(&front->afl, f[0], f[1], f[2]))
        incode_exchange_open(front, f,
                             incode_exchange_is_foreign(front, f, 3)
                                 ? INCODE_FACE_FOREIGN
                             : held ? INCODE_FACE_HELD
                                    : INCODE_FACE_OPEN);
}

void incode_front_toggle(struct incode_front *front, const uint32_t f[3],
                         bool held) {
    if (is_spilled(front, f[0] / INCODE_BRICK_POINTS))
        spill_one(front, f);
    else
        toggle_at_hand(front, f, held);
}

void incode_front_reached(struct incode_front *front, uint32_t v) {
    uint32_t brick = v / INCODE_BRICK_POINTS;
    if (!incode_own_brick(front, brick))
        return;
    if (is_spilled(front, brick)) {
        const uint32_t f[3] = {v, INCODE_NONE, INCODE_NONE};
        spill_one(front, f);
        return;
    }
    struct incode_touched *entry = incode_afl_touch(&front->afl, brick);
    entry->reached |= UINT64_C(1) << (v % INCODE_BRICK_POINTS);
}

bool incode_front_is_reached(const struct incode_front *front, uint32_t v) {
    const struct incode_touched *entry =
        incode_afl_find(&front->afl, v / INCODE_BRICK_POINTS);
    return entry != NULL &&
           (entry->reached >> v % INCODE_BRICK_POINTS & 1) != 0;
}

/* ---- hubs ---- */

/* Puts the open face (v, b, c) into the list where it belongs now. */
static void list_again(struct incode_front *front, uint32_t v, uint32_t b,
                       uint32_t c) {
    const uint32_t f[3] = {v, b, c};
    unsigned turn = key_of(front, f);
    const uint32_t g[3] = {f[turn], f[(turn + 1) % 3], f[(turn + 2) % 3]};
    incode_front_toggle(front, g, false);
}

/* Makes the vertex with a crowded list a hub; false: there is none. */
static bool find_hub(struct incode_front *front) {
    uint32_t v = front->afl.crowded;
    if (v == INCODE_NONE)
        return false;
    uint32_t brick = v / INCODE_BRICK_POINTS;
    if (front->unspill_pending && front->unspill_brick == brick)
        return false; /* some of its list is still on its way */
    front->afl.crowded = INCODE_NONE;
    if (is_hub(front, v) || is_spilled(front, brick) ||
        front->hub_count == INCODE_HUBS)
        return false;
    front->hubs[front->hub_count++] = front->draining = v;
    incode_afl_free(&front->afl, v); /* they move, held or not */
    return true;
}

bool incode_front_drain(struct incode_front *front) {
    if (front->draining == INCODE_NONE && !find_hub(front))
        return false;
    /* Faces of three hubs stay: too few to fill the array. */
    enum { FACES = 128 };
    uint32_t v = front->draining, pairs[FACES][2], stay = 0;
    bool more;
    uint32_t n = incode_afl_take(&front->afl, v, pairs, FACES, &more);
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t f[3] = {v, pairs[i][0], pairs[i][1]};
        incode_afl_yield(&front->afl, 2);
        if (key_of(front, f) == 0)
            memcpy(pairs[stay++], f + 1, sizeof pairs[0]);
        else
            list_again(front, f[0], f[1], f[2]);
    }
    if (stay == FACES)
        front->fault = "too many faces among hubs";
    for (uint32_t i = 0; i < stay; i++)
        list_again(front, v, pairs[i][0], pairs[i][1]);
    if (!more)
        front->draining = INCODE_NONE;
    return true;
}

/* ---- spilling ---- */

/* The position from which on bricks are to be spilled: half way between the
 * one at work and the farthest one touched.  Bricks before the one at work are
 * passed, but for others' and those of an exchange, whose faces wait for what
 * others send: where nothing farther is left, the first touched one counts. */
static uint32_t spill_position(const struct incode_front *front) {
    uint32_t nearest = UINT32_MAX, farthest = 0, work = front->current;
    for (uint32_t i = 0; i < front->afl.touched_max; i++) {
        const struct incode_touched *entry = &front->afl.touched[i];
        incode_afl_yield_at(&front->afl, i);
        if (!incode_touched_used(entry))
            continue;
        uint32_t position = incode_position(front, entry->brick);
        nearest = position < nearest ? position : nearest;
        if (position < front->spill_from && position > farthest)
            farthest = position;
    }
    bool passed = front->exchange.on && work + 1 >= front->spill_from;
    if ((front->foreign || passed) && nearest < work)
        work = nearest;
    if (farthest < work)
        farthest = work;
    return work + 1 + (farthest - work) / 2;
}

/* Moves a brick's faces and marks out, as far as there is room for them; true:
 * all of them. */
static bool evict_brick(struct incode_front *front,
                        const struct incode_touched *entry) {
    uint32_t brick = entry->brick;
    for (uint32_t slot = 0; slot < INCODE_BRICK_POINTS; slot++) {
        uint32_t v = brick * INCODE_BRICK_POINTS + slot, pairs[8][2];
        bool more = true;
        incode_afl_yield(&front->afl, 1);
        incode_afl_free(&front->afl, v);
        while (more) {
            if (front->spill_count > 0 && !incode_front_flush(front))
                return false;
            uint32_t n = incode_afl_take(&front->afl, v, pairs, 8, &more);
            for (uint32_t i = 0; i < n; i++) {
                if (v == front->draining) {
                    list_again(front, v, pairs[i][0], pairs[i][1]);
                } else {
                    const uint32_t f[3] = {v, pairs[i][0], pairs[i][1]};
                    spill_one(front, f);
                }
            }
        }
    }
    for (uint64_t left = entry->reached; left != 0; left &= left - 1) {
        uint32_t slot = (uint32_t)__builtin_ctzll(left);
        const uint32_t f[3] = {brick * INCODE_BRICK_POINTS + slot, INCODE_NONE,
                               INCODE_NONE};
        spill_one(front, f);
    }
    incode_afl_drop(&front->afl, brick);
    return true;
}

/* Evicts one brick beyond the threshold, or notes that none is left. */
static void evict_next(struct incode_front *front) {
    while (front->spill_cursor < front->afl.touched_max) {
        const struct incode_touched *entry =
            &front->afl.touched[front->spill_cursor];
        incode_afl_yield_at(&front->afl, front->spill_cursor);
        if (incode_touched_used(entry) && is_spilled(front, entry->brick)) {
            (void)evict_brick(front, entry);
            return;
        }
        front->spill_cursor++;
    }
    front->spill_cursor = INCODE_NONE;
}

bool incode_front_has_room(const struct incode_front *front) {
    return front->afl.capacity - front->afl.count >= front->room_faces &&
           front->afl.touched_capacity - front->afl.touched_count >=
               front->room_entries;
}

bool incode_front_room(struct incode_front *front) {
    INCODE_ASSERT(front->fault == NULL);
    if (front->spill_count > 0 && !incode_front_flush(front))
        return false;
    if (front->spill_cursor != INCODE_NONE) {
        evict_next(front);
        return false;
    }
    if (incode_front_has_room(front))
        return true;
    if (front->unspill_pending) /* what returns must be whole before it moves */
        return false;
    uint32_t from = spill_position(front);
    if (from >= front->spill_from) {
        front->fault = TOO_SMALL;
        return false;
    }
    front->spill_from = from;
    front->spill_cursor = 0;
    return false;
}

/* A face or a mark that can have been spilled. */
static bool may_return(const struct incode_front *front, uint32_t brick,
                       const uint32_t f[3]) {
    bool face = f[1] / INCODE_BRICK_POINTS < front->bricks &&
                f[2] / INCODE_BRICK_POINTS < front->bricks && f[0] != f[1] &&
                f[0] != f[2] && f[1] != f[2];
    bool mark = f[1] == INCODE_NONE && f[2] == INCODE_NONE;
    return f[0] / INCODE_BRICK_POINTS == brick && (face || mark);
}

int incode_front_unspill(struct incode_front *front, uint32_t brick,
                         const struct incode_face *faces, size_t count,
                         bool last) {
    if (!front->unspill_pending || brick != front->unspill_brick)
        return -1;
    struct incode_touched *entry = NULL;
    for (size_t i = 0; i < count; i++) {
        const uint32_t *f = faces[i].v;
        incode_afl_yield(&front->afl, 1);
        if (!may_return(front, brick, f))
            return -1;
        if (front->afl.count + 1 >= front->afl.capacity ||
            front->afl.touched_count + 1 >= front->afl.touched_capacity) {
            front->fault = TOO_SMALL;
            return 0;
        }
        if (f[1] != INCODE_NONE) {
            toggle_at_hand(front, f, false);
            continue;
        }
        entry = incode_afl_touch(&front->afl, brick);
        entry->reached |= UINT64_C(1) << (f[0] % INCODE_BRICK_POINTS);
    }
    if (last) {
        front->unspill_pending = false;
        if (front->spill_from == front->bricks)
            front->spilled_any = false;
        if (front->exchange.on)
            incode_exchange_returned(front, brick);
    }
    return 0;
}
