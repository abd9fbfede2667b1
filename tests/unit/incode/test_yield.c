/* How much a triangulator works between two calls of who looks after other
 * things, on sets that are hard for one part of it or another. */

#include "host/mesh/gen.h"
#include "solo.h"
#include "tests/unit/incode/work_clock.h"
#include "tests/unit/test.h"

enum {
    ASKED = 64,  /* units, and INCODE_YIELD_OVER more: 25,600 instructions of a
                    Cortex-M7, of which a basic block has four or five */
    MOST = 10000 /* basic blocks */
};

struct looks {
    uint64_t count, at, last, most;
};

static uint32_t look(void *context) {
    struct looks *l = context;
    uint64_t blocks = work_blocks - l->last;
    if (l->count > 0 && blocks > l->most) { /* before the first: the order */
        l->most = blocks;
        l->at = l->count;
    }
    l->count++;
    l->last = work_blocks;
    return ASKED;
}

static void holds(const char *kind, uint64_t n, uint8_t index, uint8_t build) {
    struct host_points points = {0};
    struct host_error error = {0};
    struct looks l = {.last = work_blocks};
    struct solo s = {.index = index,
                     .build = build,
                     .regions = 1,
                     .memory = 16 << 20,
                     .units = 1000,
                     .yield = {look, &l, 0}};
    if (host_gen(kind, n, 5, &points, &error) != 0)
        fail_msg("%s", error.text);
    solo_run(&s, points.xyz, points.count);
    assert_true(s.tets.count > 0);
    print_message("%s, %u points, index %u, build %u: %u looks, at most %u "
                  "blocks between two, before look %u\n",
                  kind, (unsigned)n, index, build, (unsigned)l.count,
                  (unsigned)l.most, (unsigned)l.at);
    assert_true(l.count > 10);
    assert_true(l.most < MOST);
    solo_close(&s);
    host_points_free(&points);
}

/* What the function asks is done, whatever it asks; and nobody need look. */
static uint32_t ask(void *context) {
    uint32_t *asked = context;
    return ++*asked;
}

TEST(test_yield_asks) {
    uint32_t asked = 0;
    struct incode_yield yield = {ask, &asked, 0}, none = {0};
    incode_yield_after(&yield, 1); /* nothing was allowed yet */
    assert_int_equal(asked, 1);
    incode_yield_after(&yield, 1);
    assert_int_equal(asked, 1);
    incode_yield_after(&yield, 1);
    assert_int_equal(asked, 2);
    for (int i = 0; i < 1000000; i++)
        incode_yield_after(&none, INCODE_YIELD_OVER);
}

TEST(test_yield_in_points) {
    holds("hub", 2001, INCODE_KD, INCODE_BUILD_POINTS);
    holds("grid", 2744, INCODE_KD, INCODE_BUILD_POINTS);
    holds("sphere", 1000, INCODE_KD, INCODE_BUILD_POINTS);
    holds("lines", 1000, INCODE_KD, INCODE_BUILD_POINTS);
    holds("scales", 300, INCODE_KD, INCODE_BUILD_POINTS);
    holds("uniform", 5000, INCODE_KD, INCODE_BUILD_POINTS);
}

TEST(test_yield_in_faces) {
    holds("hub", 2001, INCODE_KD, INCODE_BUILD_FACES);
    holds("grid", 2744, INCODE_KD, INCODE_BUILD_FACES);
    holds("sphere", 500, INCODE_KD, INCODE_BUILD_FACES);
    holds("uniform", 5000, INCODE_KD, INCODE_BUILD_FACES);
}

TEST(test_yield_in_searches) {
    holds("uniform", 1000, INCODE_NAIVE, INCODE_BUILD_FACES);
    holds("uniform", 2000, INCODE_GRID, INCODE_BUILD_FACES);
    holds("grid", 1000, INCODE_GRID, INCODE_BUILD_FACES);
}
