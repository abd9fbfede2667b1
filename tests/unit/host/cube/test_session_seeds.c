/* Visits to cubes where wires lose and damage frames, break and are mended,
 * where nodes restart and lose power, and hosts come and go, by seed.  When it
 * is over, all nodes are there and answer. */
#include "session_world.h"

enum { BLOWS = 12, SEEDS = 10, LARGE = 2 };

/* Wires that are pulled, until when. */
static struct {
    unsigned node, link;
    uint64_t until_us;
} pulled[BLOWS];

static void mend(uint64_t now_us) {
    for (unsigned i = 0; i < BLOWS; i++) {
        if (pulled[i].until_us != 0 && pulled[i].until_us <= now_us) {
            pull(pulled[i].node, pulled[i].link, false);
            pulled[i].until_us = 0;
        }
    }
}

static void strike(unsigned blow, const struct place *as) {
    unsigned node = draw(place.world.nodes), link = draw(as->dimension);
    struct host_node_set set = only(node);
    switch (draw(6)) {
    case 0:
        pull(node, link, true);
        pulled[blow].node = node;
        pulled[blow].link = link;
        pulled[blow].until_us = place.world.now_us + draw(20) * (uint64_t)S + 1;
        break;
    case 1:
        host_world_crash(&place.world, node, draw(15) * (uint64_t)S, false);
        break;
    case 2:
        host_world_crash(&place.world, node, draw(50000), !as->bare);
        break;
    case 3:
        good(host_session_restart(&place.session, &set, NODE_RESTART_PLAIN,
                                  &place.error));
        break;
    case 4:
        host_world_pause(&place.world, node, draw(5) * (uint64_t)S);
        break;
    default:
        host_session_close(&place.session);
        come();
    }
}

static void session_in_a_storm(const struct place *as) {
    memset(pulled, 0, sizeof pulled);
    open_place(as);
    come();
    struct host_node_set set = all();
    for (unsigned blow = 0; blow < BLOWS; blow++) {
        strike(blow, as);
        good(host_session_ask(&place.session, &set, NODE_LINKS, 0,
                              draw(4) * (uint64_t)S, &place.error));
        mend(place.world.now_us);
    }
    stay(20 * S);
    mend(UINT64_MAX);
    host_sim_cube_faults(&place.world.cube, NULL);
    stay(20 * S);
    wait_for(all(), 20 * S);
    ask(all(), NODE_TOP, 0, 4 * S);
    host_session_close(&place.session);
    come();
    wait_for(all(), 20 * S);
    close_place();
}

static void storms(unsigned dimension, unsigned seeds, bool bare) {
    for (uint64_t seed = 1; seed <= seeds; seed++) {
        struct place as = {.dimension = dimension, .seed = seed, .bare = bare};
        as.dead_us = !bare && seed % 2 == 0 ? 3 * S : 0;
        as.faults.chance[SIM_LOSS] = seed % 3 == 0 ? 0.02 : 0;
        as.faults.chance[SIM_FLIP] = seed % 3 == 1 ? 1e-6 : 0;
        session_in_a_storm(&as);
    }
}

TEST(small_cubes) {
    storms(4, SEEDS, false);
}

TEST(boards) {
    storms(4, SEEDS, true);
}

TEST(large_cubes) {
    storms(6, LARGE, false);
    storms(6, LARGE, true);
}
