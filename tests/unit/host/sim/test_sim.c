/* The simulation itself: the same seed is the same run, and a small run of four
 * nodes survives whatever becomes of each single frame, and a restart of each
 * node at each frame that it sends.  INCODE_SIM_STRIDE: of those frames one in
 * so many (1: all).  Fewer under the sanitizers: they look at the code that
 * each fate and restart goes through, and it is the same at most frames. */

#include "host/base/parallel.h"
#include "host/service/service.h"
#include "host/service/strategies/strategies.h"
#include "host/sim/sim.h"
#include "tests/unit/emulated.h"
#include "tests/unit/test.h"

enum { STRIDE = 11, STRIDE_SANITIZED = 61, STRIDE_EMULATED = 97 };

static uint64_t stride(void) {
    const char *given = getenv("INCODE_SIM_STRIDE");
    return given != NULL ? strtoull(given, NULL, 10)
           : emulated()  ? STRIDE_EMULATED
           : SANITIZED   ? STRIDE_SANITIZED
                         : STRIDE;
}

static struct host_sim_outcome run(const struct host_sim_plan *plan) {
    struct host_sim_outcome outcome;
    struct host_error error = {0};
    if (host_sim_run(plan, &outcome, &error) != 0) {
        fail_msg("seed %llu, frame %llu: fate %d, restart %d of node %u: %s",
                 (unsigned long long)plan->seed,
                 (unsigned long long)plan->frame, plan->fate, plan->restart,
                 plan->restart_node, error.text);
    }
    return outcome;
}

TEST(the_same_seed_is_the_same_run) {
    uint64_t before = 0;
    for (uint64_t seed = 1; seed <= (emulated() ? 1 : 6); seed++) {
        struct host_sim_plan plan;
        host_sim_plan_draw(&plan, seed, 0);
        struct host_sim_outcome a = run(&plan), b = run(&plan);
        assert_true(a.trace == b.trace);
        assert_true(a.trace != before);
        assert_true(a.steps == b.steps && a.time_us == b.time_us);
        assert_string_equal(a.digest.text, b.digest.text);
        before = a.trace;
    }
}

/* Four nodes, a few points, and nothing goes wrong by itself. */
static struct host_sim_plan small_run(void) {
    struct host_sim_plan plan;
    host_sim_plan_draw(&plan, 1, 4);
    plan.kind = "uniform";
    plan.points = 30;
    plan.strategy = host_strategy_named("spatial");
    plan.index = INCODE_KD;
    plan.partition = HOST_ADAPTIVE;
    plan.face_rule = INCODE_FACE_OWN;
    plan.build = INCODE_BUILD_AUTO;
    plan.shuffle_seed = 0;
    plan.window = plan.host_window = 2;
    plan.memory_more = 65536;
    plan.wire = (struct sim_quality){10000000, 20, 8192, 16384};
    plan.host_wire = plan.wire;
    plan.gather_us = 20;
    plan.step_us = 20;
    plan.host_us = 20;
    for (int k = 0; k < HOST_SIM_FAULTS; k++)
        plan.wanted[k] = false;
    plan.weather = (struct sim_faults){{0}, 0, 0};
    return plan;
}

TEST(each_frame_meets_each_fate) {
    struct host_sim_plan plan = small_run();
    struct host_sim_outcome clean = run(&plan);
    uint64_t runs = 0, changed = 0, step = stride();
    for (int fate = SIM_DROPPED; fate <= SIM_LATE; fate++) {
        plan.fate = (enum sim_fate)fate;
        for (uint64_t k = 1 + (uint64_t)fate % step; k <= clean.frames;
             k += step) {
            plan.frame = k;
            struct host_sim_outcome outcome = run(&plan);
            assert_string_equal(outcome.digest.text, clean.digest.text);
            changed += outcome.trace != clean.trace;
            runs++;
        }
    }
    print_message("%llu frames, %llu runs, %llu of them took another course\n",
                  (unsigned long long)clean.frames, (unsigned long long)runs,
                  (unsigned long long)changed);
    assert_true(2 * changed > runs);
}

/* A small memory of the host changes where its arrays are, and nothing else. */
TEST(a_small_host_takes_the_same_course) {
    struct host_sim_plan plan = small_run();
    plan.points = 3000;
    struct host_sim_outcome whole = run(&plan);
    plan.wanted[HOST_SIM_SMALL_HOST] = true;
    plan.host_memory = 640 << 10;
    struct host_sim_outcome part = run(&plan);
    assert_string_equal(part.digest.text, whole.digest.text);
    assert_true(part.trace == whole.trace);
    assert_true(part.struck[HOST_SIM_SMALL_HOST] > 100);
    assert_true(whole.struck[HOST_SIM_SMALL_HOST] == 0);
}

TEST(each_node_restarts_at_each_frame) {
    struct host_sim_plan plan = small_run();
    struct host_sim_outcome clean = run(&plan);
    uint64_t runs = 0, restarts = 0, step = stride();
    plan.restart = true;
    for (unsigned node = 0; node < 4; node++) {
        plan.restart_node = node;
        for (uint64_t k = 1 + node % step; k <= clean.node_frames[node];
             k += step) {
            plan.frame = k;
            struct host_sim_outcome outcome = run(&plan);
            assert_string_equal(outcome.digest.text, clean.digest.text);
            restarts += outcome.restarts;
            runs++;
        }
    }
    print_message("%llu runs, %llu restarts\n", (unsigned long long)runs,
                  (unsigned long long)restarts);
    assert_true(4 * restarts > 3 * runs);
}

/* Seed 151: nodes of an exchange that are done lend pages to those who are not,
 * also such as the shuffle keeps back, and nobody's patience ends. */
TEST(who_is_done_lends_on) {
    struct host_sim_plan plan;
    host_sim_plan_draw(&plan, 151, 0);
    assert_string_equal(plan.strategy->name, "exchange");
    assert_true(plan.shuffle_seed != 0);
    assert_true(run(&plan).time_us < HOST_PATIENCE_US / 2);
}

static int one_thread(void **unused) {
    (void)unused;
    static struct host_call alone = {.threads = 1, .memory_max = UINT64_MAX};
    host_call_enter(&alone);
    return 0;
}

TEST_GROUP(one_thread, NULL)
