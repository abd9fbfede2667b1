/* A host says to node 1, behind node 0, what it is to be: the table of roles
 * has a third one here, that echoes.  The node knows each by its functions
 * alone, says in figures what keeps it from going on, and goes on with the next
 * setup. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/sim/sim_cube.h"
#include "node/node.h"
#include "node/page_check.h"
#include "node/roles/holder.h"
#include "node/roles/worker.h"
#include "echo_role.h"
#include "tests/unit/test.h"

enum { SELF = 1, MEMORY = 1 << 20, FIXED = 65536, ECHO_ROLE = 9 };

/* In the place of node/roles/roles.c. */
const struct node_role *node_role_named(uint32_t number) {
    return number == NODE_WORKER   ? &node_worker_role
           : number == NODE_HOLDER ? &node_holder_role
           : number == ECHO_ROLE   ? &echo_role
                                   : NULL;
}

/* --- a node and its host -------------------------------------------------- */

static struct {
    uint64_t now_us;
    struct host_sim_cube wires;
    struct node_board board[2];
    struct node *nodes[2];
    struct node *node; /* the one that is spoken with */
    struct cube *host;
    void *memory[3];
    uint8_t data[CUBE_PAYLOAD_MAX + 1]; /* of the last message, ended by a 0 */
    uint16_t size;
} world;

static uint64_t now_us(void *context) {
    (void)context;
    return world.now_us;
}

static void start_node(unsigned self) {
    struct node_board *board = &world.board[self];
    const char *why = NULL;
    world.memory[self] = aligned_alloc(64, MEMORY - FIXED);
    assert_non_null(world.memory[self]);
    board->identity.self = (uint16_t)self;
    board->identity.dimension = 1;
    board->identity.epoch = 100 + self;
    board->identity.window = 4;
    board->pipes[0] = host_sim_cube_pipe(&world.wires, self, 0);
    if (self == 0)
        board->pipes[1] = host_sim_cube_pipe(&world.wires, 0, 1);
    board->now_us = now_us;
    board->busy_us = now_us;
    board->arena = world.memory[self];
    board->arena_bytes = MEMORY - FIXED;
    board->fixed_bytes = FIXED;
    world.nodes[self] = node_start(board, &why);
    assert_null(why);
    assert_non_null(world.nodes[self]);
}

static int set_up(void **unused) {
    struct host_sim_cube_options options = {
        .dimension = 1,
        .wire = {.latency_us = 30, .room = 4000, .bytes = SIM_BYTES_MIN}};
    struct host_error error = {0};
    struct cube_config config;
    (void)unused;
    memset(&world, 0, sizeof world);
    memset(&config, 0, sizeof config);
    assert_int_equal(
        host_sim_cube_open(&world.wires, &options, &world.now_us, &error), 0);
    config.self = CUBE_HOST;
    config.dimension = 1;
    config.window = 4;
    config.epoch = 99;
    config.pipes[0] = host_sim_cube_pipe(&world.wires, 2, 0);
    size_t bytes = node_aligned(cube_arena_bytes(&config));
    world.memory[2] = aligned_alloc(64, bytes);
    assert_non_null(world.memory[2]);
    world.host = cube_init(world.memory[2], bytes, &config);
    assert_non_null(world.host);
    start_node(0);
    start_node(1);
    world.node = world.nodes[SELF];
    return 0;
}

static int tear_down(void **unused) {
    (void)unused;
    host_sim_cube_close(&world.wires);
    for (unsigned i = 0; i < 3; i++)
        free(world.memory[i]);
    return 0;
}

static void step(void) {
    world.now_us += 50;
    assert_int_not_equal(node_step(world.nodes[0]), NODE_STOPPED);
    assert_int_not_equal(node_step(world.nodes[1]), NODE_STOPPED);
    (void)cube_poll(world.host, world.now_us);
}

static void say(uint8_t type, const void *data, size_t size) {
    for (unsigned i = 0; cube_write(world.host, SELF, type, data, size) != 0;
         i++) {
        assert_true(i < 100000);
        step();
    }
}

/* The next message, which must be of that type. */
static const void *hear(uint8_t type) {
    struct cube_message message;
    for (unsigned i = 0; !cube_read(world.host, &message); i++) {
        assert_true(i < 100000);
        step();
    }
    memcpy(world.data, message.data, message.size);
    world.data[message.size] = 0;
    world.size = message.size;
    assert_int_equal(message.type, type);
    cube_release(world.host);
    return world.data;
}

/* The node has nothing to say for a while. */
static void hear_nothing(void) {
    struct cube_message message;
    for (unsigned i = 0; i < 1000; i++) {
        step();
        assert_false(cube_read(world.host, &message));
    }
}

static struct node_setup_message setup_of(uint8_t role) {
    struct node_setup_message setup = {
        .protocol = NODE_PROTOCOL,
        .nodes = 2,
        .holders = role == NODE_HOLDER,
        .credits = 4,
        .role = role,
        .setup = {.bricks = 7, .index = INCODE_KD, .hi = {1, 1, 1}}};
    return setup;
}

static struct node_ready_message begin(uint8_t role) {
    struct node_setup_message setup = setup_of(role);
    struct node_ready_message ready;
    say(NODE_SETUP, &setup, sizeof setup);
    memcpy(&ready, hear(NODE_READY), sizeof ready);
    assert_int_equal(world.size, sizeof ready);
    assert_int_equal(ready.protocol, NODE_PROTOCOL);
    assert_int_equal(ready.role, role);
    return ready;
}

static struct node_finished_message report(void) {
    struct node_finished_message finished;
    say(NODE_REPORT, NULL, 0);
    memcpy(&finished, hear(NODE_FINISHED), sizeof finished);
    assert_int_equal(finished.epoch, 0);
    return finished;
}

static void refuses(uint8_t type, const void *data, size_t size,
                    const char *text) {
    say(type, data, size);
    assert_string_equal(hear(NODE_FAULT), text);
    hear_nothing(); /* once */
}

/* --- roles ---------------------------------------------------------------- */

TEST_WITH(a_role_of_its_own, set_up, tear_down) {
    struct node_job_message job = {.epoch = 5};
    struct node_setup_message setup = setup_of(ECHO_ROLE);
    struct node_finished_message finished;
    say(ECHO_ASKS, "early", 5); /* without a setup */
    hear_nothing();
    struct node_ready_message ready = begin(ECHO_ROLE);
    assert_int_equal(ready.map.memory, MEMORY);
    assert_int_equal(ready.map.tables[0].bytes, ECHO_TABLE);
    assert_int_equal(ready.map.pages, 5);
    for (unsigned i = 0; i < 3; i++) {
        say(ECHO_ASKS, "echo", 4);
        assert_string_equal(hear(ECHO_ANSWERS), "echo");
        assert_int_equal(node_held(world.node), 0);
    }
    say(NODE_JOB, &job, sizeof job);
    memcpy(&finished, hear(NODE_FINISHED), sizeof finished);
    assert_int_equal(finished.epoch, 5);
    assert_int_equal(finished.pages_held, 3);
    assert_int_equal(finished.sent, 4); /* ready, three echoes */
    assert_int_equal(finished.memory_high_water, FIXED + ready.map.node +
                                                     ready.map.cube +
                                                     sizeof(struct echo));
    hear_nothing(); /* it has ended */
    setup.credits = 0;
    size_t least =
        node_arena_needed(&world.board[SELF].identity, MEMORY, &setup);
    setup.credits = 1000;
    assert_int_equal(
        node_arena_needed(&world.board[SELF].identity, MEMORY, &setup),
        least + 1000);
    assert_int_equal(least, ready.map.node + ready.map.cube + MEMORY / 1024);
}

/* The tables of a role and what they count fit what is there. */
TEST_WITH(roles_map_their_arena, set_up, tear_down) {
    static const uint8_t numbers[] = {NODE_WORKER, NODE_HOLDER};
    for (size_t i = 0; i < sizeof numbers; i++) {
        struct node_ready_message ready = begin(numbers[i]);
        const struct node_role *role = node_role_named(numbers[i]);
        uint32_t sum = ready.map.cube + ready.map.node;
        for (unsigned k = 0; k < NODE_TABLES_MAX; k++) {
            assert_int_equal(ready.map.tables[k].bytes > 0,
                             role->tables[k].name != NULL);
            assert_int_equal(ready.map.tables[k].count > 0,
                             role->tables[k].unit != NULL);
            sum += ready.map.tables[k].bytes;
        }
        assert_true(sum <= ready.map.arena);
        assert_true(sum > ready.map.arena - 4096);
        assert_true(ready.map.pages > 100);
        assert_int_equal(node_held(world.node), 0);
    }
}

/* Another setup makes another role of it; what the one before did stays
 * counted, and what it had is gone. */
TEST_WITH(a_second_setup, set_up, tear_down) {
    (void)begin(ECHO_ROLE);
    say(ECHO_ASKS, "once", 4);
    assert_string_equal(hear(ECHO_ANSWERS), "once");
    (void)begin(NODE_HOLDER);
    assert_int_equal(report().pages_held, 1);
    uint32_t page = 3;
    say(NODE_PAGE_REQUEST, &page, sizeof page);
    assert_memory_equal(hear(NODE_PAGE_REQUEST), &page, sizeof page);
    assert_int_equal(node_held(world.node), 1);
    (void)begin(NODE_WORKER);
    assert_int_equal(node_held(world.node), 0);
    struct node_finished_message finished = report();
    assert_int_equal(finished.pages_held, 1);
    assert_int_equal(finished.pages_forwarded, 1);
    struct node_job_message job = {.epoch = 1}; /* of no bricks */
    say(NODE_JOB, &job, sizeof job);
    memcpy(&finished, hear(NODE_FINISHED), sizeof finished);
    assert_int_equal(finished.epoch, 1);
    (void)begin(ECHO_ROLE);
    assert_int_equal(report().pages_held, 1);
}

/* A pong tells that something was done, what is waited for, and who has not the
 * key. */
static uint32_t refused_links(void *context) {
    (void)context;
    return 5;
}

static struct node_pong_message pong_of(void) {
    struct node_ping_message ping = {0};
    struct node_pong_message pong;
    say(NODE_PING, &ping, sizeof ping);
    memcpy(&pong, hear(NODE_PONG), sizeof pong);
    assert_int_equal(world.size, sizeof pong);
    return pong;
}

TEST_WITH(pongs_tell_of_work, set_up, tear_down) {
    struct node_job_message job = {.epoch = ECHO_FAILS};
    struct node_pong_message none = pong_of();
    assert_int_equal(none.awaited, INCODE_NONE);
    assert_int_equal(none.refused, 0);
    (void)begin(ECHO_ROLE);
    assert_int_equal(pong_of().work, none.work);
    say(ECHO_ASKS, "more", 4);
    (void)hear(ECHO_ANSWERS);
    struct node_pong_message some = pong_of();
    assert_int_not_equal(some.work, none.work);
    assert_int_equal(some.awaited, INCODE_NONE);
    world.board[SELF].refused = refused_links;
    assert_int_equal(pong_of().refused, 5);
    assert_int_equal(pong_of().work, some.work); /* answers are none */
    say(NODE_JOB, &job, sizeof job);
    (void)hear(NODE_FAULT);
    assert_int_equal(pong_of().awaited, ECHO_FAILS);
}

/* --- faults --------------------------------------------------------------- */

TEST_WITH(an_unknown_role, set_up, tear_down) {
    struct node_setup_message setup = setup_of(7);
    struct node_ping_message ping = {2};
    struct node_pong_message pong;
    (void)begin(ECHO_ROLE);
    char text[64];
    snprintf(text, sizeof text, "unknown role 7, known are 1..%u",
             (unsigned)NODE_ROLES);
    refuses(NODE_SETUP, &setup, sizeof setup, text);
    say(ECHO_ASKS, "none", 4); /* to the role before */
    say(NODE_PING, &ping, sizeof ping);
    memcpy(&pong, hear(NODE_PONG), sizeof pong);
    assert_int_equal(pong.start, 100 + SELF);
    assert_int_equal(pong.received, 3);
    assert_int_equal(pong.sent, 2);
    (void)begin(NODE_WORKER);
    (void)begin(ECHO_ROLE);
    setup = setup_of(ECHO_ROLE);
    setup.credits = 0;
    refuses(NODE_SETUP, &setup, sizeof setup, "nothing to echo");
}

TEST_WITH(setups_of_other_versions, set_up, tear_down) {
    struct node_setup_message setup = setup_of(NODE_WORKER);
    struct {
        struct node_setup_message setup;
        uint64_t more;
    } later = {setup, 0};
    assert_int_equal(NODE_PROTOCOL, 12);
    setup.protocol = later.setup.protocol = 6;
    refuses(NODE_SETUP, &setup, sizeof setup,
            "protocol version 6, expected 12");
    refuses(NODE_SETUP, &later, sizeof later,
            "protocol version 6, expected 12");
    refuses(NODE_SETUP, &later, 4, "protocol version 6, expected 12");
    refuses(NODE_SETUP, &later, 3, "setup in 3 bytes, expected 240");
    later.setup.protocol = 12;
    refuses(NODE_SETUP, &later, 244, "setup in 244 bytes, expected 240");
}

TEST_WITH(invalid_setups, set_up, tear_down) {
    struct node_setup_message setup = setup_of(NODE_WORKER);
    setup.nodes = 8;
    refuses(NODE_SETUP, &setup, sizeof setup,
            "invalid setup: 8 nodes, expected 2");
    setup.nodes = setup.holders = 2;
    refuses(NODE_SETUP, &setup, sizeof setup,
            "invalid setup: 2 holders of 2 nodes");
    setup = setup_of(NODE_HOLDER);
    setup.holders = 0;
    refuses(NODE_SETUP, &setup, sizeof setup,
            "invalid setup: a holder among 0 holders");
    setup.holders = 3;
    refuses(NODE_SETUP, &setup, sizeof setup,
            "invalid setup: 3 holders of 2 nodes");
    setup = setup_of(NODE_WORKER);
    setup.holders = 1; /* it would ask itself for pages */
    refuses(NODE_SETUP, &setup, sizeof setup,
            "invalid setup: node 1 works, and is one of 1 holders");
    setup = setup_of(NODE_HOLDER);
    setup.setup.bricks = 0;
    refuses(NODE_SETUP, &setup, sizeof setup, "there are no points");
    setup = setup_of(ECHO_ROLE);
    setup.reserved[1] = 9;
    refuses(NODE_SETUP, &setup, sizeof setup,
            "invalid setup: reserved byte 1 is 9");
    (void)begin(ECHO_ROLE);
    refuses(NODE_PING, &setup, 3, "ping in 3 bytes, expected 4");
    (void)begin(ECHO_ROLE);
    refuses(NODE_REPORT, &setup, 3,
            "message of type 6 in 3 bytes, expected none");
    (void)begin(ECHO_ROLE);
    refuses(NODE_STOP, &setup, 3,
            "message of type 7 in 3 bytes, expected none");
}

TEST_WITH(what_a_worker_refuses, set_up, tear_down) {
    struct node_job_message job = {.epoch = 1, .job = {.first = 5, .last = 3}};
    struct node_page_message page = {.head.page = 17};
    size_t whole = node_page_seal(&page, 0, INCODE_PAGE_BYTES);
    struct node_spill_header header = {.epoch = 0, .brick = 6, .sent = 1};
    (void)begin(NODE_WORKER);
    refuses(NODE_JOB, &job, sizeof job, "invalid job: bricks 5..3");
    (void)begin(NODE_WORKER);
    job.job.last = 8;
    refuses(NODE_JOB, &job, sizeof job, "invalid job: bricks 5..8");
    (void)begin(NODE_WORKER);
    refuses(NODE_JOB, &job, 10, "job in 10 bytes, expected 64");
    (void)begin(NODE_WORKER);
    job.job.last = 7;
    job.epoch = 0;
    refuses(NODE_JOB, &job, sizeof job, "invalid job: epoch 0");
    (void)begin(NODE_WORKER);
    job.epoch = 1;
    say(NODE_JOB, &job, sizeof job);
    (void)hear(NODE_PAGE_REQUEST);
    job.epoch = 2;
    refuses(NODE_JOB, &job, sizeof job, "job 2 before job 1 is done");
    (void)begin(NODE_WORKER);
    refuses(NODE_PAGE, &page, whole, "page 17 was not requested");
    (void)begin(NODE_WORKER);
    refuses(NODE_PAGE, &page, 2, "page in 2 bytes, expected 12 at least");
    (void)begin(NODE_WORKER);
    job.epoch = 1;
    say(NODE_JOB, &job, sizeof job);
    (void)hear(NODE_PAGE_REQUEST);
    refuses(NODE_PAGE, &page, node_page_seal(&page, 0, 24),
            "page 17 of 24 bytes was not requested");
    (void)begin(NODE_WORKER);
    refuses(NODE_UNSPILL, &header, 8,
            "spilled faces in 8 bytes, header takes 20");
    (void)begin(NODE_WORKER);
    header.count = 2;
    refuses(NODE_UNSPILL, &header, sizeof header,
            "2 spilled faces in 20 bytes");
    (void)begin(NODE_WORKER);
    refuses(NODE_CREDIT, &header, 3, "credit in 3 bytes, expected 4");
    (void)begin(NODE_WORKER);
    header.count = 3; /* of 4 credits */
    refuses(NODE_CREDIT, &header.count, 4, "credit 3 after credit 4");
    (void)begin(NODE_WORKER);
    refuses(ECHO_ASKS, NULL, 0, "message of type 77 for a worker");
    (void)begin(NODE_WORKER);
    job.reserved = 3;
    refuses(NODE_JOB, &job, sizeof job, "invalid job: what is reserved is 3");
    (void)begin(NODE_WORKER);
    job.reserved = 0;
    job.job.hi[1] = -1;
    refuses(NODE_JOB, &job, sizeof job,
            "invalid job: the box of bricks 5..7 is empty or infinite");
}

/* What it says to a page that it has asked for. */
static void takes_no_page(const void *data, size_t bytes) {
    struct node_page_message page;
    struct node_job_message job = {.epoch = 1, .job = {.last = 7}};
    char text[80];
    (void)begin(NODE_WORKER);
    say(NODE_JOB, &job, sizeof job);
    memcpy(&page.head.page, hear(NODE_PAGE_REQUEST), sizeof page.head.page);
    assert_int_equal(page.head.page, 0);
    memcpy(page.data, data, bytes);
    snprintf(text, sizeof text,
             "content of page 0 in %zu bytes is out of its limits", bytes);
    refuses(NODE_PAGE, &page, node_page_seal(&page, 0, bytes), text);
}

TEST_WITH(pages_that_a_worker_refuses, set_up, tear_down) {
    double points[3][INCODE_BRICK_POINTS + 1] = {{0}};
    double *last = &points[2][INCODE_BRICK_POINTS - 3];
    takes_no_page(points, 0);
    takes_no_page(points, 23);
    takes_no_page(points, 25);
    *last = NAN;
    takes_no_page(points, INCODE_BRICK_BYTES);
    *last = INFINITY;
    takes_no_page(points, INCODE_BRICK_BYTES);
    *last = 1.5; /* outside the box of all points */
    takes_no_page(points, INCODE_BRICK_BYTES);
}

TEST_WITH(what_a_holder_refuses, set_up, tear_down) {
    struct node_job_message job = {.epoch = 1};
    uint32_t pages[NODE_PAGES_IN_FLIGHT_MAX + 1];
    struct node_page_message page = {.head.page = 17};
    size_t whole = node_page_seal(&page, 0, INCODE_PAGE_BYTES);
    (void)begin(NODE_HOLDER);
    refuses(NODE_JOB, &job, sizeof job, "a job for a node that holds pages");
    (void)begin(NODE_HOLDER);
    refuses(NODE_PAGE, &page, whole, "page 17 was not requested");
    (void)begin(NODE_HOLDER);
    refuses(NODE_PAGE, &page, 3, "page in 3 bytes, expected 12 at least");
    (void)begin(NODE_HOLDER);
    memset(pages, 0, sizeof pages);
    refuses(NODE_PAGE_REQUEST, pages, sizeof pages,
            "more than 256 pages requested at a time");
    (void)begin(NODE_HOLDER);
    refuses(NODE_PAGE_REQUEST, pages, 5,
            "request in 5 bytes, expected 4 a page");
    (void)begin(NODE_HOLDER);
    refuses(NODE_UNSPILL, &page, 20,
            "message of type 5 for a node that holds pages");
    (void)begin(NODE_HOLDER);
    pages[0] = 8; /* 7 bricks and their boxes */
    refuses(NODE_PAGE_REQUEST, pages, 4,
            "request for page 8, which node 1 has not");
    (void)begin(NODE_HOLDER);
    page.head.page = pages[0] = 7;
    whole = node_page_seal(&page, 0, INCODE_PAGE_BYTES);
    say(NODE_PAGE_REQUEST, pages, 4);
    (void)hear(NODE_PAGE_REQUEST);
    refuses(NODE_PAGE, &page, whole,
            "content of page 7 in 1568 bytes is out of its limits");
}

/* Nothing moves when a role finds it, and the board would sleep. */
TEST_WITH(a_fault_is_told_at_once, set_up, tear_down) {
    struct node_job_message job = {.epoch = ECHO_FAILS};
    echo_is_worn = false;
    (void)begin(ECHO_ROLE);
    say(NODE_JOB, &job, sizeof job);
    for (unsigned i = 0; !echo_is_worn; i++) {
        assert_true(i < 100000);
        world.now_us += 50;
        (void)node_step(world.nodes[0]);
        (void)node_step(world.node);
        (void)cube_poll(world.host, world.now_us);
    }
    /* It has left in the step that found it. */
    assert_string_equal(hear(NODE_FAULT), "worn out");
}

/* Where a node cannot start, its board learns which limit is broken. */
TEST_WITH(boards_that_are_refused, set_up, tear_down) {
    struct node_board board = world.board[SELF];
    const char *why = NULL;
    board.identity.dimension = CUBE_DIMENSION_MAX + 1;
    assert_null(node_start(&board, &why));
    assert_string_equal(why, "dimension is above 10");
    board = world.board[SELF];
    board.arena_bytes = 64;
    assert_null(node_start(&board, &why));
    assert_string_equal(why, "the memory does not hold the links' windows");
    board.arena_bytes = UINT32_MAX;
    assert_null(node_start(&board, &why));
    assert_string_equal(why, "a node's memory is below 4 GiB");
}
