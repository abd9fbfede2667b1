/* Runs in virtual time: that a node is charged what it has counted and no more,
 * that the same run takes the same time, and that more nodes take less. */

#include "host/bench/bench_links.h"
#include "host/mesh/gen.h"
#include "host/service/strategies/strategies.h"
#include "tests/unit/test.h"

enum { POINTS = 600, BUILT_US = 2000 };

static const double prices[HOST_BENCH_COUNTS] = {[HOST_BENCH_BUILT] =
                                                     BUILT_US * 1e3},
                    /* As on a real machine: who finds has the most work. */
    shared_prices[HOST_BENCH_COUNTS] = {[HOST_BENCH_BUILT] = BUILT_US * 2e2,
                                        [HOST_BENCH_CALLS] = BUILT_US * 8e2};

static struct host_virtual_run run;
static double slow; /* of the next run */

static void triangulate(const char *strategy, unsigned nodes, bool routers,
                        bool shared) {
    const struct host_bench_machine machine = {
        .price = slow > 0 ? shared_prices : prices,
        .scale = 1,
        .wire = {.bytes_per_s = 1000000, .room = 16384, .bytes = 32768},
        .host_wire = {.bytes_per_s = 1000000, .room = 16384, .bytes = 32768},
        .gather_us = 100,
        .routers = routers,
        .shared = shared};
    struct host_run_options options;
    struct host_points points = {0};
    struct host_error error = {0};
    host_run_defaults(&options);
    options.strategy = host_strategy_named(strategy);
    options.build = INCODE_BUILD_FACES;
    options.nodes = nodes;
    run = (struct host_virtual_run){
        .machine = &machine, .options = &options, .slow = slow};
    assert_int_equal(host_gen("uniform", POINTS, 1, &points, &error), 0);
    assert_int_equal(host_virtual_run(&run, &points, &error), 0);
    assert_int_equal(run.result.points, POINTS);
    host_points_free(&points);
}

/* Every tetrahedron that a node has built takes it two milliseconds, and a step
 * that did nothing, one microsecond at most. */
TEST(test_charge) {
    for (unsigned nodes = 1; nodes <= 8; nodes *= 2) {
        uint64_t built = 0;
        triangulate("spatial", nodes, true, false);
        for (unsigned i = 0; i < nodes; i++) {
            const struct node_finished_message *f =
                &run.result.node[i].statistics;
            uint64_t us = f->statistics.tetrahedra_built * BUILT_US;
            built += f->statistics.tetrahedra_built;
            assert_true(f->busy_us >= us);
            assert_true(f->busy_us < us + us / 50);
            assert_true(f->wall_us >= us);
        }
        assert_true(run.work_ns == (double)built * BUILT_US * 1e3);
    }
}

TEST(test_again) {
    for (int machine = 0; machine < 4; machine++) {
        triangulate("spatial", 8, machine & 1, machine & 2);
        double t_min = run.result.t_min_s, t_max = run.result.t_max_s;
        triangulate("spatial", 8, machine & 1, machine & 2);
        assert_true(run.result.t_min_s == t_min);
        assert_true(run.result.t_max_s == t_max);
        assert_true(t_min > 0 && t_min <= t_max);
    }
}

TEST(test_more_nodes) {
    triangulate("sequential", 1, true, false);
    double alone = run.result.t_max_s, io = run.result.time_io_s;
    uint64_t tetrahedra = run.result.tetrahedra;
    assert_true(io >= POINTS * 24 * 1e-6 && io < 10 * POINTS * 24 * 1e-6);
    triangulate("spatial", 4, true, false);
    assert_int_equal(run.result.tetrahedra, tetrahedra);
    assert_true(run.result.t_max_s < 0.6 * alone);
    assert_true(run.result.t_max_s > 0.25 * alone);
}

/* A node of half the speed takes twice as long alone, and holds an exchange up
 * by little, as the others take over from it. */
TEST(test_slow_node) {
    slow = 1;
    triangulate("spatial", 4, true, false);
    double even = run.result.t_max_s;
    slow = 2;
    triangulate("spatial", 4, true, false);
    assert_true(run.result.t_max_s > 1.6 * even);
    slow = 1;
    triangulate("exchange", 4, true, false);
    even = run.result.t_max_s;
    slow = 2;
    triangulate("exchange", 4, true, false);
    slow = 0;
    uint64_t lent = run.result.stars_lent, borrowed = run.result.stars_borrowed;
    assert_true(borrowed > 0 && lent >= borrowed);
    assert_true(run.result.tetrahedra_late < run.result.tetrahedra / 10);
    assert_true(run.result.t_max_s < 1.7 * even);
}
