/* What `auto` makes of points that fill a volume, and of points that do not. */

#include "host/mesh/gen.h"
#include "host/run/choose.h"
#include "tests/unit/test.h"

enum { POINTS = 5000, NODES = 2 };

static struct host_run_result result;

/* Settles a run on so many points of that kind; true: again, by their order.
 * *regions: that the order has in the end. */
static bool settle(struct host_run_options *options, const char *kind,
                   uint32_t *regions) {
    struct host_points points = {0};
    struct host_order order;
    struct host_error error = {0};
    assert_int_equal(host_gen(kind, POINTS, 1, &points, &error), 0);
    result = (struct host_run_result){0};
    options->processors = NODES; /* whatever this machine has */
    host_choose(options, points.count, &result);
    result.nodes = NODES;
    assert_int_equal(host_order_make(&order, kind, points.xyz, points.count,
                                     host_strategy_partition(
                                         result.strategy, options->partition),
                                     NODES, false, &error),
                     0);
    bool again = host_choose_ordered(options, &order, &result);
    *regions = order.regions;
    assert_int_equal(order.region[0].first, 0);
    assert_int_equal(order.region[order.regions - 1].last, order.bricks);
    host_order_free(&order);
    host_points_free(&points);
    return again;
}

TEST(volumes_and_others) {
    struct host_run_options options;
    uint32_t regions;
    host_run_defaults(&options);
    options.nodes = NODES;
    assert_false(settle(&options, "uniform", &regions));
    assert_ptr_not_equal(result.strategy, &host_sequential);
    assert_int_equal(regions, NODES);
    static const char *const kinds[] = {"sphere", "grid", "bluntfin"};
    for (unsigned i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        assert_true(settle(&options, kinds[i], &regions));
        assert_ptr_equal(result.strategy, &host_sequential);
        assert_int_equal(regions, 1);
        assert_int_equal(result.nodes, NODES);
        assert_true(result.why[0] != '\0');
    }
    /* Face by face, one node alone has no advantage. */
    options.build = INCODE_BUILD_FACES;
    assert_false(settle(&options, "sphere", &regions));
    assert_ptr_not_equal(result.strategy, &host_sequential);
}

TEST(what_is_asked_for_stays) {
    struct host_run_options options;
    uint32_t regions;
    host_run_defaults(&options);
    options.nodes = NODES;
    options.strategy = &host_spatial;
    assert_false(settle(&options, "sphere", &regions));
    assert_ptr_equal(result.strategy, &host_spatial);
    assert_int_equal(regions, NODES);
    assert_int_equal(result.why[0], '\0');
}

/* One node does by itself, unless somebody has said how many. */
TEST(one_alone) {
    struct host_run_options options;
    uint32_t regions;
    host_run_defaults(&options);
    (void)settle(&options, "sphere", &regions);
    assert_ptr_equal(result.strategy, &host_sequential);
    assert_int_equal(result.nodes, 1);
    (void)settle(&options, "uniform", &regions);
    assert_ptr_not_equal(result.strategy, &host_sequential);
    assert_int_equal(result.nodes, NODES);
}

/* What is open of a surface has to fit, or its faces are sought; the user's
 * word stands. */
TEST(what_does_not_fit) {
    struct host_run_options options;
    uint32_t regions;
    host_run_defaults(&options);
    options.nodes = NODES;
    (void)settle(&options, "sphere", &regions);
    assert_int_equal(result.build, INCODE_BUILD_AUTO);
    options.memory = 300 << 10;
    (void)settle(&options, "sphere", &regions);
    assert_int_equal(result.build, INCODE_BUILD_FACES);
    (void)settle(&options, "uniform", &regions); /* the node's to say */
    assert_int_equal(result.build, INCODE_BUILD_AUTO);
    options.build = INCODE_BUILD_POINTS;
    (void)settle(&options, "sphere", &regions);
    assert_int_equal(result.build, INCODE_BUILD_POINTS);
}
