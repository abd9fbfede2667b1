/* What a node without progress comes to, and when, for several values of the
 * patience: the simulated cube of service_world.h, in virtual time. */
#include "service_world.h"

enum { SECOND = 1000000, SLACK_US = 600000 };

static const uint64_t patiences[] = {1, 2, 8, 10, 60};

static int set_up(void **unused) {
    (void)unused;
    begin_runs(4000);
    return 0;
}

static void show_told(void) {
    for (unsigned i = 0; i < world.told_count; i++) {
        print_message("%8.3f %s\n", 1e-6 * (double)world.told[i].us,
                      world.told[i].line);
    }
}

/* The user was told so within SLACK_US after `us`. */
static void told_at(const char *text, uint64_t us) {
    uint64_t at = told_us(text);
    if (at < us || at > us + SLACK_US) {
        show_told();
        fail_msg("'%s' at %llu us, expected %llu", text, (unsigned long long)at,
                 (unsigned long long)us);
    }
}

/* A node that answers and never works: its work is done by others, as soon as
 * the patience is over. */
TEST(test_idle) {
    for (unsigned k = 0; k < sizeof patiences / sizeof patiences[0]; k++) {
        for (unsigned i = 0; i < NODES; i += 5) {
            char text[80];
            prepare();
            world.patience_s = patiences[k];
            world.events[0] = (struct event){IDLE, 0.4, i, 0};
            survives(k % 2 == 0 ? &host_spatial : &host_sequential);
            if (k % 2 == 1 && i > 0)
                continue; /* it may have no work, as an undisturbed holder */
            snprintf(text, sizeof text,
                     "node %u link %u: answers, but has done nothing for %u s",
                     i, i == 0 ? (unsigned)DIMENSION : 2u,
                     (unsigned)patiences[k]);
            told_at(text, time_of(0.4) + patiences[k] * SECOND);
        }
    }
}

/* A node that keeps pages and sends none holds up the one that waits for them,
 * who is not the idle one. */
TEST(test_idle_holder) {
    prepare();
    world.events[0] = (struct event){IDLE, 0.0, 3, 0};
    survives(&host_sequential);
    told_at("node 3 link 1: answers, but has done nothing for 8 s", 8 * SECOND);
    assert_int_equal(told_us("node 0"), UINT64_MAX);
}

/* Whatever a strategy has it do, the node that never works is the one that is
 * named, and no other: not who waits for it, nor who waits for that one. */
static void idles_in(const struct host_strategy *strategy, unsigned node,
                     unsigned builders) {
    char name[16];
    prepare();
    world.patience_s = 2;
    world.sharing.builders = builders;
    world.events[0] = (struct event){IDLE, 0.0, node, 0};
    survives(strategy);
    snprintf(name, sizeof name, "node %u ", node);
    for (unsigned t = 0; t < world.told_count; t++) {
        if (strstr(world.told[t].line, "has done nothing") != NULL &&
            strncmp(world.told[t].line, name, strlen(name)) != 0) {
            show_told();
            fail_msg("%s, %u builders: node %u is the idle one", strategy->name,
                     builders, node);
        }
    }
}

TEST(test_idle_in_each_strategy) {
    static const struct host_sharing usual;
    const struct host_strategy *row;
    for (unsigned k = 0; (row = host_strategy_row(k)) != NULL; k++) {
        struct host_error error = {0};
        bool builds = row == &host_master_slaves || row == &host_linda;
        if (host_strategy_check(row, NODES, &usual, INCODE_FACE_OWN,
                                INCODE_BUILD_AUTO, &error) != 0)
            continue;
        for (unsigned i = 0; i < NODES; i++) {
            idles_in(row, i, 0);
            if (builds)
                idles_in(row, i, 3);
        }
    }
}

/* --- nodes that do not answer --------------------------------------------- */

static void cut_off(unsigned node) {
    for (unsigned d = 0; d < DIMENSION; d++)
        world.events[d] = (struct event){CUT, 0.4, node, d};
}

/* One that is killed, stopped or cut off is named within two seconds, and
 * given up when the patience is over, neither before nor later: whatever its
 * links are found to be meanwhile. */
TEST(test_silent) {
    for (unsigned k = 0; k < sizeof patiences / sizeof patiences[0]; k++) {
        for (unsigned how = 0; how < 3; how++) {
            uint64_t patience_us = patiences[k] * SECOND;
            char text[80];
            prepare();
            world.patience_s = patiences[k];
            world.dead_us = how == 1 ? 0 : 1500000;
            if (how < 2) {
                world.events[0] =
                    (struct event){how == 0 ? KILL : STOP, 0.4, 5, 0};
            } else {
                cut_off(5);
            }
            survives(&host_spatial);
            snprintf(text, sizeof text,
                     "node 5 link 2: given up after %u s without an answer; ",
                     (unsigned)patiences[k]);
            told_at(text, time_of(0.4) + patience_us);
            uint64_t doubt_us = told_us("node 5 link 2: no answer for ");
            if (patiences[k] > 1 && doubt_us > time_of(0.4) + 2 * SECOND) {
                show_told();
                fail_msg("it was not doubted in time");
            }
            assert_int_equal(result.lost, 1);
        }
    }
}

/* One that comes back in time is told of as well, and nothing is lost. */
TEST(test_back) {
    prepare();
    world.dead_us = 0;
    world.stop_us = 3 * SECOND;
    world.events[0] = (struct event){STOP, 0.4, 6, 0};
    survives(&host_spatial);
    assert_int_equal(result.generations, 1);
    assert_int_equal(result.lost, 0);
    assert_int_equal(world.told_count, 2);
    told_at("node 6 link 2: no answer for ", time_of(0.4) + SECOND);
    told_at("node 6 link 2: answers again; ", time_of(0.4) + 3 * SECOND);
    /* On slow wires an answer may be as late as that. */
    prepare();
    world.dead_us = 0;
    world.baud = 19200;
    world.stop_us = 3 * SECOND;
    world.events[0] = (struct event){STOP, 0.4, 6, 0};
    survives(&host_spatial);
    assert_int_equal(world.told_count, 0);
    prepare();
    world.events[0] = (struct event){RESTART, 0.4, 6, 0};
    survives(&host_spatial);
    assert_int_equal(world.told_count, 1);
    told_at("node 6 link 2: has started again; ", time_of(0.4));
}

/* The same of node 0: without it the cube cannot go on. */
TEST(test_silent_gateway) {
    for (unsigned k = 0; k < sizeof patiences / sizeof patiences[0]; k++) {
        prepare();
        world.patience_s = patiences[k];
        world.events[0] = (struct event){KILL, 0.4, 0, 0};
        start_world();
        fails_with("node 0 link 3: lost, and the cube cannot go on without it");
        assert_in_range(world.stopped_us, time_of(0.4) + patiences[k] * SECOND,
                        time_of(0.4) + patiences[k] * SECOND + 2 * SLACK_US);
        assert_int_equal(told_us("node 1"), UINT64_MAX); /* nobody knows */
    }
}

/* --- nodes that never come ------------------------------------------------ */

TEST(test_never_started) {
    for (unsigned k = 0; k < sizeof patiences / sizeof patiences[0]; k++) {
        for (unsigned i = 0; i < NODES; i += 3) {
            char text[80];
            prepare();
            world.patience_s = patiences[k];
            world.absent_s = k % 2 == 0 ? 3 : 0;
            start_world();
            host_world_late(&world.sim, i, UINT64_MAX / 4);
            snprintf(text, sizeof text, "no answer for %u s, %u of 8 nodes are",
                     (unsigned)patiences[k], i == 0 ? 0u : 7u);
            fails_with(text);
            uint64_t end_us = world.stopped_us;
            assert_in_range(end_us, patiences[k] * SECOND,
                            patiences[k] * SECOND + 2 * SLACK_US);
            snprintf(text, sizeof text, "node %u: no answer, %s", i,
                     i == 0 ? "and the other 7 are behind it; "
                            : "7 of 8 are there; ");
            if (patiences[k] > 1)
                told_at(text, 1500000);
        }
    }
}

static uint64_t starving_us(void *unused, unsigned node) {
    (void)unused;
    (void)node;
    return world.sim.now_us - world.sim.now_us / 20;
}

static uint64_t well_fed_us(void *unused, unsigned node) {
    (void)unused;
    (void)node;
    return 0;
}

/* Of nodes that this machine has started: on a busy one they may take a minute,
 * where the processors were what they waited for; a program that says nothing
 * is found after nine seconds. */
TEST(test_started_here) {
    prepare();
    world.starved_us = starving_us;
    start_world();
    host_world_late(&world.sim, 7, 60 * SECOND);
    survives_as(&host_spatial);
    for (unsigned i = 0; i < NODES; i += 7) {
        prepare();
        world.starved_us = well_fed_us;
        start_world();
        host_world_late(&world.sim, i, UINT64_MAX / 4);
        fails_with("no answer for 9 s");
        assert_in_range(world.stopped_us, 9 * SECOND, 10 * SECOND);
    }
}

/* Those who come late are told of, and who is still to come. */
TEST(test_late) {
    prepare();
    world.absent_s = 3;
    start_world();
    host_world_late(&world.sim, 3, 3 * SECOND);
    host_world_late(&world.sim, 4, 5 * SECOND);
    survives_as(&host_spatial);
    assert_int_equal(result.missing_wires, 0);
    told_at("node 4: no answer, nor of 2 more, 5 of 8 are known ", 1500000);
    told_at("node 4: no answer, 7 of 8 are there; ", 3950000);
    told_at("host: all nodes are there; ", 5 * SECOND);
    assert_int_equal(world.told_count, 3);
}

/* --- nodes that do nothing, again ----------------------------------------- */

/* Where nobody works, the run ends; of the last one nobody says that others do
 * its work. */
TEST(test_all_idle) {
    prepare();
    for (unsigned i = 0; i < NODES; i++)
        world.events[i] = (struct event){IDLE, 0.4, i, 0};
    start_world();
    fails_with("no node is left to work");
    unsigned others = 0, nobody = 0;
    for (unsigned i = 0; i < world.told_count; i++) {
        const char *line = world.told[i].line;
        others += strstr(line, "; its work is given to others, ") != NULL;
        nobody += strstr(line, "; no other node is left to do its ") != NULL;
    }
    assert_int_equal(others, NODES - 1);
    assert_int_equal(nobody, 1);
}

TEST_GROUP(set_up, end_runs)
