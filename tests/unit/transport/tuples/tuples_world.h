/* Places of a tuple space in one process, and messages between them that come
 * in order between any two, but late, and by links that are often full: all by
 * a seed. */
#ifndef TESTS_UNIT_TUPLES_WORLD_H
#define TESTS_UNIT_TUPLES_WORLD_H

#include <stdlib.h>
#include <string.h>

#include "transport/drivers/sim.h"
#include "transport/tuples/tuples.h"
#include "tests/unit/test.h"

enum { WORLD_PLACES = 16, WORLD_QUEUE = 4, WORLD_TURNS = 200000 };

struct world_message {
    uint16_t size;
    uint8_t data[TUPLES_HEADER_BYTES + TUPLES_TUPLE_MAX];
};

struct world;

struct world_place {
    struct world *world;
    uint16_t self;
};

struct world {
    unsigned places;
    uint64_t random;
    unsigned busy; /* of 8 writes, so many find no room */
    struct tuples *space[WORLD_PLACES];
    struct world_place place[WORLD_PLACES];
    struct {
        struct world_message messages[WORLD_QUEUE];
        unsigned first, count;
    } way[WORLD_PLACES][WORLD_PLACES];
    void *user; /* of functions that eval starts */
};

static inline uint32_t draw(struct world *w, uint32_t below) {
    return (uint32_t)(sim_draw(&w->random) >> 32) % below;
}

static inline int world_write(void *context, uint16_t place, const void *data,
                              size_t size) {
    struct world_place *from = context;
    struct world *w = from->world;
    assert_true(place < w->places && place != from->self);
    assert_true(size <= sizeof w->way[0][0].messages[0].data);
    if (w->way[from->self][place].count == WORLD_QUEUE || draw(w, 8) < w->busy)
        return -1;
    unsigned at =
        (w->way[from->self][place].first + w->way[from->self][place].count++) %
        WORLD_QUEUE;
    struct world_message *m = &w->way[from->self][place].messages[at];
    m->size = (uint16_t)size;
    memcpy(m->data, data, size);
    return 0;
}

static inline struct tuples_config usual_config(void) {
    struct tuples_config config = {0};
    config.operations = 3;
    config.tuple_bytes = TUPLES_TUPLE_MAX;
    config.store_bytes = 8000;
    return config;
}

static inline struct world *
new_world(unsigned places, const struct tuples_config *usual, uint64_t seed) {
    struct world *w = calloc(1, sizeof *w);
    assert_non_null(w);
    w->places = places;
    w->random = seed * 1000003 + 17;
    w->busy = draw(w, 5);
    for (unsigned i = 0; i < places; i++) {
        struct tuples_config config = *usual;
        w->place[i].world = w;
        w->place[i].self = (uint16_t)i;
        config.self = (uint16_t)i;
        config.places = (uint16_t)places;
        config.write = world_write;
        config.context = &w->place[i];
        size_t bytes = tuples_arena_bytes(&config);
        void *arena = malloc(bytes);
        if (bytes == 0 || arena == NULL) {
            fail();
            return NULL;
        }
        memset(arena, 0xa5, bytes);
        assert_null(tuples_init(arena, bytes - 1, &config, 1));
        w->space[i] = tuples_init(arena, bytes, &config, 1);
        assert_non_null(w->space[i]);
    }
    return w;
}

static inline void free_world(struct world *w) {
    for (unsigned i = 0; i < w->places; i++)
        free(w->space[i]);
    free(w);
}

/* The next message of one way comes, if there is one. */
static inline void deliver(struct world *w, unsigned from, unsigned to) {
    if (w->way[from][to].count > 0) {
        struct world_message *m =
            &w->way[from][to].messages[w->way[from][to].first];
        w->way[from][to].first = (w->way[from][to].first + 1) % WORLD_QUEUE;
        w->way[from][to].count--;
        assert_true(
            tuples_take(w->space[to], (uint16_t)from, m->data, m->size));
    }
}

static inline void turn(struct world *w) {
    for (unsigned i = 0; i < w->places; i++) {
        tuples_step(w->space[draw(w, w->places)]);
        for (unsigned k = draw(w, 4); k > 0; k--)
            deliver(w, draw(w, w->places), draw(w, w->places));
    }
}

static inline bool under_way(const struct world *w) {
    for (unsigned i = 0; i < w->places; i++) {
        for (unsigned j = 0; j < w->places; j++)
            if (w->way[i][j].count > 0)
                return true;
    }
    return false;
}

/* Until nothing moves, and nothing is owed that a busy link holds up. */
static inline void settle(struct world *w) {
    unsigned quiet = 0, busy = w->busy;
    w->busy = 0;
    for (unsigned turns = 0; quiet < 40; turns++) {
        assert_true(turns < WORLD_TURNS);
        unsigned moved = 0;
        for (unsigned i = 0; i < w->places; i++)
            moved += tuples_step(w->space[i]);
        moved += under_way(w);
        turn(w);
        quiet = moved > 0 ? 0 : quiet + 1;
    }
    w->busy = busy;
}

static inline uint32_t held(const struct world *w) {
    uint32_t count = 0;
    for (unsigned i = 0; i < w->places; i++)
        count += tuples_held(w->space[i]);
    return count;
}

/* Waits for an operation, and closes it; what it has got was small. */
static inline enum tuples_status finish(struct world *w, unsigned place,
                                        int operation, struct tuple *tuple) {
    enum tuples_status status = TUPLES_PENDING;
    assert_true(operation >= 0);
    for (unsigned turns = 0; status == TUPLES_PENDING; turns++) {
        assert_true(turns < WORLD_TURNS);
        turn(w);
        status = tuples_poll(w->space[place], operation, tuple);
    }
    tuples_close(w->space[place], operation);
    return status;
}

/* Two numbers, the first as a key or not; templates with one or the other left
 * open, or both. */
enum { OPEN = 100 };

static inline struct tuple pair_of(uint32_t a, uint32_t b, bool keyed) {
    struct tuple t = {.count = 2, .keyed = keyed};
    t.field[0] = a == OPEN ? TUPLE_FORMAL(TUPLE_TYPE_UINT32) : TUPLE_UINT32(a);
    t.field[1] = b == OPEN ? TUPLE_FORMAL(TUPLE_TYPE_UINT32) : TUPLE_UINT32(b);
    return t;
}

#endif
