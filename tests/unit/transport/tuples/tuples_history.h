/* Several callers of a tuple space at once, each with a few calls, and whether
 * what they saw can be explained: some interleaving of their calls, in which
 * none stands before a call that had ended when it began, has the same results
 * in a plain list (Herlihy and Wing, 1990). */
#ifndef TESTS_UNIT_TUPLES_HISTORY_H
#define TESTS_UNIT_TUPLES_HISTORY_H

#include "tuples_world.h"

enum {
    CALLERS_MAX = 4,
    CALLS_MAX = 5,
    VALUES = 2, /* of either number */
    CALL_OUT = 0,
    CALL_IN,
    CALL_RD,
    CALL_INP,
    CALL_RDP,
    CALLS
};

#define NEVER UINT32_MAX

struct call {
    uint8_t verb;
    bool keyed;
    uint32_t a, b;         /* given; OPEN: formal */
    bool none;             /* the answer was no */
    uint32_t has[2];       /* or this */
    uint32_t began, ended; /* turns; NEVER: it still waits */
};

struct history {
    unsigned callers, calls;
    struct call call[CALLERS_MAX][CALLS_MAX];
    uint32_t stored; /* tuples at the end, in all places */
};

/* --- playing -------------------------------------------------------------- */

static inline int begin_call(struct world *w, unsigned place,
                             const struct call *c) {
    struct tuple t = pair_of(c->a, c->b, c->keyed);
    struct tuples *space = w->space[place];
    int number = c->verb == CALL_OUT   ? tuples_out(space, &t)
                 : c->verb == CALL_IN  ? tuples_in(space, &t)
                 : c->verb == CALL_RD  ? tuples_rd(space, &t)
                 : c->verb == CALL_INP ? tuples_inp(space, &t)
                                       : tuples_rdp(space, &t);
    return number;
}

static inline void draw_calls(struct world *w, struct history *h) {
    unsigned outs = 2 + draw(w, 4);
    for (unsigned i = 0; i < h->callers; i++) {
        for (unsigned k = 0; k < h->calls; k++) {
            struct call *c = &h->call[i][k];
            bool puts = draw(w, 8) < outs;
            c->verb = puts ? CALL_OUT : (uint8_t)(1 + draw(w, CALLS - 1));
            c->a = puts || draw(w, 2) ? draw(w, VALUES) : OPEN;
            c->b = puts || draw(w, 2) ? draw(w, VALUES) : OPEN;
            c->keyed = draw(w, 2);
            c->began = c->ended = NEVER;
        }
    }
}

static inline bool end_call(struct world *w, unsigned place, int number,
                            struct call *c, uint32_t now) {
    struct tuple t;
    enum tuples_status status = tuples_poll(w->space[place], number, &t);
    if (status == TUPLES_PENDING)
        return false;
    c->ended = now;
    c->none = status == TUPLES_NO;
    if (status == TUPLES_DONE && c->verb != CALL_OUT) {
        c->has[0] = t.field[0].as.uint32;
        c->has[1] = t.field[1].as.uint32;
    }
    tuples_close(w->space[place], number);
    return true;
}

/* Callers may share a place.  Ends when nothing moves any more. */
static inline void play(struct history *h, uint64_t seed) {
    struct tuples_config config = usual_config();
    unsigned next[CALLERS_MAX] = {0}, quiet = 0;
    int number[CALLERS_MAX];
    memset(h, 0, sizeof *h);
    config.operations = CALLERS_MAX + 4; /* those that owe a word yet */
    config.tuple_bytes = TUPLES_PATTERN_MAX;
    config.store_bytes = seed % 3 == 0 ? 80 : 2000;
    struct world *w = new_world(1 + (unsigned)(seed % 4), &config, seed);
    h->callers = 2 + draw(w, CALLERS_MAX - 1);
    h->calls = 2 + draw(w, CALLS_MAX - 1);
    draw_calls(w, h);
    memset(number, -1, sizeof number);
    for (uint32_t now = 0; quiet < 300; now += 2) {
        turn(w);
        quiet = under_way(w) ? 0 : quiet + 1;
        for (unsigned i = 0; i < h->callers; i++) {
            struct call *c = &h->call[i][next[i]];
            unsigned place = i % w->places;
            if (next[i] == h->calls)
                continue;
            if (number[i] < 0 && draw(w, 4) == 0) {
                number[i] = begin_call(w, place, c);
                c->began = number[i] < 0 ? NEVER : now + 1;
                quiet = 0;
            } else if (number[i] >= 0 &&
                       end_call(w, place, number[i], c, now)) {
                number[i] = -1;
                next[i]++;
                quiet = 0;
            }
        }
    }
    for (unsigned i = 0; i < w->places; i++) {
        const struct tuples_statistics *s = tuples_statistics(w->space[i]);
        h->stored += (uint32_t)(s->stored - s->taken);
    }
    free_world(w);
}

/* --- explaining ----------------------------------------------------------- */

struct explainer {
    const struct history *h;
    unsigned done[CALLERS_MAX]; /* calls that are made, of each */
    int there[VALUES][VALUES];  /* tuples */
    uint8_t seen[(CALLS_MAX + 1) * (CALLS_MAX + 1) * (CALLS_MAX + 1) *
                 (CALLS_MAX + 1)];
};

static inline bool is_there(const struct explainer *e, const struct call *c) {
    for (uint32_t a = 0; a < VALUES; a++) {
        for (uint32_t b = 0; b < VALUES; b++)
            if (e->there[a][b] > 0 && (c->a == OPEN || c->a == a) &&
                (c->b == OPEN || c->b == b))
                return true;
    }
    return false;
}

/* Whether the call, made now, has the result that was seen. */
static inline bool fits(const struct explainer *e, const struct call *c) {
    if (c->verb == CALL_OUT)
        return true;
    if (c->none)
        return (c->verb == CALL_INP || c->verb == CALL_RDP) && !is_there(e, c);
    return c->has[0] < VALUES && c->has[1] < VALUES &&
           (c->a == OPEN || c->a == c->has[0]) &&
           (c->b == OPEN || c->b == c->has[1]) &&
           e->there[c->has[0]][c->has[1]] > 0;
}

static inline void make_call(struct explainer *e, const struct call *c,
                             int sign) {
    if (c->verb == CALL_OUT)
        e->there[c->a][c->b] += sign;
    else if (!c->none && (c->verb == CALL_IN || c->verb == CALL_INP))
        e->there[c->has[0]][c->has[1]] -= sign;
}

/* The next of a caller that has ended, or NULL. */
static inline const struct call *next_of(const struct explainer *e,
                                         unsigned i) {
    const struct call *c = &e->h->call[i][e->done[i]];
    return e->done[i] == e->h->calls || c->ended == NEVER ? NULL : c;
}

/* All that have ended are made: nobody waits for what is there, and nothing is
 * there that should not be.  An out that waits for room has not put any. */
static inline bool ends_well(const struct explainer *e) {
    int count = 0;
    for (unsigned i = 0; i < e->h->callers; i++) {
        const struct call *c = &e->h->call[i][e->done[i]];
        if (next_of(e, i) != NULL ||
            (e->done[i] < e->h->calls && c->verb != CALL_OUT && is_there(e, c)))
            return false;
    }
    for (unsigned i = 0; i < VALUES * VALUES; i++)
        count += e->there[i / VALUES][i % VALUES];
    return count == (int)e->h->stored;
}

static inline bool explain(struct explainer *e) {
    unsigned set = 0;
    for (unsigned i = 0; i < CALLERS_MAX; i++)
        set = set * (CALLS_MAX + 1) + e->done[i];
    if (e->seen[set])
        return false;
    e->seen[set] = 1;
    for (unsigned i = 0; i < e->h->callers; i++) {
        const struct call *c = next_of(e, i);
        bool first = c != NULL && fits(e, c);
        for (unsigned j = 0; j < e->h->callers && first; j++) {
            const struct call *other = next_of(e, j);
            first = j == i || other == NULL || other->ended > c->began;
        }
        if (!first)
            continue;
        make_call(e, c, 1);
        e->done[i]++;
        if (explain(e))
            return true;
        e->done[i]--;
        make_call(e, c, -1);
    }
    return ends_well(e);
}

static inline bool is_explained(const struct history *h) {
    struct explainer *e = calloc(1, sizeof *e);
    assert_non_null(e);
    e->h = h;
    bool sound = explain(e);
    free(e);
    return sound;
}

#endif
