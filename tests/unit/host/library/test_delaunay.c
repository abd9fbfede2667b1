/* The library's way on several threads: regions alone, and their seams.  The
 * rows are those of one thread, which has one region and no seam. */
#include "tests/unit/test.h"

#include "host/library/delaunay.h"
#include "host/mesh/gen.h"
#include "host/mesh/points.h"

struct set {
    double *xyz;
    uint64_t count;
};

static void triangulate(const struct set *set, unsigned threads,
                        struct host_tetrahedra *tets) {
    struct host_call call = {.threads = threads, .memory_max = UINT64_MAX};
    struct host_error error = {0};
    host_call_enter(&call);
    assert_int_equal(host_delaunay(set->xyz, set->count, tets, &error), 0);
    host_call_enter(NULL);
    assert_true(call.memory >= tets->count * sizeof *tets->v);
}

/* Has several threads find what one does. */
static void check(const struct set *set, const unsigned *threads) {
    struct host_tetrahedra one = {0}, several;
    triangulate(set, 1, &one);
    assert_true(one.count > 0);
    for (; *threads != 0; threads++) {
        several = (struct host_tetrahedra){0};
        triangulate(set, *threads, &several);
        assert_int_equal(several.count, one.count);
        assert_memory_equal(several.v, one.v, one.count * sizeof *one.v);
        host_tetrahedra_free(&several);
    }
    host_tetrahedra_free(&one);
}

#define CHECK(set, ...) check((set), (const unsigned[]){__VA_ARGS__, 0})

static void check_kind(const char *kind, uint64_t count,
                       const unsigned *threads) {
    struct host_points points = {0};
    struct host_error error = {0};
    assert_int_equal(host_gen(kind, count, 5, &points, &error), 0);
    check(&(struct set){points.xyz, points.count}, threads);
    host_points_free(&points);
}

#define CHECK_KIND(kind, count, ...)                                           \
    check_kind((kind), (count), (const unsigned[]){__VA_ARGS__, 0})

TEST(test_volumes_and_surfaces) {
    CHECK_KIND("uniform", 6000, 2, 3, 8, 64);
    CHECK_KIND("bubbles", 5000, 2, 16);
    CHECK_KIND("sphere", 4000, 2, 4);
    CHECK_KIND("hub", 3000, 2, 4);
    CHECK_KIND("bluntfin", 5000, 2, 8);
    CHECK_KIND("uniform", 9, 2, 64);
}

/* The seam is large enough for two regions of its own. */
TEST(test_seam_of_a_seam) {
    CHECK_KIND("uniform", 100000, 4, 16);
}

/* A region's points do not fit a triangulation at once, and its large spheres
 * reach those to come: it looks at its own bricks. */
TEST(test_large_regions) {
    CHECK_KIND("sphere", 140000, 2);
}

/* Eight points on each sphere. */
TEST(test_lattice) {
    enum { SIDE = 24 };
    static double xyz[SIDE * SIDE * SIDE][3];
    for (unsigned i = 0; i < SIDE * SIDE * SIDE; i++) {
        unsigned row = i / SIDE, layer = row / SIDE;
        xyz[i][0] = i % SIDE / 10.0;
        xyz[i][1] = row % SIDE / 10.0;
        xyz[i][2] = layer / 10.0;
    }
    CHECK((&(struct set){xyz[0], SIDE * SIDE * SIDE}), 2, 4, 16);
}

/* All regions but one lie in a plane, so they have no tetrahedra. */
TEST(test_flat_regions) {
    enum { SIDE = 50 };
    static double xyz[SIDE * SIDE + 1][3];
    for (unsigned i = 0; i < SIDE * SIDE; i++) {
        unsigned row = i / SIDE;
        xyz[i][0] = i % SIDE;
        xyz[i][1] = row;
        xyz[i][2] = 3.0 * xyz[i][0] + 5.0 * xyz[i][1];
    }
    xyz[SIDE * SIDE][2] = 1000;
    CHECK((&(struct set){xyz[0], SIDE * SIDE + 1}), 2, 3, 4, 8);
}

/* Coordinates so small that bounds of spheres say nothing: all is seam. */
TEST(test_hopeless_regions) {
    struct host_points points = {0};
    struct host_error error = {0};
    assert_int_equal(host_gen("uniform", 9000, 3, &points, &error), 0);
    for (uint64_t i = 0; i < 3 * points.count; i++)
        points.xyz[i] *= 0x1p-1030;
    CHECK((&(struct set){points.xyz, points.count}), 2, 4);
    host_points_free(&points);
}

/* Points of two parallel planes, a region each: each tetrahedron has vertices
 * of both, and what a region has alone is nothing. */
TEST(test_two_planes) {
    enum { SIDE = 30 };
    static double xyz[2 * SIDE * SIDE][3];
    for (unsigned i = 0; i < 2 * SIDE * SIDE; i++) {
        unsigned row = i / SIDE;
        xyz[i][0] = i % SIDE + 0.01 * (row % 7);
        xyz[i][1] = row % SIDE;
        xyz[i][2] = i < SIDE * SIDE ? 0 : 100;
    }
    CHECK((&(struct set){xyz[0], 2 * SIDE * SIDE}), 2, 4);
}

TEST(test_cancelled) {
    struct host_points points = {0};
    struct host_error error = {0};
    struct host_tetrahedra tets = {0};
    struct host_call call = {
        .threads = 2, .memory_max = UINT64_MAX, .cancelled = true};
    assert_int_equal(host_gen("uniform", 5000, 1, &points, &error), 0);
    host_call_enter(&call);
    (void)host_delaunay(points.xyz, points.count, &tets, &error);
    host_tetrahedra_free(&tets);
    host_call_enter(NULL);
    assert_int_equal(call.memory, 0);
    host_points_free(&points);
}
