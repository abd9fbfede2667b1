#include "exchange.h"

#include <assert.h>
#include <string.h>

#include "incode/predicates/check.h"

enum {
    SWEEP_HEADS = 256, /* a call */
    SWEEP_ENTRIES = 512,
    SWEEP_COMMITS = 64,
    LOOKS = 256,     /* at bricks or entries, a call */
    WINDOW = 4,      /* bricks ahead of one that waits */
    SWEEP_SHARE = 4, /* tetrahedra for each open face between two sweeps */
    SWEEP_LEAST = 1024,
    SEED_TRIES = 64, /* at the start */
    SEED_STRIDE = 23
};

static const char *const TOO_SMALL =
    "the active face list does not take what other nodes send; give the nodes "
    "more memory";

static const char *const UNASKED =
    "a tetrahedron of another node came while no room for spilled faces was "
    "left";

static const char *const INCONSISTENT =
    "a tetrahedron at a star that is closed: pages contradict each other, or "
    "it came twice";

/* ---- maps ---- */

static uint32_t position_of(const struct incode_front *front, uint32_t brick) {
    return front->job.last - 1 - brick;
}

static void set_bit(uint64_t *map, uint32_t i) {
    map[i / 64] |= UINT64_C(1) << i % 64;
}

static void clear_bit(uint64_t *map, uint32_t i) {
    map[i / 64] &= ~(UINT64_C(1) << i % 64);
}

static bool is_set(const uint64_t *map, uint32_t i) {
    return (map[i / 64] >> i % 64 & 1) != 0;
}

/* The lowest position of a map from word *from on, which moves up to it. */
static bool lowest(const struct incode_exchange *e, const uint64_t *map,
                   uint32_t *from, uint32_t *position) {
    while (*from < e->words && map[*from] == 0)
        ++*from;
    if (*from == e->words)
        return false;
    *position = *from * 64 + (uint32_t)__builtin_ctzll(map[*from]);
    return true;
}

static void note(uint64_t *map, uint32_t *from, uint32_t position) {
    set_bit(map, position);
    if (position / 64 < *from)
        *from = position / 64;
}

void incode_front_exchange(struct incode_front *front,
                           const struct incode_front_peers *peers,
                           const double lo[3], uint64_t *maps) {
    struct incode_exchange *e = &front->exchange;
    size_t words = ((size_t)front->bricks + 63) / 64;
    INCODE_ASSERT(front->finished && front->face_rule == INCODE_FACE_OWN);
    front->owner_rule = INCODE_OWNER_LOWEST;
    e->on = true;
    e->peers = *peers;
    e->ready = maps;
    e->deferred = maps + words;
    e->committed = maps + 2 * words;
    memcpy(e->lo, lo, sizeof e->lo);
    front->room_faces += front->afl.capacity / 8; /* for what others send */
}

void incode_exchange_start(struct incode_front *front) {
    struct incode_exchange *e = &front->exchange;
    uint32_t own = front->job.last - front->job.first;
    struct incode_exchange fresh = {.on = true,
                                    .peers = e->peers,
                                    .ready = e->ready,
                                    .deferred = e->deferred,
                                    .committed = e->committed,
                                    .words = (own + 63) / 64,
                                    .left = own};
    memcpy(fresh.lo, e->lo, sizeof fresh.lo);
    for (int d = 0; d < 3; d++) {
        bool below = front->job.lo[d] > e->lo[d];
        fresh.floor[d] = below ? front->job.lo[d] : -__builtin_inf();
        fresh.below |= (unsigned)below << d;
    }
    *e = fresh;
    memset(e->ready, 0, e->words * sizeof *e->ready);
    memset(e->deferred, 0, e->words * sizeof *e->deferred);
    memset(e->committed, 0, e->words * sizeof *e->committed);
    e->ready_from = e->deferred_from = e->words;
    front->finished = own == 0;
}

/* ---- faces ---- */

void incode_exchange_ready(struct incode_front *front, uint32_t v) {
    struct incode_exchange *e = &front->exchange;
    if (incode_own(front, v))
        note(e->ready, &e->ready_from,
             position_of(front, v / INCODE_BRICK_POINTS));
    else
        e->elsewhere = front->afl.touched_max;
}

void incode_exchange_returned(struct incode_front *front, uint32_t brick) {
    front->exchange.quiet = false;
    front->exchange.changes++;
    incode_exchange_ready(front, brick * INCODE_BRICK_POINTS);
}

/* Notes that an open face has this vertex. */
static void mark(struct incode_front *front, uint32_t v) {
    uint32_t brick = v / INCODE_BRICK_POINTS;
    if (!incode_own_brick(front, brick) ||
        position_of(front, brick) >= front->spill_from)
        return;
    if (is_set(front->exchange.committed, position_of(front, brick)))
        front->fault = INCONSISTENT;
    else
        incode_afl_touch(&front->afl, brick)->mark = front->exchange.sweep;
}

void incode_exchange_open(struct incode_front *front, const uint32_t f[3],
                          enum incode_face_state state) {
    struct incode_exchange *e = &front->exchange;
    if (state == INCODE_FACE_HELD && !incode_own(front, f[0]))
        state = INCODE_FACE_OPEN; /* of hubs: in nobody's turn */
    incode_afl_open(&front->afl, f[0], f[1], f[2], state);
    if (state == INCODE_FACE_OPEN)
        incode_exchange_ready(front, f[0]);
    else if (state == INCODE_FACE_HELD)
        note(e->deferred, &e->deferred_from,
             position_of(front, f[0] / INCODE_BRICK_POINTS));
    for (int i = 0; e->sweeping && i < 3; i++)
        mark(front, f[i]);
}

bool incode_exchange_is_near_side(const struct incode_front *front,
                                  const double *const p[4]) {
    bool near = false;
    for (unsigned left = front->exchange.below; left != 0; left &= left - 1) {
        unsigned d = (unsigned)__builtin_ctz(left);
        double a = p[0][d], b = p[1][d], c = p[2][d], e = p[3][d];
        double lo = a < b ? a : b, hi = a < b ? b : a;
        double lo2 = c < e ? c : e, hi2 = c < e ? e : c;
        lo = lo < lo2 ? lo : lo2;
        hi = hi > hi2 ? hi : hi2;
        near |= lo - 2 * (hi - lo) < front->exchange.floor[d];
    }
    return near;
}

bool incode_exchange_is_outward(const struct incode_front *front,
                                const double *const p[3]) {
    const double *floor = front->exchange.floor;
    double u[3], w[3], square_edge = 0;
    for (int d = 0; d < 3; d++) {
        u[d] = p[1][d] - p[0][d];
        w[d] = p[2][d] - p[0][d];
        square_edge += 0.5 * (u[d] * u[d] + w[d] * w[d]);
    }
    const double n[3] = {u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2],
                         u[0] * w[1] - u[1] * w[0]};
    double square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    for (int d = 0; d < 3; d++) {
        double above = p[0][d] + (u[d] + w[d]) / 3 - floor[d];
        if (n[d] < 0 &&
            (above < 0 || above * above * square < n[d] * n[d] * square_edge))
            return true;
    }
    return false;
}

/* ---- tetrahedra ---- */

/* A tetrahedron or facet that another can have built. */
static bool may_come(const struct incode_front *front, const uint32_t *v,
                     unsigned count) {
    bool own = false;
    for (unsigned i = 0; i < count; i++) {
        if (v[i] / INCODE_BRICK_POINTS >= front->bricks)
            return false;
        for (unsigned k = 0; k < i; k++)
            if (v[i] == v[k])
                return false;
        own = own || incode_own(front, v[i]);
    }
    return own && incode_exchange_is_foreign(front, v, count);
}

/* Of one tetrahedron that another has built. */
enum { FACES = 4, VERTICES = 3 };

static_assert(INCODE_TAKEN_MAX * (FACES + VERTICES) <= INCODE_SPILL_FACES,
              "all that may be spilled of a message fits the empty buffer");

bool incode_front_may_take(struct incode_front *front, uint32_t count) {
    uint32_t spilled = count * (FACES + VERTICES);
    INCODE_ASSERT(count <= INCODE_TAKEN_MAX);
    return front->finished ||
           front->spill_count + spilled <= INCODE_SPILL_FACES ||
           incode_front_flush(front);
}

/* Room for the faces and vertices of one more; if not, why. */
static const char *room_fault(struct incode_front *front) {
    const struct incode_afl *afl = &front->afl;
    if (!incode_front_may_take(front, 1))
        return UNASKED;
    return afl->count + FACES <= afl->capacity &&
                   afl->touched_count + FACES + VERTICES <=
                       afl->touched_capacity
               ? NULL
               : TOO_SMALL;
}

int incode_front_take(struct incode_front *front, const uint32_t v[4]) {
    static const uint8_t face[4][3] = {
        {0, 3, 2}, {0, 1, 3}, {1, 2, 3}, {0, 2, 1}};
    struct incode_exchange *e = &front->exchange;
    unsigned count = v[3] == INCODE_NONE ? 3 : 4;
    if (!e->on || front->finished || !may_come(front, v, count))
        return -1;
    const char *fault = room_fault(front);
    if (fault != NULL) {
        front->fault = fault;
        return 0;
    }
    e->quiet = false;
    e->changes++;
    e->fetched = 0;
    front->counts.taken++;
    for (unsigned i = 0; i < count; i++) {
        uint32_t brick = v[i] / INCODE_BRICK_POINTS;
        if (!incode_own_brick(front, brick))
            continue;
        if (is_set(e->committed, position_of(front, brick)))
            front->fault = INCONSISTENT;
        else
            incode_front_reached(front, v[i]);
    }
    /* What lies beyond a facet of the hull has only that face. */
    for (unsigned k = count == 3 ? 3 : 0; k < 4 && front->fault == NULL; k++) {
        const uint32_t f[3] = {v[face[k][0]], v[face[k][1]], v[face[k][2]]};
        unsigned turn;
        if (!incode_front_key(front, f, NULL, &turn))
            continue;
        const uint32_t g[3] = {f[turn], f[(turn + 1) % 3], f[(turn + 2) % 3]};
        incode_afl_yield(&front->afl, 1);
        incode_front_toggle(front, g, false);
    }
    return 0;
}

/* ---- commits ---- */

static uint64_t all_of(const struct incode_front *front, uint32_t brick) {
    uint32_t count = brick == front->job.last - 1 ? front->exchange.last_count
                                                  : INCODE_BRICK_POINTS;
    return ~UINT64_C(0) >> (INCODE_BRICK_POINTS - count);
}

static void begin_sweep(struct incode_front *front) {
    struct incode_exchange *e = &front->exchange;
    e->sweep++;
    e->sweeping = true;
    e->sweep_head = e->sweep_entry = 0;
    e->changes = 0;
    front->afl.still = true;
}

/* Whether all that is known of an own brick is at hand.  Faces wait with their
 * highest own vertex that is no hub, so those that are spilled have no other
 * vertex in such a brick. */
static bool is_at_hand(const struct incode_front *front, uint32_t brick) {
    return position_of(front, brick) < front->spill_from &&
           !(front->unspill_pending && front->unspill_brick == brick) &&
           (!front->spilled_any || !incode_front_has_hub(front, brick));
}

static bool is_closed(const struct incode_front *front,
                      const struct incode_touched *entry) {
    return incode_touched_used(entry) &&
           incode_own_brick(front, entry->brick) &&
           is_at_hand(front, entry->brick) &&
           entry->mark != front->exchange.sweep && entry->waiting == 0 &&
           entry->reached == all_of(front, entry->brick);
}

/* Commits bricks that the sweep has not met. */
static void sweep_entries(struct incode_front *front) {
    struct incode_exchange *e = &front->exchange;
    uint32_t end = e->sweep_entry + SWEEP_ENTRIES, commits = 0;
    end = end < front->afl.touched_max ? end : front->afl.touched_max;
    for (; e->sweep_entry < end && commits < SWEEP_COMMITS; e->sweep_entry++) {
        const struct incode_touched *entry =
            &front->afl.touched[e->sweep_entry];
        incode_afl_yield_at(&front->afl, e->sweep_entry);
        if (!is_closed(front, entry))
            continue;
        set_bit(e->committed, position_of(front, entry->brick));
        front->outside.commit(front->outside.context, entry->brick);
        incode_afl_drop(&front->afl, entry->brick);
        e->left--;
        commits++;
    }
    e->sweeping = e->sweep_entry < front->afl.touched_max;
}

static enum incode_turn sweep_on(struct incode_front *front) {
    struct incode_exchange *e = &front->exchange;
    struct incode_afl *afl = &front->afl;
    if (e->sweep_head > afl->mask) {
        afl->still = false;
        sweep_entries(front);
        return INCODE_TURN_WORKED;
    }
    for (uint32_t i = 0; i < SWEEP_HEADS && e->sweep_head <= afl->mask; i++) {
        uint32_t at = afl->heads[e->sweep_head++];
        incode_afl_yield_at(&front->afl, i);
        for (; at != INCODE_AFL_NIL; at = afl->nodes[at].next) {
            incode_afl_yield(afl, 1);
            mark(front, afl->nodes[at].key);
            mark(front, afl->nodes[at].b);
            mark(front, afl->nodes[at].c);
        }
    }
    return INCODE_TURN_WORKED;
}

static enum incode_turn finish(struct incode_front *front) {
    if (front->afl.count > 0) {
        front->fault = "faces are open although all stars are closed";
        return INCODE_TURN_WAIT;
    }
    front->hub_count = 0;
    front->finished = true;
    return INCODE_TURN_END;
}

/* ---- order of work ---- */

/* What a look for a vertex comes to: MORE is left to be looked at. */
enum found { NONE, FOUND, MORE };

uint64_t incode_exchange_pending(const struct incode_front *front,
                                 uint32_t brick) {
    const struct incode_touched *entry = incode_afl_find(&front->afl, brick);
    bool returning = front->unspill_pending && front->unspill_brick == brick;
    return entry == NULL || returning ? 0 : entry->pending & ~entry->waiting;
}

/* The position beyond which no star is begun: as long as others wait for pages,
 * near them, as what is built far ahead opens faces there again. */
static uint32_t window_end(const struct incode_front *front) {
    uint32_t end = UINT32_MAX;
    for (uint32_t left = front->busy; left != 0; left &= left - 1) {
        uint32_t v = front->task[__builtin_ctz(left)].v;
        if (!incode_own(front, v))
            continue;
        uint32_t position = position_of(front, v / INCODE_BRICK_POINTS);
        end = position + WINDOW < end ? position + WINDOW : end;
    }
    return end;
}

/* The next own vertex with faces to be pursued. */
static enum found next_own(struct incode_front *front, uint32_t *v) {
    struct incode_exchange *e = &front->exchange;
    uint32_t position, looked = 0, end = window_end(front);
    while (lowest(e, e->ready, &e->ready_from, &position) && position < end) {
        uint32_t brick = front->job.last - 1 - position;
        uint64_t ready = incode_exchange_pending(front, brick);
        if (ready != 0) {
            front->current = position;
            *v = brick * INCODE_BRICK_POINTS + 63 -
                 (uint32_t)__builtin_clzll(ready);
            return FOUND;
        }
        clear_bit(e->ready, position);
        if (++looked == LOOKS)
            return MORE;
    }
    return NONE;
}

/* The same in lists of others' vertices, from an entry on to all others. */
static enum found next_elsewhere(struct incode_front *front, uint32_t *v) {
    struct incode_exchange *e = &front->exchange;
    for (uint32_t looked = 0; e->elsewhere > 0; e->elsewhere--, e->at++) {
        if (looked++ == LOOKS)
            return MORE;
        if (e->at >= front->afl.touched_max)
            e->at = 0;
        const struct incode_touched *entry = &front->afl.touched[e->at];
        if (!incode_touched_used(entry) ||
            incode_own_brick(front, entry->brick))
            continue;
        uint64_t ready = entry->pending & ~entry->waiting;
        if (ready != 0) {
            *v = entry->brick * INCODE_BRICK_POINTS +
                 (uint32_t)__builtin_ctzll(ready);
            return FOUND;
        }
        if (entry->faces == 0 && entry->waiting == 0)
            incode_afl_drop(&front->afl, entry->brick);
    }
    return NONE;
}

/* Lets the faces of one vertex go that were put off, or looks through a brick
 * that has none; false: there are none. */
static bool let_go(struct incode_front *front) {
    struct incode_exchange *e = &front->exchange;
    uint32_t position;
    if (!lowest(e, e->deferred, &e->deferred_from, &position))
        return false;
    uint32_t v = (front->job.last - position) * INCODE_BRICK_POINTS;
    for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i++) {
        if (incode_afl_let_go(&front->afl, --v) > 0) {
            incode_exchange_ready(front, v);
            return true;
        }
    }
    clear_bit(e->deferred, position);
    return true;
}

/* A vertex here and there, from the last one down, until one has a first
 * tetrahedron that is the front's own. */
static bool next_try(struct incode_front *front, uint32_t *v) {
    struct incode_exchange *e = &front->exchange;
    uint32_t own = front->job.last - front->job.first;
    uint64_t count = (uint64_t)(own - 1) * INCODE_BRICK_POINTS + e->last_count;
    while (e->tries < SEED_TRIES && e->tries < count) {
        uint32_t down = (uint32_t)((uint64_t)SEED_STRIDE * e->tries++ % count);
        *v =
            front->job.first * INCODE_BRICK_POINTS + (uint32_t)count - 1 - down;
        uint32_t brick = *v / INCODE_BRICK_POINTS;
        if (is_at_hand(front, brick) &&
            !is_set(e->committed, position_of(front, brick)) &&
            !incode_front_is_reached(front, *v))
            return true;
    }
    return false;
}

/* The next vertex that none has reached, each once. */
static enum found next_seed(struct incode_front *front, uint32_t *v) {
    struct incode_exchange *e = &front->exchange;
    uint32_t own = front->job.last - front->job.first, looked = 0;
    for (; e->seeding && e->seed_position < own; e->seed_position++) {
        uint32_t brick = front->job.last - 1 - e->seed_position;
        if (!is_at_hand(front, brick))
            return NONE;
        if (looked++ == LOOKS)
            return MORE;
        const struct incode_touched *entry =
            incode_afl_find(&front->afl, brick);
        uint64_t left =
            is_set(e->committed, e->seed_position)
                ? 0
                : all_of(front, brick) & ~(entry == NULL ? 0 : entry->reached);
        left = e->seed_slot == INCODE_BRICK_POINTS
                   ? 0
                   : left >> e->seed_slot << e->seed_slot;
        if (left != 0) {
            uint32_t slot = (uint32_t)__builtin_ctzll(left);
            *v = brick * INCODE_BRICK_POINTS + slot;
            e->seed_slot = slot + 1;
            return FOUND;
        }
        e->seed_slot = 0;
    }
    return NONE;
}

void incode_front_seed_all(struct incode_front *front) {
    struct incode_exchange *e = &front->exchange;
    e->seeding = true;
    e->seed_position = e->seed_slot = 0;
    e->quiet = false;
}

/* Where nothing is to be pursued: what was put off, first tetrahedra, what is
 * spilled, what has been closed. */
static enum incode_turn next_of_all(struct incode_front *front,
                                    uint32_t *which) {
    struct incode_exchange *e = &front->exchange;
    uint32_t v;
    if (next_try(front, &v))
        return incode_front_begin(front, v, true, which);
    if (e->lent > 0)
        return INCODE_TURN_WAIT;
    if (let_go(front))
        return INCODE_TURN_WORKED;
    enum found found = next_seed(front, &v);
    if (found != NONE)
        return found == MORE ? INCODE_TURN_WORKED
                             : incode_front_begin(front, v, true, which);
    if (front->unspill_pending)
        return INCODE_TURN_WAIT;
    /* What comes back and does not fit goes again: not for ever. */
    if (e->fetched <= front->bricks && incode_front_fetch(front)) {
        e->fetched += front->unspill_pending; /* else there is no room to ask */
        return INCODE_TURN_WAIT;
    }
    if (e->changes > 0) {
        begin_sweep(front);
        return INCODE_TURN_WORKED;
    }
    if (e->left == 0)
        return finish(front);
    e->quiet = true;
    return INCODE_TURN_WAIT;
}

enum incode_turn incode_exchange_next(struct incode_front *front,
                                      uint32_t *which) {
    struct incode_exchange *e = &front->exchange;
    uint32_t v;
    if (e->quiet)
        return INCODE_TURN_WAIT;
    if (e->last_count == 0) {
        *which = front->job.last - 1;
        return INCODE_TURN_COUNT;
    }
    if (e->sweeping)
        return sweep_on(front);
    if (e->changes / SWEEP_SHARE > front->afl.count + SWEEP_LEAST) {
        begin_sweep(front);
        return INCODE_TURN_WORKED;
    }
    enum found found = next_own(front, &v);
    if (found == NONE)
        found = next_elsewhere(front, &v);
    if (found != NONE)
        return found == MORE ? INCODE_TURN_WORKED
                             : incode_front_begin(front, v, false, which);
    return front->busy != 0 ? INCODE_TURN_WAIT : next_of_all(front, which);
}

enum incode_turn incode_exchange_count(struct incode_front *front,
                                       uint32_t count) {
    front->exchange.last_count = count;
    return INCODE_TURN_WORKED;
}
