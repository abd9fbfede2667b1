/* Work that sets of hard shapes take face by face, counted and not by the
 * clock: a lattice of a plane and one point beside it, where most regions have
 * no point off the plane at hand; coordinates of very different exponents,
 * whose spheres reach most bricks, with pages for a part of them; and where
 * each coordinate has an exponent of its own.  And point by point: a plane,
 * where few cells are known to be final by their boxes. */
#include <math.h>

#include "tests/unit/incode/solo.h"

enum {
    SIDE = 72,
    PLANE = SIDE * SIDE + 1,
    MIXED = 4000,
    MORE_MIXED = 9000,
    UNEVEN = 1000,
    IN_SPHERES = 100, /* exact, a tetrahedron, and orient3d */
    ORIENT3DS = 150,
    EXACT = 100,  /* orient3d that is exact, a tetrahedron */
    REQUESTS = 2, /* of pages, a tetrahedron */
    SCANS = 100   /* of all cells, by all regions */
};

static uint64_t state = 1;

static double draw(void) {
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

static uint64_t count_by_points(const double (*xyz)[3], uint64_t points) {
    struct solo solo = {.index = INCODE_KD,
                        .build = INCODE_BUILD_POINTS,
                        .regions = 1,
                        .memory = 16 << 20};
    solo_run(&solo, xyz[0], points);
    uint64_t count = solo.tets.count;
    solo_close(&solo);
    return count;
}

/* A region by a node of its own, that has learned nothing of others. */
static struct incode_statistics run(const double (*xyz)[3], uint64_t points,
                                    uint32_t regions, uint32_t region,
                                    size_t memory) {
    struct incode_statistics s;
    struct solo solo = {.index = INCODE_KD,
                        .build = INCODE_BUILD_FACES,
                        .regions = regions,
                        .memory = memory};
    solo_open(&solo, xyz[0], points);
    solo_region(&solo, region);
    incode_triangulator_statistics(solo.t, &s);
    double built = (double)s.tetrahedra_built;
    print_message("region %u of %u, %zu of %u pages: %.1f candidates, %.1f "
                  "exact orient3d, %.2f pages a tetrahedron\n",
                  region, regions, incode_triangulator_map(solo.t)->frame_count,
                  solo.order.tree.pages, (double)s.candidates / built,
                  (double)s.tally.exact_orient3d / built,
                  (double)s.page_requests / built);
    solo_close(&solo);
    return s;
}

TEST(plane_and_a_point) {
    static double xyz[PLANE][3];
    for (int i = 0; i < SIDE * SIDE; i++) {
        const int row = i / SIDE, column = i % SIDE;
        xyz[i][0] = row;
        xyz[i][1] = column;
        xyz[i][2] = -(xyz[i][0] + xyz[i][1]);
    }
    xyz[SIDE * SIDE][0] = xyz[SIDE * SIDE][1] = SIDE / 2.;
    xyz[SIDE * SIDE][2] = 0;
    uint64_t all = count_by_points((const double(*)[3])xyz, PLANE);
    for (uint32_t regions = 1; regions <= 8; regions *= 2) {
        uint64_t kept = 0;
        for (uint32_t r = 0; r < regions; r++) {
            struct incode_statistics s =
                run((const double(*)[3])xyz, PLANE, regions, r, 0);
            kept += s.tetrahedra_kept;
            assert_in_range(s.tally.exact_orient3d, 0,
                            EXACT * s.tetrahedra_built);
        }
        assert_int_equal(kept, all);
    }
}

static void make_mixed(double (*xyz)[3], int points) {
    for (int i = 0; i < points; i++) {
        double scale = ldexp(1, (int)(80 * draw()) - 40);
        for (int d = 0; d < 3; d++)
            xyz[i][d] = (2 * draw() - 1) * scale;
    }
}

/* 66 pages, and 48 frames: a walk over all of them that always went up would
 * find none of them there. */
TEST(mixed_exponents) {
    static double xyz[MIXED][3];
    make_mixed(xyz, MIXED);
    struct incode_statistics s = run((const double(*)[3])xyz, MIXED, 1, 0, 0);
    assert_int_equal(s.tetrahedra_kept,
                     count_by_points((const double(*)[3])xyz, MIXED));
    assert_in_range(s.page_requests, 0, REQUESTS * s.tetrahedra_built);
}

/* 147 pages: with what the active face list and the bricks would take of a
 * larger set, there were 92 frames, and more than 10 requests a tetrahedron. */
TEST(frames_before_faces) {
    static double xyz[MORE_MIXED][3];
    make_mixed(xyz, MORE_MIXED);
    struct incode_statistics s =
        run((const double(*)[3])xyz, MORE_MIXED, 4, 0, 376 << 10);
    assert_in_range(s.page_requests, 0, s.tetrahedra_built);
}

/* Most of these bricks lie close to one point, as seen from the whole set:
 * boxes that were rounded by a part of its extent met nearly every sphere. */
TEST(small_boxes_stay_small) {
    static double xyz[MORE_MIXED][3];
    make_mixed(xyz, MORE_MIXED);
    uint64_t kept = 0;
    for (uint32_t r = 0; r < 8; r++) {
        struct incode_statistics s =
            run((const double(*)[3])xyz, MORE_MIXED, 8, r, 0);
        kept += s.tetrahedra_kept;
        assert_in_range(s.page_requests, 0, s.tetrahedra_built);
    }
    assert_int_equal(kept,
                     count_by_points((const double(*)[3])xyz, MORE_MIXED));
}

/* Points of others' bricks are inserted, released, and visited again each time
 * that memory is short: only a look at all cells would tell that no cell holds
 * such a point. */
TEST(released_vertices) {
    static double xyz[PLANE][3];
    struct solo solo = {.index = INCODE_KD,
                        .build = INCODE_BUILD_POINTS,
                        .regions = 4,
                        .memory = 320 << 10};
    for (int i = 0; i < SIDE * SIDE; i++) {
        const int row = i / SIDE, column = i % SIDE;
        xyz[i][0] = row;
        xyz[i][1] = column;
        xyz[i][2] = 3 * xyz[i][0] + 5 * xyz[i][1];
    }
    xyz[SIDE * SIDE][0] = xyz[SIDE * SIDE][1] = SIDE / 2.;
    xyz[SIDE * SIDE][2] = 10 * SIDE;
    solo_run(&solo, xyz[0], PLANE);
    print_message("%llu scans\n",
                  (unsigned long long)solo.t->insertion.complex.scans);
    assert_in_range(solo.t->insertion.complex.scans, 0, SCANS);
    assert_int_equal(solo.by_points, solo.tets.count);
    assert_int_equal(solo.tets.count,
                     count_by_points((const double(*)[3])xyz, PLANE));
    solo_close(&solo);
}

/* Coordinates of exponents of their own: a search relative to a far vertex of a
 * face is in doubt about all points that are near to another. */
TEST(uneven_coordinates) {
    static double xyz[UNEVEN][3];
    for (int i = 0; i < UNEVEN; i++)
        for (int d = 0; d < 3; d++)
            xyz[i][d] = (2 * draw() - 1) * pow(10, (int)(601 * draw()) - 300);
    struct incode_statistics s =
        run((const double(*)[3])xyz, UNEVEN, 1, 0, 1 << 20);
    assert_int_equal(s.tetrahedra_kept,
                     count_by_points((const double(*)[3])xyz, UNEVEN));
    print_message("%.1f exact in_sphere a tetrahedron\n",
                  (double)s.tally.exact_in_sphere / (double)s.tetrahedra_built);
    assert_in_range(s.tally.exact_in_sphere, 0,
                    IN_SPHERES * s.tetrahedra_built);
    assert_in_range(s.tally.exact_orient3d, 0, ORIENT3DS * s.tetrahedra_built);
}
