/* The cost model on cases that can be done by hand: prices, messages, t_IO, the
 * fit of prices to runs, and wires that are one medium. */
#include <math.h>

#include "host/bench/paper.h"
#include "host/bench/model.h"
#include "tests/unit/test.h"

static const double prices[HOST_BENCH_COUNTS] = {[HOST_BENCH_CALLS] = 7,
                                                 [HOST_BENCH_BUILT] = 11,
                                                 [HOST_BENCH_CANDIDATES] = 0.5,
                                                 [HOST_BENCH_EXACT] = 100};

TEST(test_node) {
    const struct host_bench_machine machine = {
        .price = prices, .scale = 10, .message_us = 3};
    struct node_finished_message totals = {0};
    totals.statistics.make_tetra_calls = 5;
    totals.statistics.tetrahedra_built = 4;
    totals.statistics.candidates = 200;
    totals.statistics.tally.exact_orient3d = 9; /* has no price */
    totals.statistics.tally.exact_in_sphere = 3;
    /* 35 + 44 + 100 + 300 ns, ten times, and six messages. */
    assert_true(host_bench_node_ns(&machine, &totals, 6) == 4790 + 18000);
}

TEST(test_io) {
    const struct host_bench_machine machine = {
        .wire = {.bytes_per_s = 1000000, .latency_us = 40},
        .host_wire = {.bytes_per_s = 2000000, .latency_us = 10}};
    double seconds = host_bench_io_s(&machine, 1000000, 3);
    double hops = 3 * (40e-6 + INCODE_PAGE_BYTES * 1e-6);
    assert_true(fabs(seconds - (0.5 + 10e-6 + hops)) < 1e-12);
}

/* Prices that times were made of are found again, but for one that would have
 * to be negative. */
TEST(test_fit) {
    static const double made[HOST_CALIBRATE_TERMS] = {3,  0,    0.25,
                                                      40, 2000, 90000};
    double a[HOST_CALIBRATE_RUNS][HOST_CALIBRATE_TERMS], x[6];
    uint64_t random = 1;
    for (unsigned i = 0; i < HOST_CALIBRATE_RUNS; i++) {
        double ns = 0;
        for (int k = 0; k < HOST_CALIBRATE_TERMS; k++) {
            a[i][k] = k == HOST_CALIBRATE_START
                          ? 1
                          : (double)(sim_draw(&random) % 1000) * (k + 1);
            ns += a[i][k] * made[k];
        }
        for (int k = 0; k < HOST_CALIBRATE_TERMS; k++)
            a[i][k] /= ns;
    }
    host_calibrate_fit((const double(*)[HOST_CALIBRATE_TERMS])a,
                       HOST_CALIBRATE_RUNS, x);
    for (int k = 0; k < HOST_CALIBRATE_TERMS; k++) {
        assert_true(x[k] >= 0);
        assert_true(fabs(x[k] - made[k]) < 1e-3 * made[k] + 1e-3);
    }
}

/* Two wires of 1 MB/s: bytes of both, sent at once, come one after the other
 * where they are one medium, and together where they are not. */
static void one_medium(bool shared, uint64_t last_us) {
    static uint8_t memory[2][2 * SIM_BYTES_MIN];
    static const struct sim_quality quality = {.bytes_per_s = 1000000,
                                               .latency_us = 100,
                                               .room = 4000,
                                               .bytes = SIM_BYTES_MIN};
    struct sim_wire wire[2];
    uint64_t now_us = 1000, medium_ns = 0;
    uint8_t bytes[500];
    memset(bytes, 1, sizeof bytes);
    for (int i = 0; i < 2; i++) {
        sim_wire_init(&wire[i], memory[i], &quality, &now_us, 1);
        if (shared)
            sim_wire_share(&wire[i], &medium_ns);
    }
    for (int i = 0; i < 2; i++) {
        struct link_pipe pipe = sim_pipe(&wire[i].end[0]);
        assert_int_equal(pipe.send(pipe.context, bytes, sizeof bytes), 500);
    }
    /* The last byte of each, if more is on its way. */
    assert_int_equal(sim_next_us(wire[0].end[1].in, 100000), 1600);
    assert_int_equal(sim_next_us(wire[1].end[1].in, 100000), last_us);
    now_us = last_us - 1;
    struct link_pipe pipe = sim_pipe(&wire[1].end[1]);
    assert_int_equal(pipe.receive(pipe.context, bytes, sizeof bytes), 499);
    now_us = last_us;
    assert_int_equal(pipe.receive(pipe.context, bytes, sizeof bytes), 1);
}

TEST(test_medium) {
    one_medium(false, 1600);
    one_medium(true, 2100);
}

/* The figures that the paper prints follow from its times. */
static void check_speed_up(const char *table, uint64_t points, unsigned nodes,
                           double speed_up) {
    const struct host_paper_series *s =
        host_paper_find(table, "Uniform", points, "");
    assert_non_null(s);
    const struct host_paper_row *row = host_paper_row_of(s, nodes);
    assert_non_null(row);
    assert_true(fabs(s->alone_s / row->t_max - speed_up) < 0.0101);
}

TEST(test_figures) {
    static const double uniform_10k[] = {1,    1.75,  3.03,  5.10,
                                         8.05, 12.80, 19.26, 24.91};
    static const double uniform_20k[] = {1,    1.80,  3.13,  5.34,
                                         8.90, 13.73, 19.08, 20.71};
    static const double hybrid[] = {5.05, 8.78, 15.01, 25.00, 38.58, 53.58};
    for (unsigned i = 0; i < 8; i++) {
        check_speed_up("2", 10000, 1u << i, uniform_10k[i]);
        check_speed_up("2", 20000, 1u << i, uniform_20k[i]);
    }
    for (unsigned i = 0; i < 6; i++)
        check_speed_up("5", 20000, 8u << i, hybrid[i]);
    check_speed_up("3", 10000, 8, 4.75);
    check_speed_up("3", 20000, 8, 5.12);
    check_speed_up("6", 4000, 7, 2.86);
    check_speed_up("6", 6000, 3, 2.59);
    check_speed_up("6", 8000, 3, 2.68);
    check_speed_up("6", 10000, 7, 2.95);
    check_speed_up("6", 20000, 7, 3.39);
    check_speed_up("7", 10000, 5, 2.01);
    check_speed_up("7", 20000, 1, 0.63);
    assert_null(
        host_paper_row_of(host_paper_find("6", "Uniform", 8000, ""), 7));
    assert_null(host_paper_find("2", "Bubbles", 20000, ""));
}
