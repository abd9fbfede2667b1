/* The console's engine over the simulator's cube: what it says is kept as text.
 */
#ifndef TESTS_UNIT_CONSOLE_SHELL_WORLD_H
#define TESTS_UNIT_CONSOLE_SHELL_WORLD_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/console/commands.h"
#include "host/sim/sim_world.h"
#include "tests/unit/test.h"

enum { SAID = 1 << 16, MEMORY = 1 << 20, DEAD_US = 5000000 };

static struct {
    struct host_world world;
    struct host_shell shell;
    struct host_shell_place place;
    struct host_shell_sink sink;
    char said[SAID], noted[SAID], failed[SAID];
    uint32_t lined; /* bit i: node i has a reset line */
    unsigned pulses;
    bool interrupt;
    unsigned pictures, enough; /* shown; after which it is enough */
} desk;

static inline void append(char *to, const char *text) {
    size_t used = strlen(to);
    assert_true(used + strlen(text) + 2 < SAID);
    snprintf(to + used, SAID - used, "%s\n", text);
}

static inline void take_line(void *context, const char *text) {
    (void)context;
    append(desk.said, text);
}

static inline void take_note(void *context, const char *text) {
    (void)context;
    append(desk.noted, text);
}

static inline void take_failed(void *context, const char *text) {
    (void)context;
    append(desk.failed, text);
}

static inline bool is_interrupted(void *context) {
    (void)context;
    return desk.interrupt;
}

static inline int open_world(void *context, struct host_machine *machine,
                             struct host_error *error) {
    (void)context, (void)error;
    *machine = host_world_machine(&desk.world);
    return 0;
}

static inline void close_world(void *context) {
    (void)context;
}

static inline bool world_has_line(void *context, unsigned node) {
    (void)context;
    return (desk.lined >> node & 1) != 0;
}

static inline int world_pulse(void *context, unsigned node,
                              struct host_error *error) {
    (void)context, (void)error;
    desk.pulses++;
    host_world_crash(&desk.world, node, 1000, false);
    return 0;
}

static inline void begin(unsigned dimension, bool json) {
    const struct host_world_options options = {
        .cube = {.dimension = dimension,
                 .seed = 7,
                 .wire = {5000000, 10, 1500, SIM_BYTES_MIN},
                 .gather_us = 50},
        .memory = MEMORY,
        .dead_us = DEAD_US,
        .step_us = 20,
        .host_us = 20,
        .time_us_max = UINT64_MAX / 4,
        .steps_max = UINT64_MAX,
        .absent_s = 3,
    };
    struct host_error error = {0};
    memset(&desk, 0, sizeof desk);
    if (host_world_open(&desk.world, &options, &error) != 0)
        fail_msg("%s", error.text);
    desk.world.strike_us = desk.world.second_us = UINT64_MAX;
    desk.place = (struct host_shell_place){.open = open_world,
                                           .close = close_world,
                                           .has_line = world_has_line,
                                           .pulse = world_pulse};
    desk.sink = (struct host_shell_sink){.line = take_line,
                                         .note = take_note,
                                         .failed = take_failed,
                                         .interrupted = is_interrupted};
    host_shell_init(&desk.shell, &desk.place, &desk.sink, json);
}

static inline void end(void) {
    host_shell_close(&desk.shell);
    host_world_close(&desk.world);
}

/* A line's status; what it said is in desk.said and desk.failed alone. */
static inline int says(const char *line) {
    desk.said[0] = desk.failed[0] = '\0';
    return host_shell_line(&desk.shell, line);
}

/* Until so much of the world's time has passed. */
static inline void let_pass(uint64_t us) {
    uint64_t end_us = desk.world.now_us + us;
    while (desk.world.now_us < end_us)
        host_shell_tend(&desk.shell, end_us - desk.world.now_us);
}

/* Both ways: what is sent is lost, and nobody is told. */
static inline void deafen(unsigned node, unsigned link, bool deaf) {
    struct host_sim_cube *cube = &desk.world.cube;
    unsigned wire = host_sim_cube_wire(cube, node, link);
    host_sim_cube_deaf(cube, wire, 0, deaf);
    host_sim_cube_deaf(cube, wire, 1, deaf);
}

/* The object that the last line has answered, to be freed. */
static inline json_t *object(void) {
    json_error_t error;
    json_t *answer = json_loads(desk.said, 0, &error);
    if (answer == NULL)
        fail_msg("%s: %s", error.text, desk.said);
    assert_string_equal(strchr(desk.said, '\n'), "\n");
    return answer;
}

#endif
