/* How often a node looks at its links while it works, on fast processors and
 * slow ones; what it tells of that and of its board. */

#include "host/sim/sim_cube.h"
#include "node/looks.h"
#include "tests/unit/test.h"

/* Node 0 looks, node 1 is a cube that is polled. */
static struct {
    uint64_t now_ns, now_us;
    unsigned asked; /* for the time */
    struct host_sim_cube wires;
    struct node_board board;
    struct node_looks looks;
    struct cube *cube[2];
    void *memory[2];
} world;

static uint64_t now_us(void *context) {
    (void)context;
    world.asked++;
    return world.now_ns / 1000;
}

static uint64_t busy_us(void *context) {
    (void)context;
    return 77;
}

static void gauges(void *context, struct node_gauges *gauges) {
    (void)context;
    *gauges = (struct node_gauges){
        .stack_bytes = 49152, .stack_high_water = 40000, .overruns = 3};
}

static void pass(uint64_t ns) {
    world.now_ns += ns;
    world.now_us = world.now_ns / 1000;
}

static void set_up(void) {
    const struct host_sim_cube_options options = {
        .dimension = 1,
        .wire = {.latency_us = 30, .room = 4000, .bytes = SIM_BYTES_MIN}};
    struct host_error error = {0};
    memset(&world, 0, sizeof world);
    assert_int_equal(
        host_sim_cube_open(&world.wires, &options, &world.now_us, &error), 0);
    for (unsigned i = 0; i < 2; i++) {
        struct cube_config config;
        memset(&config, 0, sizeof config);
        config.self = (uint16_t)i;
        config.dimension = 1;
        config.window = 4;
        config.epoch = 7 + i;
        for (unsigned d = 0; d < 2 - i; d++)
            config.pipes[d] = host_sim_cube_pipe(&world.wires, i, d);
        size_t bytes = (cube_arena_bytes(&config) + 63) / 64 * 64;
        world.memory[i] = aligned_alloc(64, bytes);
        assert_non_null(world.memory[i]);
        world.cube[i] = cube_init(world.memory[i], bytes, &config);
        assert_non_null(world.cube[i]);
    }
    world.board.now_us = now_us;
    world.board.busy_us = busy_us;
    node_looks_init(&world.looks, &world.board, world.cube[0]);
}

static void tear_down(void) {
    free(world.memory[0]);
    free(world.memory[1]);
    host_sim_cube_close(&world.wires);
}

/* Works so many units of that length each, without a step's end, in pieces of
 * up to `most`. */
static void work(uint32_t units, uint64_t unit_ns, uint32_t most) {
    struct incode_yield yield = node_looks_yield(&world.looks);
    uint64_t random = 5;
    for (uint32_t done = 0; done < units;) {
        uint32_t piece = 1 + (uint32_t)(sim_draw(&random) >> 32) % most;
        incode_yield_after(&yield, piece);
        pass(piece * unit_ns);
        (void)cube_poll(world.cube[1], world.now_us);
        done += piece;
    }
}

TEST(looks_come_in_time) {
    /* A unit of a workstation, of an M7 and of an M3 at 25 MHz. */
    static const struct {
        uint64_t unit_ns;
        uint32_t units, most, limit_us;
    } processors[] = {{50, 2000000, 64, 5000},
                      {8000, 100000, 64, 5000},
                      {240000, 20000, 16, 10000},
                      {240000, 20000, 64, 50000}};
    for (unsigned i = 0; i < 4; i++) {
        set_up();
        world.looks.tends = true;
        node_looks_poll(&world.looks, now_us(NULL));
        work(processors[i].units, processors[i].unit_ns, processors[i].most);
        assert_true(world.looks.poll_us_max >= 1250);
        assert_in_range(world.looks.poll_us_max, 0, processors[i].limit_us);
        assert_true(cube_link_state(world.cube[1], 0) == LINK_UP);
        /* The clock is looked at four times where it is polled once, or after
         * four units. */
        uint64_t most = world.now_us / 1000 < processors[i].units / 4
                            ? world.now_us / 1000
                            : processors[i].units / 4;
        assert_true(world.asked < 6 * most + 200);
        tear_down();
    }
}

/* Units that take next to nothing, and then long: the first of these is seen
 * late, the next in time. */
TEST(work_that_gets_slower_is_seen) {
    set_up();
    world.looks.tends = true;
    node_looks_poll(&world.looks, now_us(NULL));
    work(2000000, 50, 64);
    for (unsigned i = 0; i < 2; i++) {
        world.looks.poll_us_max = 0;
        work(100000, 8000, 64);
        assert_true((world.looks.poll_us_max < 5000) == (i > 0));
    }
    tear_down();
}

/* Units are not alike: seven times as long as those before are seen in time,
 * as a Cortex-M7 of 25 MHz has them. */
TEST(work_that_differs_is_seen_in_time) {
    set_up();
    world.looks.tends = true;
    node_looks_poll(&world.looks, now_us(NULL));
    work(100000, 8000, 64);
    for (unsigned i = 0; i < 20; i++) {
        work(50000, 3000, 64);
        work(500, 21000, 64);
    }
    assert_in_range(world.looks.poll_us_max, 0, 5000);
    tear_down();
}

/* A window of messages, each of which takes a while. */
TEST(many_messages_are_looked_between) {
    set_up();
    world.looks.tends = true;
    node_looks_poll(&world.looks, now_us(NULL));
    for (unsigned i = 0; i < 100; i++) {
        pass(200000);
        node_looks_between(&world.looks);
    }
    assert_in_range(world.looks.poll_us_max, 1250, 1500);
    tear_down();
}

/* Nobody's clock may go on: nothing is tended then. */
TEST(who_steps_in_parts_is_not_tended) {
    set_up();
    node_looks_poll(&world.looks, now_us(NULL));
    world.asked = 0;
    work(2000000, 50, 64);
    node_looks_between(&world.looks);
    assert_int_equal(world.asked, 0);
    assert_true(cube_link_state(world.cube[1], 0) == LINK_OPENING);
    tear_down();
}

TEST(what_is_told_of_it) {
    struct node_finished_message finished;
    set_up();
    node_looks_poll(&world.looks, now_us(NULL));
    pass(4000000);
    node_looks_poll(&world.looks, now_us(NULL));
    pass(3000000);
    node_looks_poll(&world.looks, now_us(NULL));
    node_looks_idle(&world.looks); /* what follows is sleep */
    pass(90000000);
    node_looks_poll(&world.looks, now_us(NULL));
    memset(&finished, 0, sizeof finished);
    node_looks_totals(&world.looks, &finished);
    assert_int_equal(finished.look_us_max, 4000);
    assert_int_equal(finished.stack_bytes, 0); /* the board does not know */
    assert_int_equal(finished.overruns, 0);
    assert_int_equal(finished.busy_us, 77);
    world.board.gauges = gauges;
    node_looks_totals(&world.looks, &finished);
    assert_int_equal(finished.stack_bytes, 49152);
    assert_int_equal(finished.stack_high_water, 40000);
    assert_int_equal(finished.overruns, 3);
    tear_down();
}

/* Both cubes, or the looking one alone, for so long. */
static void run_for(uint64_t us, bool both) {
    for (uint64_t end = world.now_us + us; world.now_us < end;) {
        pass(1000000);
        (void)cube_poll(world.cube[0], world.now_us);
        if (both)
            (void)cube_poll(world.cube[1], world.now_us);
        else
            (void)node_looks_silent(&world.looks, world.now_us);
    }
}

/* A host that comes again is answered at once: its link is not told as silent
 * until the next look. */
TEST(what_speaks_again_is_not_silent) {
    set_up();
    run_for(1000000, true);
    assert_true(cube_link_state(world.cube[0], 0) == LINK_UP);
    run_for(1000000, false);
    assert_int_equal(node_looks_silent_yet(&world.looks), 0);
    run_for(10000000, false);
    assert_int_equal(node_looks_silent_yet(&world.looks), 1);
    run_for(1000000, true);
    assert_int_equal(world.looks.silent, 1);
    assert_int_equal(node_looks_silent_yet(&world.looks), 0);
    tear_down();
}
