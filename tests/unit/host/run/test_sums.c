/* What a run tells of its nodes together: who counts for which figure. */

#include "host/run/run.h"
#include "tests/unit/test.h"

enum { NODES = 5 };

static struct host_run_result result;
static struct host_node_report reports[NODES];

static void work(unsigned node, uint64_t wall_us, uint64_t calls) {
    struct node_finished_message *f = &reports[node].statistics;
    f->wall_us = wall_us;
    f->statistics.make_tetra_calls = calls;
    f->statistics.tetrahedra_built = calls / 2;
    f->statistics.vertices = calls / 10;
}

static void sum(void) {
    const struct host_service service = {.report = reports, .retransmitted = 3};
    memset(&result, 0, sizeof result);
    result.nodes = NODES;
    host_run_sum(&service, &result);
}

/* A holder has no time at work; what it sends again counts all the same.  An
 * idle worker is the fastest.  A node that was lost before it told of its time
 * is not, but what came of it counts. */
TEST(test_sums) {
    memset(reports, 0, sizeof reports);
    sum();
    assert_true(result.t_min_s == 0.0 && result.t_max_s == 0.0);
    work(0, 4000000, 1000);
    work(1, 6000000, 2000);
    reports[2].statistics.retransmitted = 7; /* a holder */
    work(3, 5, 0);                           /* idle: its range is empty */
    work(4, 0, 10);                          /* lost */
    reports[4].statistics.statistics.vertices = 0;
    sum();
    assert_true(result.t_min_s > 4e-6 && result.t_min_s < 6e-6);
    assert_true(result.t_max_s > 5.9 && result.t_max_s < 6.1);
    assert_int_equal(result.make_tetra_calls, 3010);
    assert_int_equal(result.built, 1505);
    assert_int_equal(result.vertices, 300);
    assert_int_equal(result.retransmitted, 10);
    assert_int_equal(result.node[1].statistics.wall_us, 6000000);
}
