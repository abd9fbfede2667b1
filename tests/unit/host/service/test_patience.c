/* What a node without progress comes to, and when, for several values of the
 * patience: the simulated cube of service_world.h, in virtual time. */
#include "service_world.h"

enum { SECOND = 1000000, SLACK_US = 600000 };

static const uint64_t patiences[] = {1, 2, 8, 10, 60};

static int set_up(void **unused)
{
    struct host_error error = {0};
    (void)unused;
    assert_int_equal(host_gen("uniform", 4000, 5, &points, &error), 0);
    for (unsigned k = 0; k < 2; k++) {
        prepare();
        start_world();
        assert_int_equal(
            run(k == 0 ? &host_sequential : &host_spatial, &expected, &error),
            0);
        *(k == 0 ? &sequential_us : &spatial_us) = world.sim.now_us;
    }
    return 0;
}

static int tear_down(void **unused)
{
    (void)unused;
    host_points_free(&points);
    return 0;
}

static void show_told(void)
{
    for (unsigned i = 0; i < world.told_count; i++) {
        print_message("%8.3f %s\n", 1e-6 * (double)world.told[i].us,
                      world.told[i].line);
    }
}

/* The user was told so within SLACK_US after `us`. */
static void told_at(const char *text, uint64_t us)
{
    uint64_t at = told_us(text);
    if (at < us || at > us + SLACK_US) {
        show_told();
        fail_msg("'%s' at %llu us, expected %llu", text, (unsigned long long)at,
                 (unsigned long long)us);
    }
}

/* A node that answers and never works: its work is done by others, as soon as
 * the patience is over. */
static void test_idle(void **unused)
{
    (void)unused;
    for (unsigned k = 0; k < sizeof patiences / sizeof patiences[0]; k++) {
        for (unsigned i = 0; i < NODES; i += 5) {
            char text[80];
            prepare();
            world.patience_s = patiences[k];
            world.events[0] = (struct event){IDLE, 0.4, i, 0};
            survives(k % 2 == 0 ? &host_spatial : &host_sequential);
            if (k % 2 == 1 && i > 0) {
                continue; /* it may have no work, as an undisturbed holder */
            }
            snprintf(text, sizeof text,
                     "node %u link %u: answers, but has done nothing for %u s",
                     i, i == 0 ? DIMENSION : 2, (unsigned)patiences[k]);
            told_at(text, time_of(0.4) + patiences[k] * SECOND);
        }
    }
}

/* A node that keeps pages and sends none holds up the one that waits for them,
 * who is not the idle one. */
static void test_idle_holder(void **unused)
{
    (void)unused;
    prepare();
    world.events[0] = (struct event){IDLE, 0.0, 3, 0};
    survives(&host_sequential);
    told_at("node 3 link 1: answers, but has done nothing for 8 s", 8 * SECOND);
    assert_int_equal(told_us("node 0"), UINT64_MAX);
}

/* Where nobody works, the run ends. */
static void test_all_idle(void **unused)
{
    (void)unused;
    prepare();
    for (unsigned i = 0; i < NODES; i++) {
        world.events[i] = (struct event){IDLE, 0.4, i, 0};
    }
    start_world();
    fails_with("no node is left to work");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_idle),
        cmocka_unit_test(test_idle_holder),
        cmocka_unit_test(test_all_idle),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
