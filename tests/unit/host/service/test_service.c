/* The host's service on the simulator's cube, as on one of real boards.
 * Whatever is lost, the digest is that of the undisturbed run; where the cube
 * cannot go on, the host says which node and link it is. */
#include "service_world.h"

static int set_up(void **unused) {
    (void)unused;
    begin_runs(8000);
    return 0;
}

static void survives_restart(unsigned node, double when,
                             const struct host_strategy *strategy) {
    prepare();
    world.events[0] = (struct event){RESTART, when, node, 0};
    survives(strategy);
}

/* Boards that reset themselves: each in turn, while all are at work, and at any
 * time. */
TEST(test_restarts) {
    for (unsigned i = 0; i < NODES; i++) {
        survives_restart(i, 0.05 * (i + 1), &host_spatial);
        assert_int_equal(result.generations, 2);
        survives_restart(i, 0.1 * (i + 1), &host_spatial);
        survives_restart(i, 0.1 * (i + 1), &host_sequential);
    }
    prepare();
    for (unsigned k = 0; k < EVENTS; k++)
        world.events[k] = (struct event){RESTART, 0.3 * k, k * 5 % NODES, 0};
    survives(&host_spatial);
}

/* While the pages go to all, those behind the gap must blame nobody. */
TEST(test_restarts_at_first) {
    for (unsigned when = 1; when <= 15; when++)
        for (unsigned node = 0; node < 4; node++)
            survives_restart(node, 0.004 * when, &host_exchange);
}

/* Any mixture of them; SERVICE_ROUNDS for more than a few. */
TEST(test_mixtures) {
    const char *wanted = getenv("SERVICE_ROUNDS");
    for (long rounds = wanted == NULL ? 8 : atol(wanted); rounds > 0;
         rounds--) {
        unsigned gone = 1 + draw(NODES - 1);
        prepare();
        for (unsigned k = 0; k < EVENTS - 2; k++) {
            double when = 0.1 + 0.1 * draw(20);
            unsigned i = draw(NODES);
            bool restarts = i != gone && draw(2) == 0;
            world.events[k] =
                (struct event){restarts ? RESTART : NOTHING, when, i, 0};
        }
        double when = 0.1 + 0.1 * draw(10);
        world.events[6] = (struct event){draw(2) == 0 ? CUT : NOTHING, when,
                                         draw(NODES), draw(DIMENSION)};
        world.events[7] =
            (struct event){draw(2) == 0 ? STOP : NOTHING, when, gone, 0};
        survives(draw(2) == 0 ? &host_spatial : &host_sequential);
    }
}

/* A node that is only stopped is waited for. */
TEST(test_stopped) {
    for (unsigned i = 0; i < NODES; i++) {
        prepare();
        world.dead_us = 0;
        world.stop_us = 4000000;
        world.events[0] = (struct event){STOP, 0.3, i, 0};
        survives(i % 2 == 0 ? &host_spatial : &host_sequential);
        assert_int_equal(result.generations, 1);
    }
}

/* One that never comes back is done without. */
TEST(test_gone) {
    for (unsigned i = 1; i < NODES; i++) {
        prepare();
        world.dead_us = i % 2 == 0 ? 0 : DEAD_US;
        /* A node that holds pages is soon needed no more. */
        bool holds = i % 3 == 0;
        world.events[0] = (struct event){STOP, holds ? 0.1 : 0.4, i, 0};
        survives(holds ? &host_sequential : &host_spatial);
        assert_true(result.generations > 1);
    }
    prepare();
    world.events[0] = (struct event){STOP, 0.4, 6, 0};
    world.events[1] = (struct event){STOP, 0.4, 3, 0};
    survives(&host_spatial);
}

/* Node 0 is done without where another has a wire to the host. */
TEST(test_gateway) {
    prepare();
    world.events[0] = (struct event){STOP, 0.4, 0, 0};
    start_world();
    fails_with("node 0 link 3: ");
    for (unsigned k = 0; k < 2; k++) {
        prepare();
        world.spare = 5;
        world.events[0] = (struct event){STOP, 0.4, 0, 0};
        survives(k == 0 ? &host_spatial : &host_sequential);
        assert_true(result.generations > 1);
    }
}

/* A board that resets itself whenever it has work does not go on for ever. */
TEST(test_for_ever) {
    struct host_digest digest;
    struct host_error error;
    prepare();
    start_world();
    world.sick = true;
    assert_int_equal(run(&host_sequential, &digest, &error), HOST_CUBE);
    if (strstr(error.text, "node 0 link 3: ") == NULL)
        fail_msg("%s", error.text);
}

/* Nodes that were left in the midst of a run serve the next host. */
TEST(test_next_host) {
    for (unsigned k = 1; k < 7; k++) {
        struct host_digest digest;
        struct host_error error;
        prepare();
        start_world();
        world.host_fails = 0.1 * k;
        if (run(&host_spatial, &digest, &error) == 0) {
            assert_true(k > 3); /* it was done by then */
            end_world();
            continue;
        }
        assert_string_equal(error.text, "the host fails; as it should");
        world.host_fails = 0.0;
        if (run(&host_spatial, &digest, &error) != 0)
            fail_msg("%s", error.text);
        assert_string_equal(digest.text, expected.text);
    }
}

/* Links that go dead are gone round. */
TEST(test_cut) {
    unsigned lost = 0;
    for (unsigned i = 0; i < NODES; i++) {
        prepare();
        world.events[0] = (struct event){CUT, 0.3, i, i % DIMENSION};
        survives(i % 2 == 0 ? &host_spatial : &host_sequential);
        lost += result.generations > 1;
    }
    assert_true(lost >= 4); /* others have done with it */
}

/* Wires that were never there are gone round as well, once all else is; one
 * that is on no node's way from or to node 0 is named all the same. */
TEST(test_missing_wire) {
    unsigned missed = 0;
    for (unsigned i = 0; i < NODES; i++) {
        for (unsigned d = 0; d < DIMENSION; d++) {
            if ((i >> d & 1) == 0) {
                prepare();
                world.absent_s = 3;
                start_world();
                lacks(i, d);
                survives_as(d == 0 ? &host_sequential : &host_spatial);
                missed += result.generations > 1;
                assert_int_equal(result.missing_wires, 1);
            }
        }
    }
    assert_int_equal(missed, 11); /* those of a way from or to node 0 */
    prepare();
    world.absent_s = 3;
    start_world();
    lacks(5, 1); /* the one that is not, but nodes need it themselves */
    survives_as(&host_exchange);
    assert_int_equal(result.generations, 2);
    assert_int_equal(result.missing_wires, 1);
    assert_true(world.sim.now_us < 6000000);
    prepare();
    world.absent_s = 3;
    start_world();
    lacks(0, 0);
    lacks(3, 0);
    lacks(6, 1);
    survives_as(&host_spatial);
    assert_int_equal(result.generations, 2);
    assert_int_equal(result.missing_wires, 3);
}

/* A node that comes late moves the search on, and not into the end of the
 * patience with nodes. */
TEST(test_missing_wire_and_late_node) {
    prepare();
    world.absent_s = 3;
    start_world();
    lacks(2, 2);
    host_world_late(&world.sim, 5, 3000000);
    survives_as(&host_spatial);
    assert_true(world.sim.now_us > 8000000);
    assert_int_equal(result.generations, 2);
    assert_int_equal(result.missing_wires, 1);
}

/* The host's own wire to node 0, where it has another. */
TEST(test_missing_host_port) {
    prepare();
    world.absent_s = 3;
    world.spare = 5;
    start_world();
    lacks(0, DIMENSION);
    survives_as(&host_spatial);
    assert_int_equal(result.generations, 2);
    assert_int_equal(result.missing_wires, 1);
    prepare(); /* the other, which is there for a loss alone */
    world.absent_s = 3;
    world.spare = 5;
    start_world();
    lacks(5, DIMENSION);
    survives_as(&host_spatial);
    assert_int_equal(result.generations, 1);
    assert_int_equal(result.missing_wires, 1);
}

/* A wire that nothing needs and that comes up late is no missing one, and what
 * a node sleeps is not its wire's time. */
TEST(test_late_wire) {
    for (unsigned k = 0; k < 2; k++) {
        uint64_t late_us = k == 0 ? 2500000 : 7000000;
        double when = (double)late_us / (double)spatial_us;
        prepare();
        world.dead_us = 0;
        start_world();
        lacks(5, 1);
        world.events[0] = (struct event){MEND, when, 5, 1};
        world.stop_us = (uint64_t)((0.98 * when - 0.4) * (double)spatial_us);
        world.events[1] = (struct event){k == 0 ? NOTHING : STOP, 0.4, 7, 0};
        survives_as(&host_spatial);
        assert_true(world.sim.now_us > late_us);
        assert_int_equal(result.generations, 1);
        assert_int_equal(result.missing_wires, 0);
    }
}

/* A node that is late is waited for, and all of its wires are used. */
TEST(test_late_node) {
    for (unsigned i = 0; i < NODES; i++) {
        prepare();
        world.absent_s = 3;
        start_world();
        host_world_late(&world.sim, i, 7600000);
        survives_as(&host_spatial);
        assert_true(world.sim.now_us > 7600000);
        assert_int_equal(result.generations, 1);
        assert_int_equal(result.missing_wires, 0);
    }
    prepare();
    world.absent_s = 3;
    start_world();
    host_world_late(&world.sim, 6, UINT64_MAX / 4);
    fails_with("node 6 link 2: no answer");
}

static void swap(unsigned node, unsigned link, unsigned other,
                 unsigned other_link) {
    struct link_pipe *one = &world.sim.node[node].board.pipes[link];
    struct link_pipe *two = &world.sim.node[other].board.pipes[other_link];
    struct link_pipe pipe = *one;
    *one = *two;
    *two = pipe;
}

/* A wire in the wrong place is named before anything is given out. */
TEST(test_wrong_wire) {
    prepare();
    start_world();
    swap(5, 2, 3, 1); /* 5 was to lead to 1, and 3 to 1 */
    fails_with("node 1 link 1 is wired to node 5, expected node 3");
    prepare(); /* the host's own */
    start_world();
    swap(0, DIMENSION, 3, 2);
    fails_with("host link 0 is wired to node 3, expected node 0");
}

/* However the ends of nodes and host fall together, nobody waits for a farewell
 * in vain: half a second at a node, two at the host. */
TEST(test_ends_at_once) {
    for (unsigned k = 0; k < 100; k++) {
        struct host_run_options options;
        struct host_tetrahedra tets = {0};
        struct host_points few = points;
        struct host_error error = {0};
        few.count = 30;
        host_run_defaults(&options);
        options.quiet = true;
        options.memory = MEMORY;
        options.strategy = &host_spatial;
        prepare();
        start_world();
        memset(&result, 0, sizeof result);
        result.nodes = NODES;
        result.strategy = &host_spatial;
        struct host_machine machine = host_world_machine(&world.sim);
        assert_int_equal(host_triangulate_on(&options, &machine, &few, &tets,
                                             &result, &error),
                         0);
        assert_true(machine.ended(machine.context));
        assert_in_range(world.sim.now_us, 1, 100000);
        host_tetrahedra_free(&tets);
        end_world();
    }
}

TEST_GROUP(set_up, end_runs)
