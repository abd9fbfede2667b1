/* An order of 3,000 uniform points in two or more regions, for tests of the
 * service that need one and no cube. */
#ifndef TESTS_SMALL_ORDER_H
#define TESTS_SMALL_ORDER_H

#include "host/mesh/gen.h"
#include "host/mesh/order.h"
#include "tests/unit/test.h"

/* regions: a power of two. */
static inline struct host_order small_order(unsigned regions) {
    struct host_order order;
    struct host_points points = {0};
    struct host_error error = {0};
    assert_int_equal(host_gen("uniform", 3000, 1, &points, &error), 0);
    assert_int_equal(host_order_make(&order, "test", points.xyz, points.count,
                                     HOST_ADAPTIVE, regions, false, &error),
                     0);
    host_points_free(&points);
    return order;
}

#endif
