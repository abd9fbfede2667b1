/* A cube in virtual time that a host sessions: worlds of any size, and what
 * befalls them between two rounds of the session. */
#ifndef TESTS_VISIT_WORLD_H
#define TESTS_VISIT_WORLD_H

#include <stdlib.h>
#include <string.h>

#include "host/sim/sim_world.h"
#include "host/cube/session.h"
#include "tests/unit/test.h"

enum { MEMORY = 640 * 1024, S = 1000000 };

static struct {
    struct host_world world;
    struct host_machine machine;
    struct host_session session;
    struct host_error error;
    uint64_t random;
} place;

static inline uint32_t draw(uint32_t below) {
    return (uint32_t)(sim_draw(&place.random) >> 32) % below;
}

struct place {
    unsigned dimension;
    uint64_t seed;
    bool bare;
    uint32_t dead_us;
    struct sim_faults faults;
};

static inline void open_place(const struct place *as) {
    const struct host_world_options options = {
        .cube = {.dimension = as->dimension,
                 .seed = as->seed,
                 .faults = as->faults,
                 .wire = {as->bare ? 92160 : 5000000, 10, 1500, SIM_BYTES_MIN},
                 .gather_us = 50},
        .memory = MEMORY,
        .dead_us = as->dead_us,
        .step_us = 20,
        .host_us = 20,
        .bare = as->bare,
        .serial_baud = as->bare ? 921600 : 0,
        .time_us_max = UINT64_C(2000) * S,
        .steps_max = UINT64_MAX};
    memset(&place, 0, sizeof place);
    place.random = as->seed * 2 + 1;
    if (host_world_open(&place.world, &options, &place.error) != 0)
        fail_msg("%s", place.error.text);
    place.world.strike_us = place.world.second_us = UINT64_MAX;
    for (unsigned i = 0; i < place.world.nodes; i++)
        host_world_late(&place.world, i, draw(100000));
}

static inline void good(int status) {
    if (status != 0)
        fail_msg("%s", place.error.text);
}

/* Comes to the cube as another start of the host. */
static inline void come(void) {
    place.machine = host_world_machine(&place.world);
    good(host_session_open(&place.session, &place.machine, &place.error));
}

static inline void close_place(void) {
    host_session_close(&place.session);
    assert_null(host_world_damage(&place.world));
    host_world_close(&place.world);
}

static inline struct host_node_set all(void) {
    struct host_node_set set;
    host_node_set_all(&set, place.world.nodes);
    return set;
}

static inline struct host_node_set but(unsigned node) {
    struct host_node_set set = all();
    set.bits[node / 8] &= (uint8_t) ~(1u << node % 8);
    return set;
}

static inline struct host_node_set only(unsigned node) {
    struct host_node_set set = {{0}};
    host_node_set_add(&set, node);
    return set;
}

/* Of a set, those that are there. */
static inline unsigned there(const struct host_node_set *set) {
    unsigned count = 0;
    for (unsigned i = 0; i < place.world.nodes; i++)
        count += host_node_set_has(set, i) && place.session.node[i].there;
    return count;
}

static inline void wait_for(struct host_node_set set, uint64_t us) {
    good(host_session_wait(&place.session, &set, us, &place.error));
    if (there(&set) != host_node_set_count(&set)) {
        fail_msg("%u of %u are there after %llu ms", there(&set),
                 host_node_set_count(&set), (unsigned long long)us / 1000);
    }
}

static inline void stay(uint64_t us) {
    uint64_t end_us = place.world.now_us + us;
    while (place.world.now_us < end_us) {
        good(host_session_round(&place.session, end_us - place.world.now_us,
                                &place.error));
    }
}

/* Asks all of them, of whom every one has to answer. */
static inline void ask(struct host_node_set set, enum node_question what,
                       unsigned target, uint64_t us) {
    good(
        host_session_ask(&place.session, &set, what, target, us, &place.error));
    for (unsigned i = 0; i < place.world.nodes; i++)
        if (host_node_set_has(&set, i) && !place.session.node[i].answered)
            fail_msg("node %u has not answered question %u", i, (unsigned)what);
}

static inline unsigned wire_of(unsigned node, unsigned link) {
    return host_sim_cube_wire(&place.world.cube, node, link);
}

/* Both ways: what is sent is lost, and nobody is told. */
static inline void pull(unsigned node, unsigned link, bool out) {
    for (unsigned side = 0; side < 2; side++)
        host_sim_cube_deaf(&place.world.cube, wire_of(node, link), side, out);
}

#endif
