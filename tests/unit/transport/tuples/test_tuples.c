/* A tuple space and one caller, or callers whose order is known: exactly what
 * a plain list does. */
#include "tests/unit/emulated.h"
#include "tuples_world.h"

/* Of so many random programs, those that valgrind has the time for. */
static uint64_t seeds(uint64_t all) {
    return emulated() ? all / 5 : all;
}

/* --- the plain model: tuples in the order of their outs ------------------- */

enum { MODEL_MAX = 400 };

struct model {
    struct {
        uint32_t a, b;
        bool wide; /* another signature: the second number is an int64 */
    } tuples[MODEL_MAX];
    unsigned count;
};

static int model_find(const struct model *m, uint32_t a, uint32_t b,
                      bool wide) {
    for (unsigned i = 0; i < m->count; i++)
        if ((a == OPEN || a == m->tuples[i].a) &&
            (b == OPEN || b == m->tuples[i].b) && wide == m->tuples[i].wide)
            return (int)i;
    return -1;
}

static void model_drop(struct model *m, int at) {
    m->count--;
    memmove(&m->tuples[at], &m->tuples[at + 1],
            (m->count - (unsigned)at) * sizeof m->tuples[0]);
}

static struct tuple make(uint32_t a, uint32_t b, bool wide, bool keyed) {
    struct tuple t = pair_of(a, b, keyed);
    if (wide) {
        t.field[1] =
            b == OPEN ? TUPLE_FORMAL(TUPLE_TYPE_INT64) : TUPLE_INT64(b);
    }
    return t;
}

static uint32_t second(const struct tuple *t) {
    return t->field[1].type == TUPLE_TYPE_INT64 ? (uint32_t)t->field[1].as.int64
                                                : t->field[1].as.uint32;
}

static void put(struct world *w, struct model *m, unsigned caller) {
    uint32_t a = draw(w, 5), b = draw(w, 3);
    bool wide = draw(w, 4) == 0;
    struct tuple t = make(a, b, wide, draw(w, 2));
    if (m->count == MODEL_MAX)
        return;
    m->tuples[m->count].a = a;
    m->tuples[m->count].b = b;
    m->tuples[m->count++].wide = wide;
    assert_int_equal(finish(w, caller, tuples_out(w->space[caller], &t), &t),
                     TUPLES_DONE);
}

/* What was got: the oldest; or, where callers take turns, any that is there and
 * fits. */
static int model_got(const struct model *m, int oldest, const struct tuple *t,
                     bool wide, bool any) {
    uint32_t a = t->field[0].as.uint32, b = second(t);
    int got = any ? model_find(m, a, b, wide) : oldest;
    assert_true(got >= 0);
    assert_int_equal(a, m->tuples[got].a);
    assert_int_equal(b, m->tuples[got].b);
    assert_int_equal(t->field[1].type == TUPLE_TYPE_INT64, wide);
    return got;
}

static void ask(struct world *w, struct model *m, unsigned caller, bool any) {
    uint32_t a = draw(w, 2) ? draw(w, 5) : OPEN;
    uint32_t b = draw(w, 2) ? draw(w, 3) : OPEN;
    bool wide = draw(w, 4) == 0, takes = draw(w, 2);
    struct tuple pattern = make(a, b, wide, draw(w, 2)), t;
    struct tuples *space = w->space[caller];
    int found = model_find(m, a, b, wide), number;
    if (found >= 0 && draw(w, 2)) {
        number =
            takes ? tuples_in(space, &pattern) : tuples_rd(space, &pattern);
    } else {
        number =
            takes ? tuples_inp(space, &pattern) : tuples_rdp(space, &pattern);
    }
    enum tuples_status status = finish(w, caller, number, &t);
    assert_int_equal(status, found < 0 ? TUPLES_NO : TUPLES_DONE);
    if (found < 0)
        return;
    assert_true((a == OPEN || t.field[0].as.uint32 == a) &&
                (b == OPEN || second(&t) == b));
    found = model_got(m, found, &t, wide, any);
    if (takes)
        model_drop(m, found);
}

/* The caller stays at a place; or goes about, when all is said. */
static void random_program(unsigned places, bool roams, uint64_t seed) {
    struct tuples_config config = usual_config();
    struct model *m = calloc(1, sizeof *m);
    config.store_bytes = 20000;
    struct world *w = new_world(places, &config, seed);
    unsigned caller = draw(w, places), puts = 3 + draw(w, 5);
    assert_non_null(m);
    for (unsigned i = 0; i < 120; i++) {
        if (roams) {
            settle(w);
            caller = draw(w, places);
        }
        if (draw(w, 10) < puts)
            put(w, m, caller);
        else
            ask(w, m, caller, roams);
    }
    settle(w);
    assert_int_equal(held(w), m->count);
    while (m->count > 0)
        ask(w, m, caller, roams);
    settle(w);
    assert_int_equal(held(w), 0);
    free_world(w);
    free(m);
}

TEST(equals_model) {
    static const unsigned places[] = {1, 2, 3, 5, 16};
    for (uint64_t seed = 0; seed < seeds(40); seed++) {
        for (unsigned i = 0; i < 5; i++)
            random_program(places[i], false, seed);
        random_program(places[seed % 5], true, seed);
    }
}

/* --- fairness ------------------------------------------------------------- */

/* Callers that wait get what comes in the order in which they asked; copies
 * hold nobody up. */
TEST(first_come) {
    for (uint64_t seed = 0; seed < seeds(20); seed++) {
        struct tuples_config config = usual_config();
        struct world *w = new_world(6, &config, seed);
        struct tuple pattern = pair_of(1, OPEN, false), t;
        int numbers[5], reader = -1;
        for (unsigned i = 0; i < 5; i++) {
            if (i == 3) {
                reader = tuples_rd(w->space[5], &pattern);
                settle(w);
            }
            numbers[i] = tuples_in(w->space[i], &pattern);
            settle(w);
        }
        for (uint32_t i = 0; i < 5; i++) {
            t = pair_of(1, i, false);
            assert_int_equal(tuples_poll(w->space[5], reader, &t),
                             i > 3 ? TUPLES_DONE : TUPLES_PENDING);
            t = pair_of(1, i, false);
            assert_int_equal(finish(w, 5, tuples_out(w->space[5], &t), &t),
                             TUPLES_DONE);
            settle(w);
            assert_int_equal(finish(w, i, numbers[i], &t), TUPLES_DONE);
            assert_int_equal(t.field[1].as.uint32, i);
        }
        assert_int_equal(finish(w, 5, reader, &t), TUPLES_DONE);
        assert_int_equal(t.field[1].as.uint32, 3);
        settle(w);
        assert_int_equal(held(w), 0);
        free_world(w);
    }
}

/* --- a full space --------------------------------------------------------- */

enum { EACH = 60 };

static struct tuple bulky(uint32_t maker, uint32_t number, uint8_t *bytes,
                          unsigned size) {
    struct tuple t = pair_of(maker, number, false);
    memset(bytes, (int)(maker * 7 + number), size);
    t.count = 3;
    t.field[2] = TUPLE_BYTES(bytes, size);
    return t;
}

/* Makers put more than the store holds, and one takes it, slowly: nothing is
 * lost, and what one maker put one after the other comes so. */
static void push_back(uint64_t seed) {
    uint8_t bytes[1100];
    uint32_t made[4] = {0}, got[4] = {0}, refused = 0;
    int putting[4] = {-1, -1, -1, -1}, taking = -1;
    struct tuples_config config = usual_config();
    config.store_bytes = 2400;
    struct world *w = new_world(5, &config, seed);
    struct tuple pattern = pair_of(OPEN, OPEN, false), t;
    pattern.count = 3;
    pattern.field[2] = TUPLE_FORMAL(TUPLE_TYPE_BYTES);
    for (unsigned turns = 0; got[0] + got[1] + got[2] + got[3] < 4 * EACH;
         turns++) {
        assert_true(turns < WORLD_TURNS);
        turn(w);
        for (unsigned i = 0; i < 4; i++) {
            if (putting[i] >= 0 &&
                tuples_poll(w->space[i], putting[i], &t) == TUPLES_DONE) {
                tuples_close(w->space[i], putting[i]);
                putting[i] = -1;
            }
            if (putting[i] < 0 && made[i] < EACH) {
                unsigned size = 1 + draw(w, sizeof bytes);
                t = bulky(i, made[i]++, bytes, size);
                putting[i] = tuples_out(w->space[i], &t);
                assert_true(putting[i] >= 0);
            }
        }
        if (taking < 0 && draw(w, 20) == 0)
            taking = tuples_in(w->space[4], &pattern);
        if (taking >= 0 &&
            tuples_poll(w->space[4], taking, &t) == TUPLES_DONE) {
            uint32_t maker = t.field[0].as.uint32;
            assert_int_equal(t.field[1].as.uint32, got[maker]++);
            const uint8_t *at = t.field[2].as.bytes;
            assert_int_equal(at[t.field[2].size - 1],
                             (uint8_t)(maker * 7 + got[maker] - 1));
            tuples_close(w->space[4], taking);
            taking = -1;
        }
    }
    settle(w);
    for (unsigned i = 0; i < 4; i++)
        if (putting[i] >= 0)
            tuples_close(w->space[i], putting[i]);
    for (unsigned i = 0; i < 5; i++) {
        const struct tuples_statistics *s = tuples_statistics(w->space[i]);
        refused += (uint32_t)s->held_up;
        assert_true(s->store_high_water <= config.store_bytes);
        assert_int_equal(s->stored, s->taken);
    }
    assert_true(refused > EACH);
    assert_int_equal(held(w), 0);
    free_world(w);
}

TEST(pushes_back) {
    for (uint64_t seed = 0; seed < seeds(20); seed++)
        push_back(seed);
}

/* A large tuple is not overtaken for ever by small ones: who asked for room
 * first gets it first. */
TEST(room_in_order) {
    uint8_t bytes[1500] = {0};
    struct tuples_config config = usual_config();
    config.store_bytes = 1600;
    struct world *w = new_world(3, &config, 3);
    struct tuple pattern = {.count = 1}, t = {.count = 1};
    pattern.field[0] = TUPLE_FORMAL(TUPLE_TYPE_BYTES);
    t.field[0] = TUPLE_BYTES(bytes, 700);
    finish(w, 0, tuples_out(w->space[0], &t), &t);
    t.field[0] = TUPLE_BYTES(bytes, 1500);
    int large = tuples_out(w->space[0], &t);
    settle(w);
    t.field[0] = TUPLE_BYTES(bytes, 100);
    int small = tuples_out(w->space[1], &t);
    settle(w);
    assert_int_equal(tuples_poll(w->space[0], large, &t), TUPLES_PENDING);
    assert_int_equal(tuples_poll(w->space[1], small, &t), TUPLES_PENDING);
    static const unsigned sizes[] = {700, 1500, 100};
    for (unsigned i = 0; i < 3; i++) {
        assert_int_equal(finish(w, 2, tuples_in(w->space[2], &pattern), &t),
                         TUPLES_DONE);
        assert_int_equal(t.field[0].size, sizes[i]);
        settle(w);
    }
    tuples_close(w->space[0], large);
    tuples_close(w->space[1], small);
    assert_int_equal(held(w), 0);
    free_world(w);
}

/* --- generations ---------------------------------------------------------- */

static void drop_messages(struct world *w) {
    for (unsigned i = 0; i < w->places; i++)
        for (unsigned j = 0; j < w->places; j++)
            w->way[i][j].count = 0;
}

/* At any moment: all is empty, what was pending has ended, and the space is as
 * good as new.  Messages of before may still come. */
TEST(begins_anew) {
    for (uint64_t seed = 0; seed < seeds(60); seed++) {
        struct tuples_config config = usual_config();
        config.store_bytes = 1600;
        struct world *w = new_world(4, &config, seed);
        struct tuple t, pattern = pair_of(OPEN, OPEN, false);
        for (unsigned i = 0; i < 12; i++) {
            t = pair_of(draw(w, 4), draw(w, 4), draw(w, 2));
            unsigned place = draw(w, 4);
            int n = draw(w, 3) == 0 ? tuples_in(w->space[place], &pattern)
                                    : tuples_out(w->space[place], &t);
            assert_true(n >= 0 || n == TUPLES_BUSY);
            turn(w);
        }
        if (seed % 2)
            drop_messages(w);
        for (unsigned i = 0; i < 4; i++) {
            tuples_renew(w->space[i], 2);
            while (tuples_in(w->space[i], &pattern) != TUPLES_BUSY) {
            }
            tuples_renew(w->space[i], 3);
            for (int n = 0; n < 3; n++) {
                enum tuples_status s = tuples_poll(w->space[i], n, &t);
                assert_int_not_equal(s, TUPLES_PENDING);
                tuples_close(w->space[i], n);
            }
            assert_int_equal(tuples_held(w->space[i]), 0);
        }
        settle(w);
        assert_int_equal(finish(w, 1, tuples_rdp(w->space[1], &pattern), &t),
                         TUPLES_NO);
        t = pair_of(1, 2, true);
        finish(w, 2, tuples_out(w->space[2], &t), &t);
        assert_int_equal(finish(w, 1, tuples_in(w->space[1], &pattern), &t),
                         TUPLES_DONE);
        settle(w);
        assert_int_equal(held(w), 0);
        free_world(w);
    }
}

/* Whoever gives up gets nothing, and takes nothing from anybody. */
TEST(gives_up) {
    for (uint64_t seed = 0; seed < seeds(60); seed++) {
        struct tuples_config config = usual_config();
        struct world *w = new_world(5, &config, seed);
        struct tuple pattern = pair_of(OPEN, 7, false), t;
        int number = tuples_in(w->space[3], &pattern);
        t = pair_of((uint32_t)(seed % 5), 7, seed % 2);
        int out = tuples_out(w->space[1], &t);
        for (unsigned turns = draw(w, 12); turns > 0; turns--)
            turn(w);
        uint32_t before = tuples_poll(w->space[3], number, &t) == TUPLES_DONE;
        tuples_close(w->space[3], number);
        finish(w, 1, out, &t);
        settle(w);
        assert_int_equal(finish(w, 0, tuples_inp(w->space[0], &pattern), &t),
                         before ? TUPLES_NO : TUPLES_DONE);
        settle(w);
        assert_int_equal(held(w), 0);
        free_world(w);
    }
}

/* --- eval ----------------------------------------------------------------- */

/* Counts its number down, a step each, and says where it ran. */
static bool count_down(void *context, struct tuple *tuple) {
    const struct world_place *place = context;
    if (tuple->field[1].as.uint32 > 0) {
        tuple->field[1].as.uint32--;
        return false;
    }
    tuple->field[2] = TUPLE_UINT32(place->self);
    return true;
}

TEST(evaluates) {
    static tuples_function *const functions[] = {NULL, count_down};
    for (uint64_t seed = 0; seed < seeds(20); seed++) {
        unsigned places = 1 + (unsigned)(seed % 5), at[5] = {0};
        struct tuples_config config = usual_config();
        config.processes = 2;
        config.functions = functions;
        config.function_count = 2;
        struct world *w = new_world(places, &config, seed);
        struct tuple t = {.count = 3}, pattern;
        for (uint32_t i = 0; i < 12; i++) {
            t.field[0] = TUPLE_UINT32(i);
            t.field[1] = TUPLE_UINT32(30 - 2 * i);
            t.field[2] = TUPLE_UINT32(99);
            int number = tuples_eval(w->space[0], 1, &t);
            if (number == TUPLES_BUSY)
                i--;
            else
                tuples_close(w->space[0], number);
            turn(w);
        }
        pattern = t;
        pattern.field[1] = TUPLE_UINT32(0);
        pattern.field[2] = TUPLE_FORMAL(TUPLE_TYPE_UINT32);
        for (uint32_t i = 0; i < 12; i++) {
            pattern.field[0] = TUPLE_UINT32(i);
            int number;
            while ((number = tuples_in(w->space[places - 1], &pattern)) < 0)
                turn(w);
            assert_int_equal(finish(w, places - 1, number, &t), TUPLES_DONE);
            at[t.field[2].as.uint32]++;
        }
        assert_int_equal(at[0], places == 1 ? 12 : 0);
        for (unsigned i = 1; i < places; i++)
            assert_true(at[i] * (places - 1) > 12 - places);
        settle(w);
        assert_int_equal(held(w), 0);
        free_world(w);
    }
}

/* --- limits, and what no place sends -------------------------------------- */

TEST(keeps_limits) {
    struct tuples_config config = usual_config();
    uint8_t bytes[TUPLES_TUPLE_MAX] = {0};
    struct world *w = new_world(2, &config, 1);
    struct tuple t = pair_of(OPEN, 1, false);
    assert_int_equal(tuples_out(w->space[0], &t), TUPLES_UNFIT);
    assert_int_equal(tuples_eval(w->space[0], 0, &t), TUPLES_UNFIT);
    t.count = 0;
    assert_int_equal(tuples_in(w->space[0], &t), TUPLES_UNFIT);
    t.count = 1;
    t.field[0] = TUPLE_BYTES(bytes, TUPLES_TUPLE_MAX - 4);
    assert_int_equal(tuples_out(w->space[0], &t), TUPLES_UNFIT);
    t.field[0] = TUPLE_BYTES(bytes, TUPLES_TUPLE_MAX - 5);
    assert_int_equal(tuples_in(w->space[0], &t), TUPLES_UNFIT);
    assert_int_equal(finish(w, 0, tuples_out(w->space[0], &t), &t),
                     TUPLES_DONE);
    t.field[0] = TUPLE_FORMAL(TUPLE_TYPE_BYTES);
    for (unsigned i = 0; i < 3; i++)
        assert_true(tuples_rd(w->space[0], &t) >= 0);
    assert_int_equal(tuples_rd(w->space[0], &t), TUPLES_BUSY);
    free_world(w);
    config.places = 1;
    assert_true(tuples_arena_bytes(&config) > 0);
    config.store_bytes = TUPLES_TUPLE_MAX;
    assert_int_equal(tuples_arena_bytes(&config), 0);
}

TEST(survives_nonsense) {
    struct tuples_config config = usual_config();
    uint8_t m[64];
    unsigned sound = 0;
    for (uint64_t seed = 0; seed < 300; seed++) {
        struct world *w = new_world(4, &config, seed);
        struct tuple t = pair_of(1, OPEN, false);
        tuples_in(w->space[0], &t);
        t = pair_of(2, 2, true);
        tuples_out(w->space[0], &t);
        for (unsigned i = 0; i < 60; i++) {
            memset(m, 0, sizeof m);
            t = pair_of(draw(w, 3), draw(w, 3) ? draw(w, 3) : OPEN, draw(w, 2));
            size_t size = draw(w, 2) ? tuple_write(&t, m + 20, 44) : 0;
            m[0] = (uint8_t)draw(w, 12);
            m[1] = (uint8_t)draw(w, 16);
            m[2] = (uint8_t)draw(w, 4);
            m[4] = (uint8_t)draw(w, 3);
            m[8] = 1;
            m[draw(w, 64)] ^= (uint8_t)(draw(w, 8) ? 0 : 1 << draw(w, 8));
            sound += tuples_take(w->space[0], (uint16_t)draw(w, 5), m,
                                 size + 20 - (draw(w, 9) == 0));
            tuples_step(w->space[0]);
        }
        free_world(w);
    }
    assert_true(sound > 300);
}
