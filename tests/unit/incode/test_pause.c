/* How long a triangulator works between two calls of who looks after other
 * things, on sets that are hard for one part of it or another.  The clock is
 * the thread's own; what is done between two calls is the same in each run, so
 * that the least of some runs is what it takes. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <time.h>

#include <cmocka.h>

#include "host/mesh/gen.h"
#include "solo.h"

enum {
    RUNS = 4,
    /* Of filtered in_spheres, as long as which may pass, with what the test
     * itself does with what is found: a star of 2,000 faces in one piece takes
     * three times as long. */
    MOST = 30000,
    ASKED = 64,
    LOOKS_MAX = 1 << 18,
    CALIBRATION = 200000
};

static uint64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

/* What passed before each look, the least of the runs so far. */
struct looks {
    uint32_t *gap_ns, count;
    uint64_t last_ns;
};

static uint32_t look(void *context)
{
    struct looks *l = context;
    uint64_t gap = now_ns() - l->last_ns;
    assert_true(l->count < LOOKS_MAX);
    if (gap < l->gap_ns[l->count])
        l->gap_ns[l->count] = (uint32_t)gap;
    l->count++;
    l->last_ns = now_ns();
    return ASKED;
}

/* Of one in_sphere that its filter decides. */
static double in_sphere_ns(void)
{
    static const double p[5][3] = {
        {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.3, 0.3, 0.3}};
    struct incode_tally tally = {0};
    double least = INFINITY;
    for (int run = 0; run < RUNS; run++) {
        uint64_t start = now_ns();
        int inside = 0;
        for (int i = 0; i < CALIBRATION; i++)
            inside += incode_in_sphere(&tally, p[0], p[2], p[1], p[3], p[4]);
        double each = (double)(now_ns() - start) / CALIBRATION;
        assert_int_equal(abs(inside), CALIBRATION);
        least = each < least ? each : least;
    }
    return least;
}

static void run_once(struct looks *l, const struct host_points *points,
                     uint8_t index, uint8_t build)
{
    struct solo s = {.index = index,
                     .build = build,
                     .regions = 1,
                     .memory = 16 << 20,
                     .units = 1000,
                     .pause = {look, l, 0}};
    l->count = 0;
    l->last_ns = now_ns();
    solo_run(&s, points->xyz, points->count);
    assert_true(s.tets.count > 0);
    solo_close(&s);
}

static void holds(const char *kind, uint64_t n, uint8_t index, uint8_t build)
{
    struct host_points points = {0};
    struct host_error error = {0};
    struct looks l = {malloc(LOOKS_MAX * sizeof *l.gap_ns), 0, 0};
    double unit = in_sphere_ns();
    uint32_t most = 0, at = 0;
    assert_non_null(l.gap_ns);
    memset(l.gap_ns, 0xff, LOOKS_MAX * sizeof *l.gap_ns);
    if (host_gen(kind, n, 5, &points, &error) != 0)
        fail_msg("%s", error.text);
    for (int run = 0; run < RUNS; run++)
        run_once(&l, &points, index, build);
    for (uint32_t i = 1; i < l.count; i++) { /* before the first: the order */
        at = l.gap_ns[i] > most ? i : at;
        most = l.gap_ns[i] > most ? l.gap_ns[i] : most;
    }
    print_message("%s, %u points, index %u, build %u: %u looks, at most %.0f "
                  "in_spheres between two, before look %u\n",
                  kind, (unsigned)n, index, build, l.count, (double)most / unit,
                  at);
    assert_true(l.count > 10);
    assert_true(most < MOST * unit);
    host_points_free(&points);
    free(l.gap_ns);
}

/* What the function asks is done, whatever it asks; and nobody need look. */
static uint32_t ask(void *context)
{
    uint32_t *asked = context;
    return ++*asked;
}

static void test_pause_asks(void **state)
{
    uint32_t asked = 0;
    struct incode_pause pause = {ask, &asked, 0}, none = {0};
    (void)state;
    incode_breathe(&pause, 1); /* nothing was allowed yet */
    assert_int_equal(asked, 1);
    incode_breathe(&pause, 1);
    assert_int_equal(asked, 1);
    incode_breathe(&pause, 1);
    assert_int_equal(asked, 2);
    for (int i = 0; i < 1000000; i++)
        incode_breathe(&none, INCODE_PAUSE_OVER);
}

static void test_pause_in_points(void **state)
{
    (void)state;
    holds("hub", 2001, INCODE_KD, INCODE_BUILD_POINTS);
    holds("grid", 2744, INCODE_KD, INCODE_BUILD_POINTS);
    holds("sphere", 1000, INCODE_KD, INCODE_BUILD_POINTS);
    holds("lines", 1000, INCODE_KD, INCODE_BUILD_POINTS);
    holds("scales", 300, INCODE_KD, INCODE_BUILD_POINTS);
    holds("uniform", 5000, INCODE_KD, INCODE_BUILD_POINTS);
}

static void test_pause_in_faces(void **state)
{
    (void)state;
    holds("hub", 2001, INCODE_KD, INCODE_BUILD_FACES);
    holds("grid", 2744, INCODE_KD, INCODE_BUILD_FACES);
    holds("sphere", 500, INCODE_KD, INCODE_BUILD_FACES);
    holds("uniform", 5000, INCODE_KD, INCODE_BUILD_FACES);
}

static void test_pause_in_searches(void **state)
{
    (void)state;
    holds("uniform", 1000, INCODE_NAIVE, INCODE_BUILD_FACES);
    holds("uniform", 2000, INCODE_GRID, INCODE_BUILD_FACES);
    holds("grid", 1000, INCODE_GRID, INCODE_BUILD_FACES);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pause_asks),
        cmocka_unit_test(test_pause_in_points),
        cmocka_unit_test(test_pause_in_faces),
        cmocka_unit_test(test_pause_in_searches),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
