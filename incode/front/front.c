#include <string.h>

#include "incode/predicates/check.h"
#include "incode/state.h"

/* Which faces are pursued, in whose list they wait, and where the list goes
 * when it does not fit.  A face belongs to its lowest own vertex that is no
 * hub; a face without such a vertex (it has only hubs of its own, or the rule
 * `paper` pursues it) to its lowest vertex that is no hub, or to its lowest. */

static bool is_hub(const struct incode_triangulator *t, uint32_t v)
{
    for (uint32_t i = 0; i < t->hub_count; i++)
        if (t->hubs[i] == v)
            return true;
    return false;
}

bool incode_front_has_hub(const struct incode_triangulator *t, uint32_t brick)
{
    for (uint32_t i = 0; i < t->hub_count; i++)
        if (t->hubs[i] / INCODE_BRICK_POINTS == brick)
            return true;
    return false;
}

/* Does the triangle's box meet the region's?  A function of the face alone, so
 * that both its tetrahedra agree. */
static bool in_region(const struct incode_triangulator *t,
                      const double *const p[3])
{
    for (int d = 0; d < 3; d++) {
        double a = p[0][d], b = p[1][d], c = p[2][d];
        double lo = a < b ? a : b, hi = a < b ? b : a;
        lo = c < lo ? c : lo;
        hi = c > hi ? c : hi;
        if (hi < t->job.lo[d] || lo > t->job.hi[d])
            return false;
    }
    return true;
}

static unsigned key_of(const struct incode_triangulator *t, const uint32_t f[3])
{
    unsigned best = 0;
    int best_class = 4;
    for (unsigned i = 0; i < 3; i++) {
        bool own = incode_own(t, f[i]), hub = is_hub(t, f[i]);
        int class = (own && !hub) ? 0 : !hub ? 1 : 2;
        if (class < best_class || (class == best_class && f[i] < f[best])) {
            best = i;
            best_class = class;
        }
    }
    return best;
}

bool incode_front_key_slow(const struct incode_triangulator *t,
                           const uint32_t f[3], const double *const p[3],
                           unsigned *turn)
{
    if (!incode_own(t, f[0]) && !incode_own(t, f[1]) && !incode_own(t, f[2]) &&
        (t->setup.face_rule != INCODE_FACE_PAPER || !in_region(t, p)))
        return false;
    *turn = key_of(t, f);
    return true;
}

static void spill_one(struct incode_triangulator *t, const uint32_t f[3])
{
    INCODE_ASSERT(t->spill_count < INCODE_SPILL_FACES);
    memcpy(t->spill[t->spill_count++].v, f, sizeof t->spill[0].v);
    t->spilled_any = true;
    t->stats.afl_spilled++;
    if (t->spill_count == INCODE_SPILL_FACES)
        (void)incode_front_flush(t);
}

bool incode_front_flush(struct incode_triangulator *t)
{
    if (t->spill_count == 0)
        return true;
    if (!t->outside.spill(t->outside.context, t->spill, t->spill_count))
        return false;
    t->spill_count = 0;
    return true;
}

static bool is_spilled(const struct incode_triangulator *t, uint32_t brick)
{
    return incode_position(t, brick) >= t->spill_from;
}

void incode_front_toggle(struct incode_triangulator *t, const uint32_t f[3])
{
    if (is_spilled(t, f[0] / INCODE_BRICK_POINTS))
        spill_one(t, f);
    else
        incode_afl_toggle(&t->afl, f[0], f[1], f[2]);
}

void incode_front_reached(struct incode_triangulator *t, uint32_t v)
{
    uint32_t brick = v / INCODE_BRICK_POINTS;
    if (!incode_own_brick(t, brick))
        return;
    if (is_spilled(t, brick)) {
        const uint32_t f[3] = {v, INCODE_NONE, INCODE_NONE};
        spill_one(t, f);
        return;
    }
    struct incode_touched *entry = incode_afl_touch(&t->afl, brick);
    entry->reached |= UINT64_C(1) << (v % INCODE_BRICK_POINTS);
}

/* ---- hubs ---- */

/* Puts the open face (v, b, c) into the list where it belongs now. */
static void list_again(struct incode_triangulator *t, uint32_t v, uint32_t b,
                       uint32_t c)
{
    const uint32_t f[3] = {v, b, c};
    unsigned turn = key_of(t, f);
    const uint32_t g[3] = {f[turn], f[(turn + 1) % 3], f[(turn + 2) % 3]};
    incode_front_toggle(t, g);
}

/* Makes the vertex with a crowded list a hub; false: there is none. */
static bool find_hub(struct incode_triangulator *t)
{
    uint32_t v = t->afl.crowded;
    if (v == INCODE_NONE)
        return false;
    uint32_t brick = v / INCODE_BRICK_POINTS;
    if (t->unspill_pending && t->unspill_brick == brick)
        return false; /* some of its list is still on its way */
    t->afl.crowded = INCODE_NONE;
    if (is_hub(t, v) || is_spilled(t, brick) || t->hub_count == INCODE_HUBS)
        return false;
    t->hubs[t->hub_count++] = t->draining = v;
    return true;
}

bool incode_front_drain(struct incode_triangulator *t)
{
    if (t->draining == INCODE_NONE && !find_hub(t))
        return false;
    /* Faces of three hubs stay: too few to fill the array. */
    enum { FACES = 128 };
    uint32_t v = t->draining, pairs[FACES][2], stay = 0;
    bool more;
    uint32_t n = incode_afl_take(&t->afl, v, pairs, FACES, &more);
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t f[3] = {v, pairs[i][0], pairs[i][1]};
        if (key_of(t, f) == 0)
            memcpy(pairs[stay++], f + 1, sizeof pairs[0]);
        else
            list_again(t, f[0], f[1], f[2]);
    }
    INCODE_ASSERT(stay < FACES);
    for (uint32_t i = 0; i < stay; i++)
        list_again(t, v, pairs[i][0], pairs[i][1]);
    if (!more)
        t->draining = INCODE_NONE;
    return true;
}

/* ---- spilling ---- */

/* The position from which on bricks are to be spilled: half way between the
 * one at work and the farthest one touched. */
static uint32_t spill_position(const struct incode_triangulator *t)
{
    uint32_t nearest = t->current, farthest = 0;
    for (uint32_t i = 0; i < t->afl.touched_max; i++) {
        const struct incode_touched *entry = &t->afl.touched[i];
        if (!incode_touched_used(entry))
            continue;
        uint32_t position = incode_position(t, entry->brick);
        if (t->foreign && position < nearest)
            nearest = position;
        if (position < t->spill_from && position > farthest)
            farthest = position;
    }
    if (farthest < nearest)
        farthest = nearest;
    return nearest + 1 + (farthest - nearest) / 2;
}

/* Moves a brick's faces and marks out, as far as there is room for them; true:
 * all of them. */
static bool evict_brick(struct incode_triangulator *t,
                        const struct incode_touched *entry)
{
    uint32_t brick = entry->brick;
    for (uint32_t slot = 0; slot < INCODE_BRICK_POINTS; slot++) {
        uint32_t v = brick * INCODE_BRICK_POINTS + slot, pairs[8][2];
        bool more = true;
        while (more) {
            if (t->spill_count > 0 && !incode_front_flush(t))
                return false;
            uint32_t n = incode_afl_take(&t->afl, v, pairs, 8, &more);
            for (uint32_t i = 0; i < n; i++) {
                if (v == t->draining) {
                    list_again(t, v, pairs[i][0], pairs[i][1]);
                } else {
                    const uint32_t f[3] = {v, pairs[i][0], pairs[i][1]};
                    spill_one(t, f);
                }
            }
        }
    }
    for (uint64_t left = entry->reached; left != 0; left &= left - 1) {
        uint32_t slot = (uint32_t)__builtin_ctzll(left);
        const uint32_t f[3] = {brick * INCODE_BRICK_POINTS + slot, INCODE_NONE,
                               INCODE_NONE};
        spill_one(t, f);
    }
    incode_afl_drop(&t->afl, brick);
    return true;
}

/* Evicts one brick beyond the threshold, or notes that none is left. */
static void evict_next(struct incode_triangulator *t)
{
    while (t->spill_cursor < t->afl.touched_max) {
        const struct incode_touched *entry = &t->afl.touched[t->spill_cursor];
        if (incode_touched_used(entry) && is_spilled(t, entry->brick)) {
            (void)evict_brick(t, entry);
            return;
        }
        t->spill_cursor++;
    }
    t->spill_cursor = INCODE_NONE;
}

static bool has_room(const struct incode_triangulator *t)
{
    return t->afl.capacity - t->afl.count >= t->room_faces &&
           t->afl.touched_capacity - t->afl.touched_count >= t->room_bricks;
}

bool incode_front_room(struct incode_triangulator *t)
{
    INCODE_ASSERT(t->fault == NULL);
    if (t->spill_count > 0 && !incode_front_flush(t))
        return false;
    if (t->spill_cursor != INCODE_NONE) {
        evict_next(t);
        return false;
    }
    if (has_room(t))
        return true;
    if (t->unspill_pending) /* what returns must be whole before it moves */
        return false;
    uint32_t from = spill_position(t);
    if (from >= t->spill_from) {
        t->fault = "the active face list of one brick does not fit; give the "
                   "nodes more memory";
        return false;
    }
    t->spill_from = from;
    t->spill_cursor = 0;
    return false;
}
