/* Tuples as bytes: what is written is read, whatever its fields; nothing else
 * is read; and templates match what they say. */

#include "transport/drivers/sim.h"
#include "transport/tuples/tuples.h"
#include "tests/unit/test.h"

static uint64_t random_state = 5;

static uint32_t draw(uint32_t below) {
    return (uint32_t)(sim_draw(&random_state) >> 32) % below;
}

static const uint8_t text[] = "the faces of a job";

static struct tuple_field drawn_field(void) {
    static const double reals[] = {0.0, -0.0, 1.5, 1e300};
    switch (1 + draw(TUPLE_TYPE_LAST)) {
    case TUPLE_TYPE_INT32:
        return TUPLE_INT32(-(int32_t)draw(3));
    case TUPLE_TYPE_UINT32:
        return TUPLE_UINT32(UINT32_MAX - draw(3));
    case TUPLE_TYPE_INT64:
        return TUPLE_INT64(INT64_MIN + draw(3));
    case TUPLE_TYPE_DOUBLE:
        return TUPLE_DOUBLE(reals[draw(4)]);
    default:
        return TUPLE_BYTES(text, draw(sizeof text));
    }
}

static struct tuple drawn_tuple(void) {
    struct tuple t = {.count = (uint8_t)(1 + draw(3)), .keyed = draw(2)};
    for (unsigned i = 0; i < t.count; i++)
        t.field[i] = drawn_field();
    return t;
}

static bool same_value(const struct tuple_field *a,
                       const struct tuple_field *b) {
    switch (a->type) {
    case TUPLE_TYPE_INT32:
        return a->as.int32 == b->as.int32;
    case TUPLE_TYPE_UINT32:
        return a->as.uint32 == b->as.uint32;
    case TUPLE_TYPE_INT64:
        return a->as.int64 == b->as.int64;
    case TUPLE_TYPE_DOUBLE: { /* by their bytes */
        uint64_t bits[2];
        memcpy(&bits[0], &a->as.real, sizeof bits[0]);
        memcpy(&bits[1], &b->as.real, sizeof bits[1]);
        return bits[0] == bits[1];
    }
    default:
        return a->size == b->size &&
               memcmp(a->as.bytes, b->as.bytes, a->size) == 0;
    }
}

/* As TUPLES.md has it. */
static bool should_match(const struct tuple *pattern,
                         const struct tuple *tuple) {
    bool match = pattern->count == tuple->count;
    for (unsigned i = 0; match && i < tuple->count; i++) {
        const struct tuple_field *p = &pattern->field[i];
        match = p->type == tuple->field[i].type &&
                (p->formal || same_value(p, &tuple->field[i]));
    }
    return match;
}

TEST(round_trip) {
    uint8_t bytes[200];
    for (unsigned i = 0; i < 20000; i++) {
        struct tuple t = drawn_tuple(), back;
        size_t size = tuple_write(&t, bytes, sizeof bytes);
        assert_true(size > 0);
        assert_int_equal(tuple_write(&t, bytes, size - 1), 0);
        assert_int_equal(tuple_write(&t, bytes, size), size);
        assert_true(tuple_read(&back, bytes, size));
        assert_true(should_match(&t, &back));
        assert_int_equal(back.keyed, t.keyed);
        assert_false(tuple_read(&back, bytes, size - 1));
        assert_false(tuple_read(&back, bytes, size + 1));
    }
}

TEST(matches) {
    uint8_t a[200], b[200];
    unsigned matched = 0;
    for (unsigned i = 0; i < 100000; i++) {
        struct tuple t = drawn_tuple(), pattern = draw(4) ? t : drawn_tuple();
        for (unsigned k = 0; k < pattern.count; k++) {
            if (draw(4) == 0)
                pattern.field[k] = drawn_field();
            pattern.field[k].formal = draw(3) == 0;
        }
        assert_true(tuple_write(&t, a, sizeof a) > 0);
        assert_true(tuple_write(&pattern, b, sizeof b) > 0);
        bool match = tuple_matches(b, a);
        assert_int_equal(match, should_match(&pattern, &t));
        assert_int_equal(tuple_begins_formal(b), pattern.field[0].formal);
        if (match) {
            assert_int_equal(tuple_signature(a), tuple_signature(b));
            assert_true(pattern.field[0].formal ||
                        tuple_key(a) == tuple_key(b));
        }
        matched += match;
    }
    assert_true(matched > 10000);
}

/* Keys and signatures go to all places alike. */
TEST(spreads) {
    unsigned count[7] = {0};
    uint8_t bytes[20];
    for (uint32_t i = 0; i < 7000; i++) {
        struct tuple t = {.count = 1, .field = {TUPLE_UINT32(i)}};
        assert_true(tuple_write(&t, bytes, sizeof bytes) > 0);
        count[tuple_key(bytes) % 7]++;
    }
    for (unsigned i = 0; i < 7; i++)
        assert_true(count[i] > 850 && count[i] < 1150);
}
