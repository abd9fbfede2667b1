/* Who a node is, where its board is not told: an epoch of random bytes or of a
 * counter, a number from a neighbour's greeting. */

#include "host/sim/sim_cube.h"
#include "node/identity.h"
#include "tests/unit/test.h"

static uint32_t next; /* what the generator gives */
static unsigned draws;

static bool generate(void *context, uint8_t *bytes, size_t size) {
    (void)context;
    memset(bytes, 0, size);
    memcpy(bytes, &next, size < sizeof next ? size : sizeof next);
    draws++;
    next++;
    return true;
}

static bool fail_to(void *context, uint8_t *bytes, size_t size) {
    (void)context;
    memset(bytes, 0, size);
    return false;
}

TEST(epochs) {
    struct node_identity id = {.self = 3};
    struct secure_source none = {.boot = 0}, counts = {.boot = 1},
                         random = {.random = generate};
    assert_false(node_identity_epoch(&id, &none));
    none.random = fail_to;
    assert_false(node_identity_epoch(&id, &none));
    next = 0; /* which is no epoch */
    assert_true(node_identity_epoch(&id, &random));
    assert_int_equal(id.epoch, 1);
    assert_int_equal(draws, 2);
    static const uint64_t boots[] = {1, 2, UINT32_MAX, UINT64_C(1) << 32};
    static const uint32_t epochs[] = {1, 2, UINT32_MAX, 1};
    for (unsigned i = 0; i < 4; i++) {
        counts.boot = boots[i];
        assert_true(node_identity_epoch(&id, &counts));
        assert_int_equal(id.epoch, epochs[i]);
    }
    counts.random = fail_to; /* it has the counter all the same */
    counts.boot = 9;
    assert_true(node_identity_epoch(&id, &counts));
    assert_int_equal(id.epoch, 9);
    assert_int_equal(id.self, 3);
}

/* NOLINTNEXTLINE(readability-non-const-parameter): a pipe's signature */
static int deaf(void *context, uint8_t *bytes, size_t size) {
    (void)context, (void)bytes, (void)size;
    return 0;
}

/* Node 1 of two hears node 0, whose wire may be in the wrong link first. */
TEST(a_neighbour_says_it) {
    uint64_t now_us = 0;
    struct host_sim_cube wires;
    const struct host_sim_cube_options options = {
        .dimension = 1,
        .wire = {.latency_us = 30, .room = 4000, .bytes = SIM_BYTES_MIN}};
    struct host_error error = {0};
    struct node_board board;
    struct learner learner;
    struct node_identity id = {.window = 5};
    struct cube_config config;
    memset(&board, 0, sizeof board);
    memset(&config, 0, sizeof config);
    assert_int_equal(host_sim_cube_open(&wires, &options, &now_us, &error), 0);
    board.pipes[0] = host_sim_cube_pipe(&wires, 1, 0);
    config.dimension = 1;
    config.window = 4;
    config.epoch = 7;
    config.pipes[0] = host_sim_cube_pipe(&wires, 0, 0);
    config.pipes[1] = host_sim_cube_pipe(&wires, 0, 1);
    size_t bytes = (cube_arena_bytes(&config) + 63) / 64 * 64;
    void *memory = aligned_alloc(64, bytes);
    struct cube *cube = cube_init(memory, bytes, &config);
    assert_non_null(cube);
    /* A node with three wires is not who node 0 means. */
    board.pipes[1] = board.pipes[2] = board.pipes[0];
    node_identity_listen(&learner, &board, 3);
    for (unsigned i = 0; node_identity_doubt(&learner) == NULL; i++) {
        assert_true(i < 100);
        now_us += 20000;
        (void)cube_poll(cube, now_us);
        assert_false(node_identity_hear(&learner, &id));
    }
    assert_non_null(strstr(node_identity_doubt(&learner), "number of wires"));
    node_identity_listen(&learner, &board, 1);
    assert_null(node_identity_doubt(&learner));
    for (unsigned i = 0; !node_identity_hear(&learner, &id); i++) {
        assert_true(i < 100);
        now_us += 20000;
        (void)cube_poll(cube, now_us);
    }
    assert_int_equal(id.self, 1);
    assert_int_equal(id.dimension, 1);
    assert_int_equal(id.window, 5);
    assert_false(id.host_port);
    /* A board of four sockets and one for a host, which asks: node 0 has not
     * met it before, and it has no wire to a host. */
    board.pipes[4] = host_sim_cube_pipe(&wires, 0, 1);
    board.pipes[1].receive = board.pipes[2].receive = deaf;
    board.pipes[3] = board.pipes[1];
    board.pipes[4].receive = deaf;
    id = (struct node_identity){.window = 5};
    node_identity_listen_ports(&learner, &board, 4, true);
    for (unsigned i = 0; !node_identity_hear(&learner, &id); i++) {
        assert_true(i < 100);
        node_identity_ask(&learner, now_us);
        now_us += 20000;
        (void)cube_poll(cube, now_us);
    }
    assert_int_equal(id.self, 1);
    assert_int_equal(id.dimension, 1);
    assert_false(id.host_port);
    assert_false(node_identity_epoch_behind(&learner, &id));
    free(memory);
    host_sim_cube_close(&wires);
}

TEST(an_epoch_follows_what_neighbours_knew) {
    struct learner learner = {.known = {.epoch = 0}};
    struct node_identity id = {.epoch = 0};
    assert_false(node_identity_epoch_behind(&learner, &id));
    assert_int_equal(id.epoch, 1);
    learner.known.epoch = 17;
    assert_true(node_identity_epoch_behind(&learner, &id));
    assert_int_equal(id.epoch, 18);
    learner.known.epoch = UINT32_MAX;
    assert_true(node_identity_epoch_behind(&learner, &id));
    assert_int_equal(id.epoch, 1);
}
