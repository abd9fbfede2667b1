/* How many tetrahedra are open at a time: few of a sheet, more of a volume, a
 * part of all where they reach across; none where there is no triangulation. */
#include <math.h>

#include "host/mesh/gen.h"
#include "host/mesh/order.h"
#include "tests/unit/test.h"

static uint64_t open_of(const double *xyz, uint64_t count) {
    struct host_order order = {0};
    struct host_error error = {0};
    assert_int_equal(host_order_make(&order, "points", xyz, count,
                                     HOST_ADAPTIVE, 1, false, &error),
                     0);
    uint64_t open = host_order_open(&order);
    host_order_free(&order);
    return open;
}

static uint64_t open_of_kind(const char *kind, uint64_t count) {
    struct host_points points = {0};
    struct host_error error = {0};
    assert_int_equal(host_gen(kind, count, 1, &points, &error), 0);
    uint64_t open = open_of(points.xyz, points.count);
    host_points_free(&points);
    return open;
}

/* 8 n^(2/3) of a volume are not final; those open in the end are fewer. */
TEST(test_growth) {
    double before = 0;
    for (uint64_t n = 4000; n <= 64000; n *= 4) {
        double open = (double)open_of_kind("uniform", n);
        assert_true(open > 4 * pow((double)n, 2.0 / 3) &&
                    open < 20 * pow((double)n, 2.0 / 3));
        assert_true(before == 0 || (open > 2 * before && open < 4 * before));
        before = open;
    }
    assert_true(open_of_kind("sphere", 64000) < open_of_kind("uniform", 64000));
}

/* Points on two lines askew: a tetrahedron for each pair of their intervals,
 * more than are counted. */
TEST(test_across) {
    enum { SIDE = 1000 };
    static double xyz[2 * SIDE][3];
    for (unsigned i = 0; i < SIDE; i++) {
        xyz[i][0] = xyz[SIDE + i][1] = i / (double)SIDE;
        xyz[SIDE + i][2] = 10;
    }
    assert_true(open_of(xyz[0], 2 * SIDE) > 10 * SIDE);
}

TEST(test_few) {
    static const double xyz[5][3] = {
        {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
    assert_true(open_of(xyz[0], 5) <= 3);
    assert_true(open_of(xyz[0], 4) <= 1);
}
