/* A face manager and a tetrahedron builder by themselves: what they send, and
 * to whom, where links have room for so many messages and no more; and what
 * they refuse. */

#include "node/page_check.h"
#include "node/roles/builder.h"
#include "node/roles/manager.h"
#include "tests/unit/test.h"

enum { SENT_MAX = 64, ARENA = 512 << 10, SELF = 1, NODES = 8 };

/* --- links, in the place of transport/cube.c ------------------------------ */

struct cube {
    unsigned room, count;
    struct sent {
        uint16_t dest, size;
        uint8_t type;
        uint32_t head[4]; /* words of the message */
    } sent[SENT_MAX];
};

int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size) {
    if (cube->room == 0)
        return CUBE_AGAIN;
    assert_true(cube->count < SENT_MAX);
    struct sent *sent = &cube->sent[cube->count];
    *sent = (struct sent){.dest = dest, .type = type, .size = (uint16_t)size};
    memcpy(sent->head, data, size < 16 ? size : 16);
    cube->room--;
    cube->count++;
    return 0;
}

unsigned cube_room(const struct cube *cube, uint16_t dest) {
    (void)dest;
    return cube->room;
}

/* --- a role --------------------------------------------------------------- */

static struct {
    _Alignas(64) uint8_t arena[ARENA];
    struct cube cube;
    struct node_counted counted;
    struct node_fault fault;
    const struct node_role *role;
    struct node_pace pace;
    uint64_t now_us;
} world;

static uint64_t now_us(void *context) {
    (void)context;
    return world.now_us++;
}

static struct node_setup_message setup_of(uint8_t role) {
    struct node_setup_message setup = {
        .protocol = NODE_PROTOCOL,
        .nodes = NODES,
        .credits = 4,
        .role = role,
        .jobs_per_worker = 2,
        .setup = {.bricks = 70,
                  .index = INCODE_KD,
                  .owner_rule = INCODE_OWNER_LOWEST,
                  .hi = {1, 1, 1}}};
    if (role == NODE_MANAGER) {
        setup.builders[0] = 0xd; /* nodes 0, 2 and 3 */
        setup.faces_per_job = 4;
    }
    return setup;
}

static bool start(const struct node_setup_message *setup) {
    memset(&world, 0, sizeof world);
    world.counted.cube = &world.cube;
    world.counted.self = SELF;
    world.role =
        setup->role == NODE_MANAGER ? &node_manager_role : &node_builder_role;
    node_pace_init(&world.pace, now_us, NULL);
    return world.role->start(world.arena, ARENA, setup, &world.counted,
                             &world.fault);
}

static void begin(uint8_t role) {
    const struct node_setup_message setup = setup_of(role);
    assert_true(start(&setup));
    assert_false(node_fault_is_set(&world.fault));
    assert_int_equal(world.role->held(world.arena), 0);
}

static void say(uint16_t source, uint8_t type, const void *data, size_t size) {
    const struct cube_message message = {
        .source = source, .type = type, .data = data, .size = (uint16_t)size};
    world.role->message(world.arena, &message, world.now_us);
}

/* Works, where links take so many messages: how many leave. */
static unsigned works(unsigned room) {
    world.cube.room = room;
    world.cube.count = 0;
    node_pace_begin(&world.pace, now_us(NULL));
    (void)world.role->work(world.arena, &world.pace);
    (void)world.role->send(world.arena);
    return world.cube.count;
}

static void expect_fault(const char *text) {
    assert_int_equal(world.fault.size, strlen(text));
    assert_memory_equal(world.fault.text, text, world.fault.size);
}

static void job(uint32_t last) {
    const struct node_job_message message = {.epoch = 1, .job = {.last = last}};
    say(CUBE_HOST, NODE_JOB, &message, sizeof message);
}

/* --- lists ---------------------------------------------------------------- */

/* Bricks are counted before anything else, by one builder after the other, up
 * to the places for their answers. */
TEST(lists_go_round) {
    begin(NODE_MANAGER);
    assert_int_equal(world.role->owing(world.arena), CUBE_HOST);
    job(70);
    assert_int_equal(works(1), 1);
    assert_int_equal(world.cube.sent[0].dest, 0);
    assert_int_equal(world.cube.sent[0].type, NODE_LIST);
    assert_int_equal(world.cube.sent[0].head[0], INCODE_LIST_COUNT);
    assert_int_equal(world.cube.sent[0].size,
                     incode_list_bytes(world.cube.sent[0].head[1]));
    assert_int_equal(world.role->owing(world.arena), 0);
    assert_int_equal(works(0), 0);
    assert_true(works(SENT_MAX) >= 2);
    assert_int_equal(world.cube.sent[0].dest, 2);
    assert_int_equal(world.cube.sent[1].dest, 3);
    assert_true(world.role->held(world.arena) > 0);
    assert_false(node_fault_is_set(&world.fault));
}

/* Answers come of builders that owe some, once. */
TEST(answers_that_are_not_due) {
    struct incode_answers answers = {INCODE_LIST_COUNT, 0, 1, {{0, 64, 0, 0}}};
    size_t size = incode_answers_bytes(1);
    begin(NODE_MANAGER);
    job(1);
    say(0, NODE_ANSWERS, &answers, size);
    expect_fault("list or answers from node 0, more than 0 are due");
    begin(NODE_MANAGER);
    job(1);
    assert_true(works(1) == 1);
    say(0, NODE_ANSWERS, &answers, size);
    assert_false(node_fault_is_set(&world.fault));
    say(0, NODE_ANSWERS, &answers, size);
    expect_fault("list or answers from node 0, more than 1 are due");
    begin(NODE_MANAGER);
    say(4, NODE_ANSWERS, &answers, size);
    expect_fault("list or answers from node 4, which is none of its peers");
    begin(NODE_MANAGER);
    say(0, NODE_ANSWERS, &answers, size - 1);
    expect_fault("list or answers of 23 bytes from node 0");
    begin(NODE_MANAGER);
    job(1);
    (void)works(1);
    answers.v[0][1] = 65;
    say(0, NODE_ANSWERS, &answers, size);
    (void)works(1);
    expect_fault("answers that are none to what was asked");
}

/* A builder asks for pages, and has room for as many lists as it was told. */
TEST(lists_that_are_too_many) {
    const struct incode_list list = {INCODE_LIST_FACES, 1, {{1, 2, 3}}};
    size_t size = incode_list_bytes(1);
    begin(NODE_BUILDER);
    say(0, NODE_LIST, &list, size);
    assert_int_equal(works(4), 1);
    assert_int_equal(world.cube.sent[0].type, NODE_PAGE_REQUEST);
    assert_int_equal(world.cube.sent[0].dest, CUBE_HOST);
    assert_int_equal(world.role->awaited(world.arena), 0);
    for (unsigned i = 0; i < 2; i++) {
        say(0, NODE_LIST, &list, size);
        assert_false(node_fault_is_set(&world.fault));
    }
    say(0, NODE_LIST, &list, size);
    expect_fault("list or answers from node 0, more than 2 are due");
    begin(NODE_BUILDER);
    say(2, NODE_LIST, &list, size); /* its manager is node 0 */
    expect_fault("list or answers from node 2, which is none of its peers");
}

/* The tables of a role, and what they count, fill its arena. */
TEST(maps) {
    static const uint8_t roles[] = {NODE_MANAGER, NODE_BUILDER};
    for (unsigned i = 0; i < 2; i++) {
        struct node_map map;
        uint32_t sum = 0;
        memset(&map, 0, sizeof map);
        begin(roles[i]);
        world.role->map(world.arena, &map);
        for (unsigned k = 0; k < NODE_TABLES_MAX; k++) {
            assert_int_equal(map.tables[k].bytes > 0,
                             world.role->tables[k].name != NULL);
            assert_int_equal(map.tables[k].count > 0,
                             world.role->tables[k].unit != NULL);
            sum += map.tables[k].bytes;
        }
        assert_in_range(sum, ARENA - 4096, ARENA);
        const struct node_setup_message setup = setup_of(roles[i]);
        assert_true(world.role->arena_min(ARENA, &setup) < ARENA);
    }
}

/* --- faults --------------------------------------------------------------- */

static void refuses(const struct node_setup_message *setup, const char *text) {
    assert_false(start(setup));
    expect_fault(text);
}

TEST(invalid_setups) {
    struct node_setup_message manager = setup_of(NODE_MANAGER);
    struct node_setup_message builder = setup_of(NODE_BUILDER), s = manager;
    s.builders[0] = 0;
    refuses(&s, "invalid setup: face manager 1 has no builders");
    s.builders[0] = 2; /* itself */
    refuses(&s, "invalid setup: node 1 builds for face manager 1");
    s.builders[1] = 1;
    s.builders[0] = 0;
    refuses(&s, "invalid setup: node 8 builds for face manager 1");
    s = manager;
    s.faces_per_job = 97;
    refuses(&s, "invalid setup: 97 faces a list, allowed are 1..96");
    s.faces_per_job = 0;
    refuses(&s, "invalid setup: 0 faces a list, allowed are 1..96");
    s = manager;
    s.jobs_per_worker = 0;
    refuses(&s, "invalid setup: 0 lists a builder, allowed are 1..16");
    s = manager;
    s.setup.face_rule = INCODE_FACE_PAPER;
    refuses(&s, "invalid setup: the face rule `paper` asks a face manager for "
                "points, which it has not");
    s = builder;
    s.manager = SELF;
    refuses(&s, "invalid setup: node 1 builds for face manager 1");
    s.manager = NODES;
    refuses(&s, "invalid setup: node 1 builds for face manager 8");
    s = builder;
    s.jobs_per_worker = 17;
    refuses(&s, "invalid setup: 17 lists a builder, allowed are 1..16");
}

TEST(messages_of_others) {
    struct node_page_message page = {.head.page = 1};
    const size_t size = node_page_seal(&page, 0, 24);
    begin(NODE_MANAGER);
    say(CUBE_HOST, NODE_PAGE, &page, size);
    expect_fault("message of type 3 for a face manager");
    begin(NODE_MANAGER);
    job(71);
    expect_fault("invalid job: bricks 0..71");
    begin(NODE_BUILDER);
    job(70);
    expect_fault("a job for a node that builds");
    begin(NODE_BUILDER);
    say(CUBE_HOST, NODE_PAGE, &page, size);
    expect_fault("page 1 was not requested");
    begin(NODE_BUILDER);
    say(CUBE_HOST, NODE_UNSPILL, &page, size);
    expect_fault("message of type 5 for a builder");
}
