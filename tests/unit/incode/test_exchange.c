/* Triangulators that share one active face list: whatever the order in which
 * they hear of each other, the triangulation is the same, each tetrahedron is
 * built once, and each brick is committed once. */

#include "host/mesh/gen.h"
#include "several.h"
#include "tests/unit/reference.h"
#include "tests/unit/test.h"

static void expect(const struct several *start, const struct host_points *p,
                   const char *digest, const char *name) {
    static struct several all;
    memcpy(&all, start, sizeof all);
    several_run(&all, p->xyz, p->count);
    if (strcmp(all.solo.digest.text, digest) != 0)
        fail_msg("%s, %u regions, index %d, seed %llu: %s, expected %s", name,
                 start->solo.regions, start->solo.index,
                 (unsigned long long)start->seed, all.solo.digest.text, digest);
    several_close(&all);
}

static void expect_all(const struct host_points *points, const char *name) {
    static const uint32_t counts[] = {1, 2, 4, 8, 16, 32};
    struct host_tetrahedra tets = {0};
    struct host_digest digest;
    static struct several start;
    uint64_t seed = 7;
    reference_delaunay(points->xyz, (uint32_t)points->count, &tets);
    host_tetrahedra_sort(&tets);
    host_digest(&tets, &digest);
    host_tetrahedra_free(&tets);
    for (unsigned k = 0; k < 24; k++) {
        seed = seed * UINT64_C(6364136223846793005) + 1442695040888963;
        memset(&start, 0, sizeof start);
        start.solo.index = k % 8 == 7   ? INCODE_NAIVE
                           : k % 8 == 3 ? INCODE_GRID
                                        : INCODE_KD;
        start.solo.regions = counts[k % 6];
        start.solo.partition = (enum host_partition)(seed % 3);
        start.solo.memory = seed >> 62 & 1 ? 0 : 1 << 20;
        start.solo.shuffle = seed >> 61 & 1 ? seed : 0;
        start.solo.chance = seed >> 60 & 1 ? seed : 0;
        start.solo.units = seed >> 59 & 1;
        start.solo.pressure = k % 4 == 1 ? 600 : 0;
        start.seed = seed | 1;
        start.one_by_one = seed >> 58 & 1;
        start.lends = k % 3 > 0;
        expect(&start, points, digest.text, name);
    }
}

TEST(made_sets) {
    static const char *const kinds[] = {
        "uniform", "bubbles", "bluntfin", "sphere", "grid", "rotated", "hub"};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct host_points points = {0};
        struct host_error error = {0};
        if (host_gen(kinds[i], 800, 5, &points, &error) != 0)
            fail_msg("%s", error.text);
        expect_all(&points, kinds[i]);
        host_points_free(&points);
    }
}

TEST(degenerate_sets) {
    static const char *const names[] = {
        "deg_cgal_T3_1",           "deg_cgal_grid5",
        "deg_cgal_nested_cubes",   "deg_mourner_orient3d_denormal",
        "deg_octahedron",          "deg_quickhull3d_issue2",
        "deg_spirula_60_thin_tet", "deg_trimesh_1446"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        struct host_points points = {0};
        char file[96];
        (void)snprintf(file, sizeof file, "%s.xyz", names[i]);
        if (!reference_data(file, &points)) {
            print_message("%s: not there\n", file);
            skip();
        }
        expect_all(&points, names[i]);
        host_points_free(&points);
    }
}

/* A share of what is built in vain, and how evenly it is spread: what the paper
 * repeated 1.34 times at 32 nodes, for 20,000 points. */
TEST(little_in_vain) {
    struct host_points points = {0};
    struct host_error error = {0};
    static struct several all;
    all = (struct several){.seed = 5,
                           .solo = {.index = INCODE_KD,
                                    .regions = 32,
                                    .partition = HOST_OWNED,
                                    .memory = 1 << 20}};
    if (host_gen("uniform", 20000, 5, &points, &error) != 0)
        fail_msg("%s", error.text);
    several_run(&all, points.xyz, points.count);
    assert_in_range(all.built, all.kept, all.kept + all.kept * 12 / 100);
    for (uint32_t i = 0; i < all.solo.regions; i++)
        assert_in_range(all.node[i].solo.t->front.counts.kept,
                        all.kept / 32 * 4 / 5, all.kept / 32 * 6 / 5);
    several_close(&all);
    host_points_free(&points);
}

/* Two nodes that have a half each of uniform points. */
static struct several two;
static struct host_points points_of_two;

static void begin(uint64_t points, uint64_t seed) {
    struct host_error error = {0};
    two = (struct several){.seed = seed,
                           .solo = {.index = INCODE_KD, .regions = 2}};
    if (host_gen("uniform", points, seed, &points_of_two, &error) != 0)
        fail_msg("%s", error.text);
    several_open(&two, points_of_two.xyz, points);
}

static void end(void) {
    several_close(&two);
    host_points_free(&points_of_two);
}

/* A tetrahedron that no other node can have sent is refused, and changes
 * nothing. */
TEST(refusals) {
    begin(500, 5);
    struct incode_triangulator *t = two.node[1].solo.t;
    uint32_t first = two.node[1].solo.job.first * INCODE_BRICK_POINTS;
    uint32_t past = two.solo.order.bricks * INCODE_BRICK_POINTS;
    const uint32_t wrong[][4] = {
        {first, first + 1, first + 2, first + 3}, /* its own */
        {0, 1, 2, 3},                             /* nothing to it */
        {0, first, first, first + 1},             /* a vertex twice */
        {0, first, first + 1, past},              /* no point */
        {first, first + 1, first + 2, INCODE_NONE}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_int_equal(incode_triangulator_take(t, wrong[i]), -1);
    assert_int_equal(t->front.afl.count, 0);
    several_work(&two);
    several_gather(&two);
    assert_int_equal(incode_triangulator_take(t, wrong[0]), -1);
    end();
}

/* A tetrahedron that comes twice is noticed. */
TEST(twice) {
    begin(500, 5);
    while (two.share_count == 0)
        (void)solo_step(&two.node[0].solo, 1);
    struct incode_triangulator *t = two.node[1].solo.t;
    const struct several_share share = two.share[0];
    assert_int_equal(share.to, 1);
    assert_int_equal(incode_triangulator_take(t, share.v), 0);
    assert_null(incode_triangulator_fault(t));
    (void)incode_triangulator_take(t, share.v);
    assert_non_null(incode_triangulator_fault(t));
    end();
}

static bool no_room(void *context, const struct incode_face *faces,
                    size_t count) {
    (void)context, (void)faces, (void)count;
    return false;
}

/* Where spilled faces have no room outside, what others send has to wait: it
 * may come later, and who sends it all the same is told that memory is not what
 * is wanting. */
TEST(waits_for_room) {
    begin(500, 5);
    while (two.share_count == 0)
        (void)solo_step(&two.node[0].solo, 1);
    struct incode_triangulator *t = two.node[1].solo.t;
    struct incode_front *front = &t->front;
    const struct incode_front_outside outside = front->outside;
    assert_true(incode_triangulator_may_take(t, INCODE_TAKEN_MAX));
    front->outside.spill = no_room;
    front->spill_count = INCODE_SPILL_FACES - 20; /* as if so many waited */
    assert_true(incode_triangulator_may_take(t, 2));
    assert_false(incode_triangulator_may_take(t, 3));
    front->spill_count = INCODE_SPILL_FACES - 6;
    assert_false(incode_triangulator_may_take(t, 1));
    assert_int_equal(incode_triangulator_take(t, two.share[0].v), 0);
    assert_non_null(strstr(incode_triangulator_fault(t), "no room"));
    assert_null(strstr(incode_triangulator_fault(t), "more memory"));
    front->fault = NULL;
    front->spill_count = 0;
    front->outside = outside;
    several_work(&two);
    several_gather(&two);
    end();
}

static bool not_now(void *context, uint32_t brick) {
    (void)context, (void)brick;
    return false;
}

/* A node that cannot ask for what is spilled, however long, is not quiet. */
TEST(waits_to_ask) {
    begin(900, 7);
    struct solo *solo = &two.node[1].solo;
    struct incode_front *front = &solo->t->front;
    const struct incode_front_outside outside = front->outside;
    while (!incode_triangulator_is_quiet(solo->t))
        (void)solo_step(solo, 1);
    front->outside.unspill = not_now;
    front->spill_from = front->bricks - 1; /* as if the last were away */
    front->exchange.quiet = false;
    for (uint32_t i = 0; i < 2 * front->bricks + 2; i++) {
        (void)solo_step(solo, 1);
        assert_false(incode_triangulator_is_quiet(solo->t));
    }
    front->outside = outside;
    front->spill_from = front->bricks;
    several_work(&two);
    several_gather(&two);
    end();
}

/* Sends the last node what it is to hear of, as long as it has fewer faces than
 * so many: what has the vertex, or, without one, every other one, so that few
 * of the faces close. */
static void tell_last(struct several *all, uint32_t vertex, uint32_t faces) {
    uint32_t last = all->solo.regions - 1;
    struct incode_triangulator *t = all->node[last].solo.t;
    for (size_t i = all->share_count; i-- > 0 && t->front.afl.count < faces;) {
        const struct several_share share = all->share[i];
        if (share.to != last || (vertex == INCODE_NONE && i % 2 != 0) ||
            !incode_triangulator_may_take(t, 1) ||
            (vertex != INCODE_NONE && share.v[0] != vertex &&
             share.v[1] != vertex && share.v[2] != vertex &&
             share.v[3] != vertex))
            continue;
        all->share[i] = all->share[--all->share_count];
        assert_int_equal(incode_triangulator_take(t, share.v), 0);
    }
}

/* A lattice of a plane and a point beside it, which the last node hears of from
 * lower ones.  What they send opens more faces than there is room for, all in
 * bricks before the one at work: those are spilled, too. */
TEST(spills_before_work) {
    enum { SIDE = 72, POINTS = SIDE * SIDE + 1, PRESSURE = 300 };
    static double xyz[POINTS][3];
    static struct several all;
    struct solo solo = {.index = INCODE_KD,
                        .build = INCODE_BUILD_POINTS,
                        .regions = 1,
                        .memory = 16 << 20};
    for (int i = 0; i < SIDE * SIDE; i++) {
        const int row = i / SIDE, column = i % SIDE;
        xyz[i][0] = row;
        xyz[i][1] = column;
        xyz[i][2] = 3 * xyz[i][0] + 5 * xyz[i][1];
    }
    xyz[SIDE * SIDE][0] = xyz[SIDE * SIDE][1] = SIDE / 2.;
    xyz[SIDE * SIDE][2] = 5 * SIDE;
    solo_run(&solo, xyz[0], POINTS);
    all = (struct several){
        .seed = 5,
        .solo = {.index = INCODE_KD, .regions = 4, .pressure = PRESSURE}};
    several_open(&all, xyz[0], POINTS);
    struct solo *last = &all.node[3].solo;
    struct incode_front *front = &last->t->front;
    for (int i = 0; i < 30000; i++)
        (void)solo_step(&all.node[i % 3].solo, 1);
    while (front->current + 1 < last->job.last - last->job.first) {
        (void)solo_step(last, 1);
        tell_last(&all, last->job.first * INCODE_BRICK_POINTS, PRESSURE / 2);
    }
    tell_last(&all, INCODE_NONE, 4 * PRESSURE);
    assert_in_range(front->afl.count, 3 * PRESSURE, 4 * PRESSURE + 4);
    several_work(&all);
    several_gather(&all);
    assert_string_equal(all.solo.digest.text, solo.digest.text);
    several_close(&all);
    solo_close(&solo);
}
