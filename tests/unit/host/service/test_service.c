/* The host's service and a whole cube of nodes in one process and in virtual
 * time, on wires of memory, as real boards are: nobody tells the host that a
 * node has started again, is stopped or gone.  Whatever is lost, the digest is
 * that of the undisturbed run; where the cube cannot go on, the host says which
 * node and link it is. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "host/mesh/gen.h"
#include "host/run/run.h"
#include "host/service/strategies/strategies.h"
#include "node/node.h"
#include "tests/unit/node/rings.h"

enum {
    DIMENSION = 3,
    NODES = 8,
    MEMORY = 1 << 20,
    FIXED = 73728,
    EVENTS = 8,
    DEAD_US = 2000000
};

enum what { NOTHING, RESTART, STOP, CONTINUE, CUT, MEND };

struct event {
    enum what what;
    double when; /* in the time that the undisturbed run takes */
    unsigned node, link;
};

static struct {
    struct ring_wire wire[NODES][DIMENSION + 1]; /* by the lower end */
    struct ring_end end[NODES][DIMENSION + 1], host[2];
    struct node_board board[NODES];
    struct node *node[NODES];
    bool stopped[NODES], ended[NODES];
    uint16_t spare;
    uint8_t absent_s;
    uint32_t dead_us, epoch;
    struct event events[EVENTS];
    double host_fails; /* when; 0: never */
    bool sick;         /* node 0 starts again whenever it has work */
    unsigned busy;     /* its steps in a row that did something */
    uint64_t now_us;
} world;

static uint64_t undisturbed_us;
static struct host_digest expected;
static struct host_points points;
static struct host_run_result result;

static uint64_t now_us(void *context)
{
    (void)context;
    return world.now_us;
}

static struct ring_wire *wire_of(unsigned node, unsigned link)
{
    unsigned other = link == DIMENSION ? node : node ^ 1u << link;
    return &world.wire[node < other ? node : other][link];
}

static void start_node(unsigned i)
{
    struct node_board *board = &world.board[i];
    const char *why = NULL;
    memset(board->arena, 0xa5, board->arena_bytes);
    board->identity.epoch = ++world.epoch;
    world.node[i] = node_start(board, &why);
    assert_null(why);
    assert_non_null(world.node[i]);
    world.stopped[i] = world.ended[i] = false;
}

static void wire_up(void)
{
    for (unsigned i = 0; i < NODES; i++) {
        for (unsigned d = 0; d <= DIMENSION; d++) {
            world.end[i][d].wire = wire_of(i, d);
            world.end[i][d].side = d < DIMENSION && (i >> d & 1) != 0;
            world.board[i].pipes[d] = ring_pipe(&world.end[i][d]);
        }
    }
    world.host[0] = (struct ring_end){wire_of(0, DIMENSION), 1};
    world.host[1] = (struct ring_end){wire_of(world.spare, DIMENSION), 1};
}

static void start_world(void)
{
    wire_up();
    for (unsigned i = 0; i < NODES; i++) {
        struct node_board *board = &world.board[i];
        board->identity.self = (uint16_t)i;
        board->identity.dimension = DIMENSION;
        board->identity.host_wire = i != 0 && i == world.spare;
        board->identity.dead_us = world.dead_us;
        board->now_us = now_us;
        board->busy_us = now_us;
        board->idle = ring_idle;
        board->reset = ring_reset;
        board->arena_bytes = MEMORY - FIXED;
        board->arena = aligned_alloc(64, MEMORY - FIXED);
        assert_non_null(board->arena);
        board->fixed_bytes = FIXED;
        start_node(i);
    }
}

static void end_world(void)
{
    for (unsigned i = 0; i < NODES; i++) {
        free(world.board[i].arena);
    }
}

static void strike(struct event *event)
{
    switch (event->what) {
    case RESTART:
        start_node(event->node);
        break;
    case STOP:
        world.stopped[event->node] = true;
        break;
    case CONTINUE:
        world.stopped[event->node] = false;
        break;
    case CUT:
        wire_of(event->node, event->link)->cut = true;
        break;
    case MEND:
        wire_of(event->node, event->link)->cut = false;
        break;
    case NOTHING:
        break;
    }
    event->what = NOTHING;
}

/* ---- the machine ---- */

static void machine_idle(void *context, uint64_t wait_us)
{
    (void)context;
    bool moved = false;
    for (unsigned k = 0; k < NODES; k++) {
        unsigned i = draw(NODES);
        if (!world.stopped[i] && !world.ended[i]) {
            enum node_event event = node_step(world.node[i]);
            world.ended[i] = event == NODE_STOPPED;
            moved = moved || event == NODE_BUSY;
            world.busy = i != 0               ? world.busy
                         : event == NODE_BUSY ? world.busy + 1
                                              : 0;
            if (world.sick && world.busy > 3) {
                start_node(0);
                world.busy = 0;
            }
        }
    }
    world.now_us += moved ? 20 : wait_us < 1000 ? wait_us + 1 : 1000;
    for (unsigned i = 0; i < EVENTS; i++) {
        double when = world.events[i].when * (double)undisturbed_us;
        if ((double)world.now_us >= when) {
            strike(&world.events[i]);
        }
    }
}

static int machine_check(void *context, struct host_error *error)
{
    (void)context;
    double when = world.host_fails * (double)undisturbed_us;
    return when > 0.0 && (double)world.now_us >= when
               ? host_fail(error, HOST_CUBE, "the host fails; as it should")
               : 0;
}

static bool machine_ended(void *context)
{
    (void)context;
    return true;
}

static void machine_stop(void *context)
{
    (void)context;
}

static struct host_machine make_machine(void)
{
    struct host_machine machine;
    memset(&machine, 0, sizeof machine);
    machine.nodes = NODES;
    machine.dimension = DIMENSION;
    machine.epoch = ++world.epoch;
    machine.pipe = ring_pipe(&world.host[0]);
    machine.spare_node = world.spare;
    machine.absent_s = world.absent_s;
    machine.spare = ring_pipe(&world.host[1]);
    machine.now_us = now_us;
    machine.idle = machine_idle;
    machine.check = machine_check;
    machine.ended = machine_ended;
    machine.stop = machine_stop;
    return machine;
}

/* ---- runs ---- */

static void prepare(void)
{
    memset(&world, 0, sizeof world);
    world.epoch = 100;
    world.dead_us = DEAD_US;
}

/* Runs the world as it was prepared; the error's code. */
static int run(const struct host_strategy *strategy, struct host_digest *digest,
               struct host_error *error)
{
    struct host_run_options options;
    struct host_tetrahedra tets = {0};
    host_run_defaults(&options);
    options.quiet = true;
    options.patience_s = 8;
    options.memory = MEMORY;
    memset(&result, 0, sizeof result);
    memset(error, 0, sizeof *error);
    result.nodes = NODES;
    result.strategy = strategy;
    struct host_machine machine = make_machine();
    int status =
        host_triangulate_on(&options, &machine, &points, &tets, &result, error);
    if (status == 0) {
        host_tetrahedra_sort(&tets);
        host_digest(&tets, digest);
    }
    host_tetrahedra_free(&tets);
    if (world.host_fails == 0.0) {
        end_world();
    }
    return status;
}

static void survives(const struct host_strategy *strategy)
{
    struct host_digest digest;
    struct host_error error;
    start_world();
    if (run(strategy, &digest, &error) != 0) {
        fail_msg("%s", error.text);
    }
    assert_string_equal(digest.text, expected.text);
    assert_true(result.built >= result.tetrahedra);
    assert_true(result.make_tetra_calls >= result.tetrahedra);
}

static void fails_with(const char *text)
{
    struct host_digest digest;
    struct host_error error;
    if (run(&host_spatial, &digest, &error) != HOST_CUBE) {
        fail_msg("not an error of the cube: %s", error.text);
    }
    if (strstr(error.text, text) == NULL) {
        fail_msg("no '%s' in: %s", text, error.text);
    }
    assert_non_null(strchr(error.text, ';'));
}

static int set_up(void **unused)
{
    struct host_error error = {0};
    (void)unused;
    assert_int_equal(host_gen("uniform", 8000, 5, &points, &error), 0);
    prepare();
    start_world();
    assert_int_equal(run(&host_spatial, &expected, &error), 0);
    undisturbed_us = world.now_us;
    assert_int_equal(result.generations, 1);
    return 0;
}

static int tear_down(void **unused)
{
    (void)unused;
    host_points_free(&points);
    return 0;
}

static void survives_restart(unsigned node, double when,
                             const struct host_strategy *strategy)
{
    prepare();
    world.events[0] = (struct event){RESTART, when, node, 0};
    survives(strategy);
}

/* Boards that reset themselves: each in turn, while all are at work, and at any
 * time. */
static void test_restarts(void **unused)
{
    (void)unused;
    for (unsigned i = 0; i < NODES; i++) {
        survives_restart(i, 0.05 * (i + 1), &host_spatial);
        assert_int_equal(result.generations, 2);
        survives_restart(i, 0.1 * (i + 1), &host_spatial);
        survives_restart(i, 0.1 * (i + 1), &host_sequential);
    }
    prepare();
    for (unsigned k = 0; k < EVENTS; k++) {
        world.events[k] = (struct event){RESTART, 0.3 * k, k * 5 % NODES, 0};
    }
    survives(&host_spatial);
}

/* Any mixture of them; SERVICE_ROUNDS for more than a few. */
static void test_mixtures(void **unused)
{
    (void)unused;
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
static void test_stopped(void **unused)
{
    (void)unused;
    for (unsigned i = 0; i < NODES; i++) {
        prepare();
        world.dead_us = 0;
        double pause = 4e6 / (double)undisturbed_us;
        world.events[0] = (struct event){STOP, 0.3, i, 0};
        world.events[1] = (struct event){CONTINUE, 0.3 + pause, i, 0};
        survives(i % 2 == 0 ? &host_spatial : &host_sequential);
        assert_int_equal(result.generations, 1);
    }
}

/* One that never comes back is done without. */
static void test_gone(void **unused)
{
    (void)unused;
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
static void test_gateway(void **unused)
{
    (void)unused;
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
static void test_for_ever(void **unused)
{
    struct host_digest digest;
    struct host_error error;
    (void)unused;
    prepare();
    start_world();
    world.sick = true;
    assert_int_equal(run(&host_sequential, &digest, &error), HOST_CUBE);
    if (strstr(error.text, "node 0 link 3: ") == NULL) {
        fail_msg("%s", error.text);
    }
}

/* Nodes that were left in the midst of a run serve the next host. */
static void test_next_host(void **unused)
{
    (void)unused;
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
        if (run(&host_spatial, &digest, &error) != 0) {
            fail_msg("%s", error.text);
        }
        assert_string_equal(digest.text, expected.text);
    }
}

/* Links that go dead are gone round. */
static void test_cut(void **unused)
{
    unsigned lost = 0;
    (void)unused;
    for (unsigned i = 0; i < NODES; i++) {
        prepare();
        world.events[0] = (struct event){CUT, 0.3, i, i % DIMENSION};
        survives(i % 2 == 0 ? &host_spatial : &host_sequential);
        lost += result.generations > 1;
    }
    assert_true(lost >= 4); /* others have done with it */
}

static void lacks(unsigned node, unsigned link)
{
    wire_of(node, link)->cut = true;
}

static void survives_as(const struct host_strategy *strategy)
{
    struct host_digest digest;
    struct host_error error;
    if (run(strategy, &digest, &error) != 0) {
        fail_msg("%s", error.text);
    }
    assert_string_equal(digest.text, expected.text);
}

/* Wires that were never there are gone round as well, once all else is; one
 * that is on no node's way from or to node 0 is named all the same. */
static void test_missing_wire(void **unused)
{
    unsigned missed = 0;
    (void)unused;
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
    lacks(0, 0);
    lacks(3, 0);
    lacks(6, 1);
    survives_as(&host_spatial);
    assert_int_equal(result.generations, 2);
    assert_int_equal(result.missing_wires, 3);
}

/* A node that comes late moves the search on, and not into the end of the
 * patience with nodes. */
static void test_missing_wire_and_late_node(void **unused)
{
    (void)unused;
    prepare();
    world.absent_s = 3;
    start_world();
    lacks(2, 2);
    world.stopped[5] = true;
    world.events[0] =
        (struct event){CONTINUE, 3e6 / (double)undisturbed_us, 5, 0};
    survives_as(&host_spatial);
    assert_true(world.now_us > 8000000);
    assert_int_equal(result.generations, 2);
    assert_int_equal(result.missing_wires, 1);
}

/* The host's own wire to node 0, where it has another. */
static void test_missing_host_wire(void **unused)
{
    (void)unused;
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
static void test_late_wire(void **unused)
{
    (void)unused;
    for (unsigned k = 0; k < 2; k++) {
        uint64_t late_us = k == 0 ? 2500000 : 7000000;
        double when = (double)late_us / (double)undisturbed_us;
        prepare();
        world.dead_us = 0;
        start_world();
        lacks(5, 1);
        world.events[0] = (struct event){MEND, when, 5, 1};
        world.events[1] = (struct event){k == 0 ? NOTHING : STOP, 0.4, 7, 0};
        world.events[2] = (struct event){CONTINUE, 0.98 * when, 7, 0};
        survives_as(&host_spatial);
        assert_true(world.now_us > late_us);
        assert_int_equal(result.generations, 1);
        assert_int_equal(result.missing_wires, 0);
    }
}

/* A node that is late is waited for, and all of its wires are used. */
static void test_late_node(void **unused)
{
    (void)unused;
    for (unsigned i = 0; i < NODES; i++) {
        prepare();
        world.absent_s = 3;
        start_world();
        world.stopped[i] = true;
        world.events[0] =
            (struct event){CONTINUE, 7.6e6 / (double)undisturbed_us, i, 0};
        survives_as(&host_spatial);
        assert_true(world.now_us > 7600000);
        assert_int_equal(result.generations, 1);
        assert_int_equal(result.missing_wires, 0);
    }
    prepare();
    world.absent_s = 3;
    start_world();
    world.stopped[6] = true;
    fails_with("node 6 link 2: no answer");
}

static void swap(unsigned node, unsigned link, unsigned other,
                 unsigned other_link)
{
    struct ring_end end = world.end[node][link];
    world.end[node][link] = world.end[other][other_link];
    world.end[other][other_link] = end;
}

/* A wire in the wrong place is named before anything is given out. */
static void test_wrong_wire(void **unused)
{
    (void)unused;
    prepare();
    start_world();
    swap(5, 2, 3, 1); /* 5 was to lead to 1, and 3 to 1 */
    fails_with("node 1 link 1 is wired to node 5, expected node 3");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_restarts),
        cmocka_unit_test(test_mixtures),
        cmocka_unit_test(test_stopped),
        cmocka_unit_test(test_gone),
        cmocka_unit_test(test_gateway),
        cmocka_unit_test(test_for_ever),
        cmocka_unit_test(test_next_host),
        cmocka_unit_test(test_cut),
        cmocka_unit_test(test_wrong_wire),
        cmocka_unit_test(test_missing_wire),
        cmocka_unit_test(test_missing_wire_and_late_node),
        cmocka_unit_test(test_late_node),
        cmocka_unit_test(test_late_wire),
        cmocka_unit_test(test_missing_host_wire),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
