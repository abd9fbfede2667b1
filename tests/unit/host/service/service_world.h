/* A service and the simulator's cube of eight nodes, as real boards are: nobody
 * tells the host that a node has started again, stands still or is gone.  What
 * happens, and when, a test says beforehand. */
#ifndef TESTS_UNIT_SERVICE_WORLD_H
#define TESTS_UNIT_SERVICE_WORLD_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/mesh/gen.h"
#include "host/run/run.h"
#include "host/service/strategies/strategies.h"
#include "host/sim/sim_world.h"
#include "tests/unit/test.h"

enum {
    DIMENSION = 3,
    NODES = 8,
    MEMORY = 1 << 20,
    EVENTS = 8,
    TOLD = 64,
    TOLD_BYTES = 400,
    DEAD_US = 2000000,
    SICK_US = 20 /* between two looks at the node that is */
};

enum what { NOTHING, RESTART, STOP, CUT, MEND, IDLE, KILL };

struct event {
    enum what what;
    double when; /* in the time that the same run takes undisturbed */
    unsigned node, link;
};

static struct {
    struct host_world sim;
    uint16_t spare;
    uint8_t absent_s;
    uint32_t dead_us;
    uint32_t baud; /* that the nodes and the host are told of; 0: none */
    struct event events[EVENTS];
    uint64_t stop_us;    /* a STOP lasts so long; 0: for ever */
    double host_fails;   /* when; 0: never */
    bool sequential;     /* how it runs */
    bool sick;           /* node 0 starts again whenever it has work */
    uint64_t patience_s; /* 0: 8 */
    struct host_sharing sharing;
    const struct host_watchers *watchers;
    /* Where the machine has started its nodes: what it says of them. */
    uint64_t (*starved_us)(void *context, unsigned node);
    uint64_t stopped_us; /* when a run that failed ended its nodes */
    void (*stop)(void *context);
    /* What the user was told, and when. */
    struct {
        char line[TOLD_BYTES];
        uint64_t us;
    } told[TOLD];
    unsigned told_count;
} world;

static uint64_t spatial_us, sequential_us; /* undisturbed runs */
static uint64_t state = 88172645463325252u;
static struct host_digest expected;
static struct host_points points;
static struct host_run_result result;

static inline uint32_t draw(uint32_t below) {
    return (uint32_t)(sim_draw(&state) >> 32) % below;
}

static inline uint64_t time_of(double when) {
    return (uint64_t)(when *
                      (double)(world.sequential ? sequential_us : spatial_us));
}

/* Both ways: what is sent is lost, and nobody is told. */
static inline void cut(unsigned node, unsigned link, bool deaf) {
    struct host_sim_cube *cube = &world.sim.cube;
    unsigned wire = host_sim_cube_wire(cube, node, link);
    for (unsigned side = 0; side < 2; side++)
        host_sim_cube_deaf(cube, wire, side, deaf);
}

static inline void lacks(unsigned node, unsigned link) {
    cut(node, link, true);
}

static inline void happen(struct event *event) {
    uint64_t stop_us = world.stop_us > 0 ? world.stop_us : UINT64_MAX / 4;
    switch (event->what) {
    case RESTART:
        host_world_crash(&world.sim, event->node, 0, false);
        break;
    case STOP:
        host_world_pause(&world.sim, event->node, stop_us);
        break;
    case CUT:
    case MEND:
        cut(event->node, event->link, event->what == CUT);
        break;
    case IDLE:
        host_world_idle(&world.sim, event->node);
        break;
    case KILL:
        host_world_kill(&world.sim, event->node);
        break;
    case NOTHING:
        break;
    }
    event->what = NOTHING;
}

static inline void strike(void *context) {
    struct host_world *w = &world.sim;
    (void)context;
    if (world.sick && w->node[0].state == HOST_WORLD_UP &&
        node_held(w->node[0].node) > 0)
        host_world_crash(w, 0, 0, false);
    w->strike_us = world.sick ? w->now_us + SICK_US : UINT64_MAX;
    for (unsigned i = 0; i < EVENTS; i++) {
        struct event *event = &world.events[i];
        uint64_t time_us = time_of(event->when);
        if (event->what != NOTHING && time_us <= w->now_us)
            happen(event);
        else if (event->what != NOTHING && time_us < w->strike_us)
            w->strike_us = time_us;
    }
}

static inline void start_world(void) {
    const struct host_world_options options = {
        .cube = {.dimension = DIMENSION,
                 .seed = 1 + draw(UINT32_MAX),
                 .spare_node = world.spare,
                 .wire = {5000000, 10, 1500, SIM_BYTES_MIN},
                 .gather_us = 50},
        .memory = MEMORY,
        .dead_us = world.dead_us,
        .step_us = 20,
        .host_us = 20,
        .time_us_max = UINT64_C(2000000000), /* a run that hangs */
        .steps_max = UINT64_MAX,
        .absent_s = world.absent_s,
        .serial_baud = world.baud,
        .strike = strike,
    };
    struct host_error error = {0};
    if (host_world_open(&world.sim, &options, &error) != 0)
        fail_msg("%s", error.text);
    for (unsigned i = 0; i < NODES; i++)
        host_world_late(&world.sim, i, draw(50));
    world.sim.strike_us = 0;
}

static inline void end_world(void) {
    assert_null(host_world_damage(&world.sim));
    host_world_close(&world.sim);
}

/* --- the machine ---------------------------------------------------------- */

static inline int machine_check(void *context, struct host_error *error) {
    (void)context;
    assert_null(world.sim.fault);
    return world.host_fails > 0.0 &&
                   world.sim.now_us >= time_of(world.host_fails)
               ? host_fail(error, HOST_CUBE, "the host fails; as it should")
               : 0;
}

static inline void machine_told(void *context, const char *line) {
    (void)context;
    assert_non_null(strstr(line, ": "));
    assert_non_null(strstr(line, "; "));
    if (world.told_count < TOLD) {
        snprintf(world.told[world.told_count].line, TOLD_BYTES, "%s", line);
        world.told[world.told_count++].us = world.sim.now_us;
    }
}

/* When the user was told so first; UINT64_MAX: never. */
static inline uint64_t told_us(const char *text) {
    for (unsigned i = 0; i < world.told_count; i++)
        if (strstr(world.told[i].line, text) != NULL)
            return world.told[i].us;
    return UINT64_MAX;
}

/* The first stop of the machine is the run's end. */
static inline void machine_stop(void *context) {
    world.stopped_us =
        world.stopped_us == 0 ? world.sim.now_us : world.stopped_us;
    world.stop(context);
}

static inline unsigned machine_restarts(void *context) {
    (void)context;
    return 0;
}

static inline bool machine_ended(void *context) {
    (void)context;
    return true;
}

static inline struct host_machine make_machine(void) {
    struct host_machine machine = host_world_machine(&world.sim);
    machine.missing = NULL;
    machine.told = machine_told;
    world.stop = machine.stop;
    machine.stop = machine_stop;
    machine.check = machine_check;
    machine.ended = machine_ended;
    machine.watchers = world.watchers;
    machine.starved_us = world.starved_us;
    if (world.starved_us != NULL)
        machine.restarts = machine_restarts;
    return machine;
}

/* --- runs ----------------------------------------------------------------- */

static inline void prepare(void) {
    memset(&world, 0, sizeof world);
    world.dead_us = DEAD_US;
}

/* Runs the world as it was prepared; the error's code. */
static inline int run(const struct host_strategy *strategy,
                      struct host_digest *digest, struct host_error *error) {
    struct host_run_options options;
    struct host_tetrahedra tets = {0};
    host_run_defaults(&options);
    options.quiet = true;
    options.patience_s = world.patience_s == 0 ? 8 : world.patience_s;
    options.memory = MEMORY;
    options.strategy = strategy;
    options.sharing = world.sharing;
    memset(&result, 0, sizeof result);
    memset(error, 0, sizeof *error);
    result.nodes = NODES;
    result.strategy = strategy;
    world.sequential = strategy == &host_sequential;
    struct host_machine machine = make_machine();
    int status =
        host_triangulate_on(&options, &machine, &points, &tets, &result, error);
    if (status == 0) {
        host_tetrahedra_sort(&tets);
        host_digest(&tets, digest);
    }
    host_tetrahedra_free(&tets);
    if (world.host_fails == 0.0)
        end_world();
    return status;
}

static inline void survives(const struct host_strategy *strategy) {
    struct host_digest digest;
    struct host_error error;
    start_world();
    if (run(strategy, &digest, &error) != 0)
        fail_msg("%s", error.text);
    assert_string_equal(digest.text, expected.text);
    assert_true(result.built >= result.tetrahedra);
    assert_true(result.make_tetra_calls >= result.tetrahedra);
}

/* Points, what they come to, and how long that takes undisturbed. */
static inline void begin_runs(uint64_t count) {
    struct host_error error = {0};
    assert_int_equal(host_gen("uniform", count, 5, &points, &error), 0);
    prepare();
    start_world();
    assert_int_equal(run(&host_sequential, &expected, &error), 0);
    sequential_us = world.sim.now_us;
    assert_int_equal(result.generations, 1);
    prepare();
    start_world();
    assert_int_equal(run(&host_spatial, &expected, &error), 0);
    spatial_us = world.sim.now_us;
    assert_int_equal(result.generations, 1);
}

static inline int end_runs(void **unused) {
    (void)unused;
    host_points_free(&points);
    return 0;
}

static inline void fails_with(const char *text) {
    struct host_digest digest;
    struct host_error error;
    if (run(&host_spatial, &digest, &error) != HOST_CUBE)
        fail_msg("not an error of the cube: %s", error.text);
    if (strstr(error.text, text) == NULL)
        fail_msg("no '%s' in: %s", text, error.text);
    assert_non_null(strchr(error.text, ';'));
}

static inline void survives_as(const struct host_strategy *strategy) {
    struct host_digest digest;
    struct host_error error;
    if (run(strategy, &digest, &error) != 0)
        fail_msg("%s", error.text);
    assert_string_equal(digest.text, expected.text);
}

#endif
