#include "exchange.h"

#include "incode/predicates/check.h"

enum { LOOK_BRICKS = 64 /* to be lent from, at most */ };

/* Coordinates are not looked at. */
static const double *const NOWHERE[4] = {NULL, NULL, NULL, NULL};

/* ---- lending ---- */

/* The farthest position before *end that may have faces to be pursued. */
static bool farthest(const struct incode_exchange *e, uint32_t *end) {
    while (*end > 0) {
        uint32_t word = (*end - 1) / 64, bits = (*end - 1) % 64 + 1;
        uint64_t left = e->ready[word] & ~UINT64_C(0) >> (64 - bits);
        if (left != 0) {
            *end = word * 64 + 63 - (uint32_t)__builtin_clzll(left);
            return true;
        }
        *end = word * 64;
    }
    return false;
}

/* Where lending begins: behind what is spilled. */
static uint32_t end_of(const struct incode_front *front) {
    uint32_t own = front->job.last - front->job.first;
    return own < front->spill_from ? own : front->spill_from;
}

/* Ready vertices, as far as they need to be counted. */
static uint32_t count_ready(const struct incode_front *front) {
    uint32_t end = end_of(front), count = 0;
    for (uint32_t i = 0; i < LOOK_BRICKS && farthest(&front->exchange, &end) &&
                         count < INCODE_LOAN_SHARE * INCODE_LOAN_VERTICES;
         i++)
        count += (uint32_t)__builtin_popcountll(
            incode_exchange_pending(front, front->job.last - 1 - end));
    return count;
}

/* Lends one vertex, as many of its faces as there is room for. */
static bool lend_vertex(struct incode_front *front, uint32_t v,
                        struct incode_loan *loan) {
    uint32_t pairs[INCODE_LOAN_FACES][2];
    uint32_t n =
        incode_afl_tell(&front->afl, v, pairs, INCODE_LOAN_FACES - loan->count);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t *f = loan->v[loan->count++];
        f[0] = v;
        f[1] = pairs[i][0];
        f[2] = pairs[i][1];
    }
    front->counts.lent += n > 0;
    if (n > 0)
        incode_afl_touch(&front->afl, v / INCODE_BRICK_POINTS)->waiting |=
            UINT64_C(1) << v % INCODE_BRICK_POINTS;
    return n > 0;
}

bool incode_front_lend_run(struct incode_front *front,
                           struct incode_loan *loan) {
    if (front->finished || !front->exchange.on || front->exchange.quiet ||
        front->hub_count > 0 || front->spill_cursor != INCODE_NONE)
        return false;
    uint32_t ready = count_ready(front), end = end_of(front);
    if (ready < INCODE_LOAN_LEAST)
        return false;
    uint32_t left = ready / INCODE_LOAN_SHARE;
    left = left < INCODE_LOAN_VERTICES ? left : INCODE_LOAN_VERTICES;
    loan->first = front->job.first;
    loan->last = front->job.last;
    loan->count = 0;
    for (uint32_t i = 0;
         i < LOOK_BRICKS && left > 0 && loan->count < INCODE_LOAN_FACES &&
         farthest(&front->exchange, &end);
         i++) {
        uint32_t brick = front->job.last - 1 - end;
        uint64_t vertices = incode_exchange_pending(front, brick);
        for (; vertices != 0 && left > 0 && loan->count < INCODE_LOAN_FACES;
             vertices &= vertices - 1)
            left -= lend_vertex(front,
                                brick * INCODE_BRICK_POINTS +
                                    (uint32_t)__builtin_ctzll(vertices),
                                loan);
    }
    front->exchange.lent += loan->count > 0;
    return loan->count > 0;
}

/* ---- what is found ---- */

bool incode_found_is_sound(const struct incode_found *found, uint32_t bricks) {
    bool sound = found->count <= INCODE_LOAN_FACES;
    for (uint32_t i = 0; sound && i < found->count; i++) {
        const uint32_t *v = found->v[i];
        for (int k = 0; k < 4; k++) {
            bool none = k == 3 && v[k] == INCODE_NONE;
            sound = sound && (none || v[k] / INCODE_BRICK_POINTS < bricks);
            for (int j = 0; j < k; j++)
                sound = sound && v[j] != v[k];
        }
    }
    return sound;
}

/* Whether the face (v[0], v[1], v[2]) is open here. */
static bool is_open(const struct incode_front *front, const uint32_t v[3]) {
    unsigned turn;
    return incode_front_key(front, v, NULL, &turn) &&
           incode_afl_is_open(&front->afl, v[turn], v[(turn + 1) % 3],
                              v[(turn + 2) % 3]);
}

/* A fault that the simulation has to find: it counts, though it came late. */
static void plant(struct incode_front *front, const uint32_t v[4]) {
#ifdef INCODE_PLANT_LATE
    if (v[3] != INCODE_NONE)
        incode_front_seed(front, v, NOWHERE);
#else
    (void)front, (void)v;
#endif
}

uint32_t incode_front_use_found(struct incode_front *front,
                                const struct incode_found *found, uint32_t from,
                                uint32_t most) {
    uint32_t used = 0;
    for (; used < most && from + used < found->count && front->fault == NULL;
         used++) {
        const uint32_t *v = found->v[from + used];
        bool open = is_open(front, v);
        if (open && incode_front_use(front, v, NOWHERE))
            continue;
        front->counts.built++; /* in vain */
        front->counts.late++;
        plant(front, v);
    }
    return used;
}

/* ---- the end of a loan ---- */

static bool has_task(const struct incode_front *front, uint32_t v) {
    for (uint32_t left = front->busy; left != 0; left &= left - 1)
        if (front->task[__builtin_ctz(left)].v == v)
            return true;
    return false;
}

void incode_front_return(struct incode_front *front,
                         const struct incode_loan *loan) {
    INCODE_ASSERT(front->finished || front->exchange.lent > 0);
    if (front->finished)
        return;
    front->exchange.lent--;
    front->exchange.changes++; /* what is closed there has not been swept */
    for (uint32_t i = 0; i < loan->count; i++) {
        uint32_t v = loan->v[i][0], brick = v / INCODE_BRICK_POINTS;
        struct incode_touched *entry = incode_afl_find(&front->afl, brick);
        /* One that has been spilled and came back may be at work here. */
        if (entry == NULL || has_task(front, v))
            continue;
        entry->waiting &= ~(UINT64_C(1) << v % INCODE_BRICK_POINTS);
        incode_exchange_ready(front, v);
    }
}
