/* The node program on the simulator's cube, whose wires cut and hold back bytes
 * at random, and a plain host beside it.  Whatever the
 * nodes, roles, windows and memories, the tetrahedra are the same, each brick
 * is committed once, and no node ever has more pages under way than agreed. */

#include "host/verify/check.h"
#include "host/mesh/gen.h"
#include "host/mesh/tetrahedra.h"
#include "host/mesh/order.h"
#include "host/service/ledger.h"
#include "host/mesh/spill.h"
#include "host/sim/sim_world.h"
#include "node/node.h"
#include "node/page_check.h"
#include "node/result.h"
#include "tests/unit/test.h"

enum { NODES = 8, QUEUE = 256 };

struct waiting {
    uint32_t pages[QUEUE], first, count;
    struct node_spill_header unspill;
    struct host_spill_list list;
    bool unspills, ready, finished;
    uint32_t results, credit, sent;
};

static struct {
    unsigned nodes, dimension, workers;
    struct host_world sim;
    struct host_machine machine;
    struct cube *cube;
    void *memory; /* of the host's cube */
    struct waiting waiting[NODES];
    struct host_order order;
    struct host_ledger ledger;
    struct host_spill spill;
    struct host_tetrahedra tets;
    struct node_setup_message setup;
    unsigned ready, finished;
} world;

static uint64_t state = 88172645463325252u;

static uint32_t draw(uint32_t below) {
    return (uint32_t)(sim_draw(&state) >> 32) % below;
}

static void start(unsigned window, size_t memory) {
    /* Frames are sent in pieces, and some of them arrive so. */
    const struct host_world_options options = {
        .cube = {.dimension = world.dimension,
                 .seed = draw(UINT32_MAX),
                 .wire = {20000000, 10, 700, SIM_BYTES_MIN},
                 .faults = {.chance = {[SIM_STALL] = 1e-3}, .stall_us = 100},
                 .gather_us = 1},
        .memory = memory,
        .window = (uint8_t)window,
        .step_us = 20,
        .host_us = 25,
        .time_us_max = UINT64_MAX,
        .steps_max = UINT64_MAX,
    };
    struct host_error error = {0};
    struct cube_config config;
    memset(&config, 0, sizeof config);
    assert_int_equal(host_world_open(&world.sim, &options, &error), 0);
    world.machine = host_world_machine(&world.sim);
    config.self = CUBE_HOST;
    config.dimension = (uint8_t)world.dimension;
    config.window = (uint16_t)window;
    config.epoch = world.machine.epoch;
    config.pipes[0] = world.machine.pipe;
    size_t bytes = (cube_arena_bytes(&config) + 63) / 64 * 64;
    world.memory = aligned_alloc(64, bytes);
    assert_non_null(world.memory);
    world.cube = cube_init(world.memory, bytes, &config);
    assert_non_null(world.cube);
}

/* ---- a plain host ---- */

static void take_result(const struct cube_message *m) {
    struct node_result_reader reader;
    struct host_error error = {0};
    enum node_result_event event;
    uint32_t epoch;
    size_t count;
    memcpy(&epoch, m->data, 4);
    assert_true(host_ledger_current(&world.ledger, m->source, epoch));
    world.waiting[m->source].results++;
    node_result_open(&reader, m->data + 8, m->size - 8u,
                     64 * world.order.bricks, m->source, world.nodes);
    do {
        uint32_t(*rows)[4] = host_tetrahedra_room(&world.tets, 500, &error);
        assert_non_null(rows);
        event = node_result_read(&reader, rows, 500, &count);
        assert_int_not_equal(event, NODE_RESULT_GARBAGE);
        host_tetrahedra_keep(&world.tets, count);
        if (event == NODE_RESULT_COMMIT) {
            assert_int_equal(
                host_ledger_commit(&world.ledger, m->source, reader.brick), 0);
        }
    } while (event != NODE_RESULT_END);
}

static void take_requests(const struct cube_message *m) {
    struct waiting *w = &world.waiting[m->source];
    for (uint32_t at = 0; at < m->size; at += 4) {
        assert_true(w->count < QUEUE);
        memcpy(&w->pages[(w->first + w->count++) % QUEUE], m->data + at, 4);
    }
}

static void take(const struct cube_message *m) {
    struct waiting *w = &world.waiting[m->source];
    struct incode_face faces[NODE_FACES_A_MESSAGE];
    struct node_spill_header header = {0};
    struct host_error error = {0};
    switch (m->type) {
    case NODE_READY:
        assert_int_equal(m->size, sizeof(struct node_ready_message));
        w->ready = true;
        world.ready++;
        break;
    case NODE_PAGE_REQUEST:
        take_requests(m);
        break;
    case NODE_RESULT:
        take_result(m);
        break;
    case NODE_SPILL:
        memcpy(&header, m->data, sizeof header);
        memcpy(faces, m->data + sizeof header, m->size - sizeof header);
        assert_int_equal(host_spill_put(&world.spill, m->source, faces,
                                        header.count, &error),
                         0);
        break;
    case NODE_UNSPILL_REQUEST:
        assert_false(w->unspills);
        memcpy(&w->unspill, m->data, sizeof w->unspill);
        w->list = host_spill_detach(&world.spill, m->source, w->unspill.brick);
        w->unspills = true;
        break;
    case NODE_FINISHED:
        assert_int_equal(host_ledger_finish(&world.ledger, m->source), 0);
        world.finished++;
        break;
    default:
        fail_msg("node %u: message %u: %.*s", m->source, m->type, (int)m->size,
                 (const char *)m->data);
    }
}

/* Messages are counted: they say so themselves, where it matters. */
static int write_to(uint16_t to, uint8_t type, const void *data, size_t size) {
    int status = cube_write(world.cube, to, type, data, size);
    world.waiting[to].sent += status == 0;
    return status;
}

static void serve(uint16_t to) {
    struct waiting *w = &world.waiting[to];
    struct host_error error = {0};
    struct {
        struct node_spill_header header;
        struct incode_face faces[NODE_FACES_A_MESSAGE];
    } back;
    struct node_page_message body;
    uint32_t credit = w->results + world.setup.credits;
    if (credit != w->credit &&
        write_to(to, NODE_CREDIT, &credit, sizeof credit) == 0)
        w->credit = credit;
    while (w->count > 0) {
        body.head.page = w->pages[w->first];
        size_t size = host_page(&world.order, body.head.page, body.data);
        if (write_to(to, NODE_PAGE, &body,
                     node_page_seal(&body, world.setup.page_key, size)) != 0)
            break;
        w->first = (w->first + 1) % QUEUE;
        w->count--;
    }
    while (w->unspills && cube_room(world.cube, to) > 0) {
        back.header = w->unspill;
        assert_int_equal(host_spill_take(&world.spill, &w->list, back.faces,
                                         NODE_FACES_A_MESSAGE,
                                         &back.header.count, &error),
                         0);
        back.header.last = w->list.faces == 0;
        back.header.sent = w->sent;
        w->unspills = !back.header.last;
        assert_int_equal(write_to(to, NODE_UNSPILL, &back,
                                  sizeof back.header + 12 * back.header.count),
                         0);
    }
}

/* A while of the nodes; the host sometimes looks away. */
static void step(void) {
    struct cube_message message;
    (void)world.machine.now_us(world.machine.context);
    assert_null(world.sim.fault);
    for (unsigned i = 0; i < world.nodes; i++) {
        const struct host_world_node *node = &world.sim.node[i];
        assert_true(node->state != HOST_WORLD_UP ||
                    node_wait_us(node->node) <= 1000000);
    }
    if (draw(3) != 0) {
        (void)cube_poll(world.cube, world.sim.now_us);
        while (cube_read(world.cube, &message)) {
            take(&message);
            cube_release(world.cube);
        }
        uint16_t to = (uint16_t)draw(world.nodes);
        if (world.ready == world.nodes)
            serve(to);
    }
}

static void give_jobs(void) {
    for (unsigned i = 0; i < world.workers; i++) {
        const struct host_region *region = &world.order.region[i];
        struct node_job_message job = {0};
        job.job.first = region->first;
        job.job.last = region->last;
        memcpy(job.job.lo, region->lo, sizeof region->lo);
        memcpy(job.job.hi, region->hi, sizeof region->hi);
        job.epoch =
            host_ledger_open(&world.ledger, i, region->first, region->last);
        while (write_to((uint16_t)i, NODE_JOB, &job, sizeof job) != 0)
            step();
    }
}

static void stop(void) {
    while (cube_write(world.cube, CUBE_ALL, NODE_STOP, NULL, 0) != 0)
        step();
    bool closing = false;
    for (unsigned steps = 0; world.sim.ended < world.nodes; steps++) {
        assert_true(steps < 1000000);
        step();
        if (!closing && cube_idle(world.cube)) {
            cube_close(world.cube, world.sim.now_us + 1000000);
            closing = true;
        }
    }
}

struct shape {
    unsigned dimension, window;
    bool sequential;
    size_t memory;
    uint64_t shuffle_seed;
};

/* Runs the cube on the points; the digest of the rows. */
static void run(const struct host_points *points, struct shape shape,
                struct host_digest *digest) {
    struct host_error error = {0};
    memset(&world, 0, sizeof world);
    world.dimension = shape.dimension;
    world.nodes = 1u << shape.dimension;
    world.workers = shape.sequential ? 1 : world.nodes;
    assert_int_equal(host_order_make(&world.order, "test", points->xyz,
                                     points->count, HOST_ADAPTIVE,
                                     world.workers, false, &error),
                     0);
    assert_int_equal(host_ledger_init(&world.ledger, world.order.bricks,
                                      world.nodes, &error),
                     0);
    assert_int_equal(host_spill_init(&world.spill, 0, &error), 0);
    start(shape.window, shape.memory);
    world.setup.protocol = NODE_PROTOCOL;
    world.setup.nodes = (uint16_t)world.nodes;
    world.setup.holders = (uint16_t)(world.nodes - world.workers);
    world.setup.credits = 4;
    world.setup.page_key = 0x123456789abcdef0;
    world.setup.setup.bricks = world.order.bricks;
    world.setup.setup.index = INCODE_KD;
    world.setup.setup.shuffle_seed = shape.shuffle_seed;
    memcpy(world.setup.setup.lo, world.order.lo, sizeof world.order.lo);
    memcpy(world.setup.setup.hi, world.order.hi, sizeof world.order.hi);
    for (unsigned i = 0; i < world.nodes; i++) {
        world.setup.role = i < world.workers ? NODE_WORKER : NODE_HOLDER;
        while (cube_write(world.cube, (uint16_t)i, NODE_SETUP, &world.setup,
                          sizeof world.setup) != 0)
            step();
    }
    while (world.ready < world.nodes)
        step();
    for (unsigned i = 0; i < world.nodes; i++) {
        world.waiting[i].credit = world.setup.credits;
        world.waiting[i].sent = 1; /* the setup */
    }
    give_jobs();
    while (world.finished < world.workers)
        step();
    assert_int_equal(world.ledger.committed, world.order.bricks);
    assert_int_equal(world.spill.faces, 0);
    stop();
    host_tetrahedra_map(&world.tets, world.order.row);
    host_tetrahedra_sort(&world.tets);
    host_digest(&world.tets, digest);
    assert_null(host_world_damage(&world.sim));
    host_world_close(&world.sim);
    free(world.memory);
    host_spill_free(&world.spill);
    host_ledger_free(&world.ledger);
    host_order_free(&world.order);
}

TEST(test_cubes) {
    static const struct shape shapes[] = {
        {0, 8, false, 4u << 20, 0},  {1, 8, false, 4u << 20, 0},
        {3, 1, false, 1u << 20, 0},  {3, 2, false, 512u << 10, 5},
        {2, 4, true, 1u << 20, 0},   {3, 1, true, 512u << 10, 9},
        {3, 2, false, 512u << 10, 0}};
    static const struct {
        const char *kind;
        uint64_t n;
    } sets[] = {{"uniform", 2500}, {"grid", 1000}};
    for (size_t s = 0; s < sizeof sets / sizeof sets[0]; s++) {
        struct host_points points = {0};
        struct host_error error = {0};
        struct host_digest first, digest;
        static struct host_check_report report;
        assert_int_equal(host_gen(sets[s].kind, sets[s].n, 3, &points, &error),
                         0);
        for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
            run(&points, shapes[i], &digest);
            if (i == 0) {
                assert_int_equal(host_verify(&points, &world.tets,
                                             HOST_CHECK_DELAUNAY, &report,
                                             &error),
                                 0);
                first = digest;
            }
            assert_string_equal(digest.text, first.text);
            host_tetrahedra_free(&world.tets);
        }
        host_points_free(&points);
    }
}

/* What does not fit is said, not tried. */
TEST(test_small) {
    static _Alignas(64) uint8_t arena[4096];
    struct sim_end nowhere = {NULL, NULL, NULL};
    struct node_board board;
    const char *why = NULL;
    memset(&board, 0, sizeof board);
    board.identity.epoch = 1;
    board.pipes[0] = sim_pipe(&nowhere);
    board.arena = arena;
    board.arena_bytes = sizeof arena;
    assert_null(node_start(&board, &why));
    assert_non_null(strstr(why, "memory"));
}
