/* The waves of an exchange at a node that has no others: what it concludes from
 * sums that change, that agree, and that never do. */

#include "node/roles/waves.h"
#include "tests/unit/test.h"

static struct {
    struct node_waves waves;
    struct node_counted counted;
    struct node_fault fault;
    struct node_waves_state state;
} world;

static void begin(uint64_t sent, uint64_t received) {
    static const struct node_setup_message setup = {.nodes = 1};
    memset(&world, 0, sizeof world);
    world.state = (struct node_waves_state){.ready = true,
                                            .quiet = true,
                                            .sent = sent,
                                            .received = received,
                                            .left = 7};
    node_waves_init(&world.waves, &setup, &world.counted, &world.fault);
    node_waves_begin(&world.waves);
}

/* So many waves, one after another, each after so long; the last command. */
static uint8_t waves(unsigned count, uint64_t step_us) {
    uint8_t command = 0;
    while (count-- > 0 && !node_fault_is_set(&world.fault)) {
        world.waves.now_us += step_us;
        (void)node_waves_send(&world.waves, &world.state, &command);
    }
    return command;
}

TEST(sums_that_agree) {
    begin(5, 5);
    assert_int_equal(waves(1, 1), NODE_WAVE_COUNT);
    assert_int_equal(waves(1, 1), NODE_WAVE_SEED);
    assert_int_equal(waves(1, 1), NODE_WAVE_COUNT);
    assert_false(node_fault_is_set(&world.fault));
    (void)waves(2, 1);
    assert_non_null(strstr(world.fault.text, "7 bricks are not closed"));
    begin(5, 5);
    (void)waves(1, 1);
    world.state.left = 0;
    (void)waves(1, 1);
    assert_true(world.waves.over);
    assert_false(node_fault_is_set(&world.fault));
}

/* Many waves in a short time, or few in a long one, prove nothing; nor does
 * what comes slowly. */
TEST(slow_messages) {
    begin(5, 4);
    (void)waves(100 * NODE_WAVES_UNCHANGED, 500);
    assert_false(node_fault_is_set(&world.fault));
    begin(5, 4);
    (void)waves(NODE_WAVES_UNCHANGED - 1, NODE_WAVES_UNCHANGED_US);
    assert_false(node_fault_is_set(&world.fault));
    begin(1000, 1);
    for (unsigned i = 0; i < 500; i++, world.state.received++)
        (void)waves(NODE_WAVES_UNCHANGED - 1, NODE_WAVES_UNCHANGED_US / 100);
    assert_false(node_fault_is_set(&world.fault));
    world.state.quiet = false; /* a node that stands still answers none */
    (void)waves(10 * NODE_WAVES_UNCHANGED, NODE_WAVES_UNCHANGED_US);
    assert_false(node_fault_is_set(&world.fault));
}

/* What was sent and never comes is a fault that names the sums. */
TEST(sums_that_never_agree) {
    begin(12, 9);
    (void)waves(NODE_WAVES_UNCHANGED + 2,
                2 * NODE_WAVES_UNCHANGED_US / NODE_WAVES_UNCHANGED);
    assert_non_null(strstr(world.fault.text, "of 12 sent to others 9 have"));
}
