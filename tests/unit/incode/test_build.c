/* Which way a triangulator goes, and what stays of a job when the next one goes
 * another way: memory, pages, spilled faces, counts. */

#include "host/mesh/gen.h"
#include "solo.h"
#include "tests/unit/emulated.h"
#include "tests/unit/test.h"

static void made(const char *kind, uint64_t n, struct host_points *points) {
    struct host_error error = {0};
    if (host_gen(kind, n, 5, points, &error) != 0)
        fail_msg("%s", error.text);
}

/* What a set comes to, face by face. */
static struct host_digest right(const struct host_points *points) {
    struct solo s = {.index = INCODE_KD,
                     .build = INCODE_BUILD_FACES,
                     .regions = 1,
                     .memory = 4 << 20};
    solo_run(&s, points->xyz, points->count);
    struct host_digest digest = s.digest;
    assert_int_equal(s.by_points, 0);
    solo_close(&s);
    return digest;
}

/* ---- the choice ---- */

TEST(what_is_chosen) {
    static const struct {
        const char *kind;
        unsigned points;
        uint8_t build, index, rule;
        unsigned regions, memory; /* KiB */
        bool some, all;           /* by points */
    } cases[] = {
        /* All bricks its own. */
        {"uniform", 2000, INCODE_BUILD_AUTO, INCODE_KD, 0, 1, 4096, true, true},
        {"sphere", 2000, INCODE_BUILD_AUTO, INCODE_KD, 0, 1, 4096, true, true},
        {"uniform", 2000, INCODE_BUILD_FACES, INCODE_KD, 0, 1, 4096, false,
         false},
        /* Half of them. */
        {"uniform", 2000, INCODE_BUILD_AUTO, INCODE_KD, 0, 2, 4096, false,
         false},
        {"sphere", 4096, INCODE_BUILD_AUTO, INCODE_KD, 0, 2, 4096, true, true},
        {"sphere", 4096, INCODE_BUILD_FACES, INCODE_KD, 0, 2, 4096, false,
         false},
        {"uniform", 2000, INCODE_BUILD_POINTS, INCODE_KD, 0, 2, 4096, true,
         true},
        /* Less. */
        {"sphere", 4096, INCODE_BUILD_AUTO, INCODE_KD, 0, 8, 4096, true, true},
        {"terrain", 4096, INCODE_BUILD_AUTO, INCODE_KD, 0, 8, 4096, true, true},
        {"sphere", 4096, INCODE_BUILD_POINTS, INCODE_KD, 0, 8, 4096, true,
         true},
        /* More than fit. */
        {"uniform", 2500, INCODE_BUILD_AUTO, INCODE_KD, 0, 1, 640, true, true},
        {"terrain", 2500, INCODE_BUILD_AUTO, INCODE_KD, 0, 1, 640, true, true},
        {"sphere", 3500, INCODE_BUILD_AUTO, INCODE_KD, 0, 1, 640, true, true},
        /* Lines have more tetrahedra than is thought. */
        {"lines", 400, INCODE_BUILD_AUTO, INCODE_KD, 0, 1, 640, true, true},
        /* Other searches. */
        {"uniform", 500, INCODE_BUILD_POINTS, INCODE_NAIVE, 0, 1, 4096, 0, 0},
        {"uniform", 500, INCODE_BUILD_POINTS, INCODE_GRID, 0, 1, 4096, 0, 0},
        {"uniform", 500, INCODE_BUILD_AUTO, INCODE_KD, 1, 1, 4096, 0, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct host_points points = {0};
        made(cases[i].kind, cases[i].points, &points);
        struct host_digest expected = right(&points);
        for (uint64_t chance = 0; chance < 2; chance++) {
            struct solo s = {.index = cases[i].index,
                             .build = cases[i].build,
                             .face_rule = cases[i].rule,
                             .regions = cases[i].regions,
                             .memory = (size_t)cases[i].memory << 10,
                             .shuffle = chance,
                             .chance = chance};
            solo_run(&s, points.xyz, points.count);
            assert_string_equal(s.digest.text, expected.text);
            if ((s.by_points > 0) != cases[i].some ||
                (s.by_points == s.tets.count) != cases[i].all)
                fail_msg("case %zu: %llu by points", i,
                         (unsigned long long)s.by_points);
            solo_close(&s);
        }
        host_points_free(&points);
    }
}

/* Any memory, with everything else left to chance. */
TEST(each_memory) {
    struct host_points points = {0};
    made("bubbles", 2200, &points);
    struct host_digest expected = right(&points);
    unsigned by[2] = {0, 0};
    for (size_t k = 0; k < (SANITIZED ? 8 : 24); k++) {
        struct solo s = {.index = INCODE_KD,
                         .build =
                             k & 1 ? INCODE_BUILD_POINTS : INCODE_BUILD_AUTO,
                         .regions = k & 2 ? 2 : 1,
                         .memory = k < 2 ? 0 : (600 << 10) + (k << 15),
                         .shuffle = k % 3,
                         .chance = k % 5,
                         .false_start = k % 4 == 3,
                         .units = k % 3 == 1 ? 1 + (uint32_t)k : 0};
        solo_run(&s, points.xyz, points.count);
        assert_string_equal(s.digest.text, expected.text);
        by[s.by_points > 0]++;
        solo_close(&s);
    }
    assert_true(by[0] > 1 && by[1] > 1);
    host_points_free(&points);
}

/* ---- from points to faces ---- */

/* Point by point with so many bytes for the triangulation, and with everything
 * else left to chance.  True: some went by points, and then others by faces. */
static bool in_room(const struct host_points *points, size_t room, uint32_t k,
                    const char *expected) {
    struct solo s = {.index = INCODE_KD,
                     .build = INCODE_BUILD_POINTS,
                     .regions = 1u << k % 7 / 3,
                     .memory = 2 << 20,
                     .shuffle = k % 3,
                     .chance = k % 4,
                     .pressure = k % 5 < 2 ? 700 : 0,
                     .units = k % 6 == 1 ? 1 + k % 100 : 0};
    struct host_digest digest;
    solo_open(&s, points->xyz, points->count);
    struct incode_maker_share few = s.t->shares.maker;
    few.frames = INCODE_FRAMES_MIN;
    s.t->bytes = incode_maker_bytes(&few) + INCODE_INSERTION_LEAST + room;
    for (uint32_t r = 0; r < s.regions; r++)
        solo_region(&s, r);
    struct incode_statistics stats;
    incode_triangulator_statistics(s.t, &stats);
    assert_in_range(stats.memory_high_water, 1, s.memory);
    for (size_t i = 0; i < SOLO_GUARD; i++)
        assert_int_equal(s.arena[s.memory + i], 0xa5);
    uint64_t built = s.tets.count, by_points = stats.tetrahedra_by_points;
    host_tetrahedra_map(&s.tets, s.order.row);
    host_tetrahedra_sort(&s.tets);
    host_digest(&s.tets, &digest);
    if (strcmp(digest.text, expected) != 0)
        fail_msg("%zu bytes, k = %u: %s", room, k, digest.text);
    solo_close(&s);
    return by_points > 0 && by_points < built;
}

/* Memory of each size, so that it ends at any moment. */
TEST(handed_over) {
    static const struct {
        const char *kind;
        uint32_t points, step, most;
    } sets[] = {{"uniform", 900, 4000, 60000}, {"sphere", 400, 3000, 25000},
                {"lines", 120, 3000, 25000},   {"grid", 900, 4000, 60000},
                {"terrain", 900, 4000, 60000}, {"shell", 400, 3000, 25000},
                {"torus", 900, 4000, 75000},   {"bubbles", 900, 4000, 60000}};
    unsigned fallbacks = 0;
    for (size_t i = 0; i < sizeof sets / sizeof *sets; i++) {
        struct host_points points = {0};
        made(sets[i].kind, sets[i].points, &points);
        struct host_digest expected = right(&points);
        uint32_t step = sets[i].step * (SANITIZED ? 2 : 1), k = 0;
        for (size_t room = 1000 + 1500 * i; room < sets[i].most; room += step)
            fallbacks += in_room(&points, room, k++, expected.text);
        host_points_free(&points);
    }
    assert_true(fallbacks > (SANITIZED ? 12 : 30));
}

/* ---- one job after another ---- */

/* Begins bricks [first, last). */
static void begin(struct solo *s, uint32_t first, uint32_t last) {
    s->order.region[0].first = first;
    s->order.region[0].last = last;
    solo_start(s, 0);
}

/* Some of a job, which is then forgotten. */
static void leave(struct solo *s, uint32_t first, uint32_t last,
                  uint64_t steps) {
    uint64_t count = s->tets.count;
    begin(s, first, last);
    (void)solo_step(s, steps);
    host_tetrahedra_cut(&s->tets, count);
    memset(s->committed, 0, s->order.bricks);
}

/* A third goes by faces, all that there is by points; whichever is left, at
 * whatever step, with pages and spilled faces on their way, the next comes to
 * the right result. */
TEST(job_after_job) {
    struct host_points points = {0};
    made("uniform", 3000, &points);
    struct host_digest expected = right(&points);
    uint64_t spilled = 0;
    for (uint64_t k = 0; k < 60; k += SANITIZED ? 7 : 1) {
        uint64_t faces = k * k, inserted = k * (k % 5);
        struct solo s = {.index = INCODE_KD,
                         .regions = 1,
                         .memory = 4 << 20,
                         .shuffle = k % 3,
                         .chance = k,
                         .pressure = 500,
                         .units = k % 2};
        struct incode_statistics stats;
        struct host_digest digest;
        solo_open(&s, points.xyz, points.count);
        uint32_t all = s.order.bricks, cut = all / 3;
        leave(&s, 0, cut, faces);
        leave(&s, 0, all, inserted);
        leave(&s, cut, cut + cut, faces);
        incode_triangulator_statistics(s.t, &stats);
        assert_in_range(stats.memory_high_water, 1, s.memory);
        s.order.region[0].first = 0;
        s.order.region[0].last = k % 2 == 0 ? cut : all;
        solo_region(&s, 0);
        if (k % 2 == 0) {
            /* The rest is more than half, of a volume or not. */
            s.order.region[0].first = cut;
            s.order.region[0].last = all;
            solo_region(&s, 0);
        }
        incode_triangulator_statistics(s.t, &stats);
        spilled += stats.afl_spilled;
        if (k % 2 == 1)
            assert_true(stats.tetrahedra_by_points >= s.tets.count);
        assert_in_range(stats.memory_high_water, 1, s.memory);
        for (size_t i = 0; i < SOLO_GUARD; i++)
            assert_int_equal(s.arena[s.memory + i], 0xa5);
        host_tetrahedra_map(&s.tets, s.order.row);
        host_tetrahedra_sort(&s.tets);
        host_digest(&s.tets, &digest);
        assert_string_equal(digest.text, expected.text);
        solo_close(&s);
    }
    assert_true(spilled > 0);
    host_points_free(&points);
}

/* A spilled list that comes after its job was left is none that was asked for,
 * and what was the list's is another's. */
TEST(late_spilled_faces) {
    struct host_points points = {0};
    struct solo s = {
        .index = INCODE_KD, .regions = 1, .memory = 4 << 20, .pressure = 350};
    made("uniform", 3000, &points);
    struct host_digest expected = right(&points), digest;
    solo_open(&s, points.xyz, points.count);
    uint32_t all = s.order.bricks;
    begin(&s, 0, all * 2 / 5);
    for (int i = 0; s.wanted == INCODE_NONE; i++) {
        assert_in_range(i, 0, 1000000);
        if (incode_triangulator_step(s.t) == INCODE_WAITING &&
            s.wanted == INCODE_NONE)
            (void)solo_deliver(&s);
    }
    uint32_t wanted = s.wanted, v = wanted * INCODE_BRICK_POINTS;
    const struct incode_face face = {{v, v + 1, v + 2}};
    host_tetrahedra_cut(&s.tets, 0);
    memset(s.committed, 0, all);
    begin(&s, 0, all);
    assert_int_equal(incode_triangulator_unspill(s.t, wanted, &face, 1, false),
                     -1);
    (void)solo_step(&s, 30);
    assert_int_equal(incode_triangulator_unspill(s.t, wanted, &face, 1, true),
                     -1);
    assert_true(solo_step(&s, SOLO_STEPS));
    host_tetrahedra_map(&s.tets, s.order.row);
    host_tetrahedra_sort(&s.tets);
    host_digest(&s.tets, &digest);
    assert_string_equal(digest.text, expected.text);
    solo_close(&s);
    host_points_free(&points);
}

/* ---- memory ---- */

/* As much as the points take, and not what faces would. */
TEST(high_water) {
    struct incode_statistics before, after;
    struct host_points points = {0};
    struct solo s = {.index = INCODE_KD, .regions = 1, .memory = 32 << 20};
    made("uniform", 2000, &points);
    solo_open(&s, points.xyz, points.count);
    solo_region(&s, 0);
    incode_triangulator_statistics(s.t, &before);
    size_t cells = s.t->insertion.complex.cells * sizeof(struct incode_cell);
    assert_in_range(before.memory_high_water, cells, 3 << 20);
    /* The same again takes no more; by faces it does. */
    solo_region(&s, 0);
    incode_triangulator_statistics(s.t, &after);
    assert_int_equal(after.memory_high_water, before.memory_high_water);
    s.order.region[0].last = 2;
    solo_region(&s, 0);
    incode_triangulator_statistics(s.t, &after);
    assert_in_range(after.memory_high_water, 8 << 20, s.memory);
    before = after;
    s.order.region[0].last = s.order.bricks;
    solo_region(&s, 0);
    incode_triangulator_statistics(s.t, &after);
    assert_int_equal(after.memory_high_water, before.memory_high_water);
    solo_close(&s);
    host_points_free(&points);
}
