/* Pages among the nodes of an exchange, by themselves: whom a page is asked of,
 * what is lent, waited for or left to the host, and what comes to all. */

#include "node/roles/requests.h"
#include "tests/unit/test.h"

enum {
    SENT_MAX = 64,
    NODES = 4,
    SELF = 1,
    BRICKS = 40,
    PAGES_MAX = 64,
    PAGE_KEY = 0x5eed
};

/* --- links, in the place of transport/cube.c ------------------------------ */

struct cube {
    unsigned room, count;
    struct sent {
        uint16_t dest;
        uint8_t type;
        uint16_t size;
        uint32_t word[4]; /* of the message */
    } sent[SENT_MAX];
};

int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size) {
    if (cube->room == 0)
        return CUBE_AGAIN;
    assert_true(cube->count < SENT_MAX);
    struct sent *sent = &cube->sent[cube->count++];
    *sent = (struct sent){.dest = dest, .type = type, .size = (uint16_t)size};
    memcpy(sent->word, data, size < 16 ? size : 16);
    cube->room--;
    return 0;
}

unsigned cube_room(const struct cube *cube, uint16_t dest) {
    (void)dest;
    return cube->room;
}

/* --- pages, in the place of incode/triangulator.c ------------------------- */

enum place { ABSENT, LOADING, READY };

static struct {
    enum place place[PAGES_MAX];
    bool full;          /* pages would have to make room */
    uint32_t fetched;   /* that the node has asked for */
    uint32_t put, puts; /* the last that came unasked */
    uint64_t label[PAGES_MAX];
    bool unsound;
} had;

bool incode_triangulator_has(const struct incode_triangulator *t,
                             uint32_t page) {
    (void)t;
    return had.place[page] == READY;
}

size_t incode_triangulator_copy(const struct incode_triangulator *t,
                                uint32_t page, void *data) {
    (void)t;
    assert_int_equal(had.place[page], READY);
    memset(data, (int)page, 24);
    return 24;
}

bool incode_triangulator_fetch(struct incode_triangulator *t, uint32_t page) {
    (void)t;
    assert_int_not_equal(had.place[page], READY);
    if (had.place[page] == ABSENT && !had.full) {
        had.place[page] = LOADING;
        had.fetched++;
    }
    return had.place[page] == LOADING;
}

uint64_t *incode_triangulator_label(const struct incode_triangulator *t,
                                    uint32_t page) {
    (void)t;
    return had.place[page] == ABSENT ? NULL : &had.label[page];
}

int incode_triangulator_put(struct incode_triangulator *t, uint32_t page,
                            const void *data, size_t bytes) {
    (void)t, (void)data;
    assert_int_equal(bytes, 24);
    had.put = page;
    had.puts++;
    return had.unsound ? INCODE_PAGE_UNSOUND : 0;
}

/* --- a node of four, with ten bricks each --------------------------------- */

static struct {
    _Alignas(64) uint8_t memory[4096];
    _Alignas(64) uint8_t shares_memory[65536];
    struct cube cube;
    struct node_counted counted;
    struct node_fault fault;
    struct node_shares shares;
    struct node_lending lending;
    struct node_requests requests;
    struct incode_page_source source;
} world;

static void begin(void) {
    const struct node_setup_message setup = {
        .nodes = NODES,
        .page_key = PAGE_KEY,
        .setup = {.bricks = BRICKS, .index = INCODE_KD, .hi = {1, 1, 1}}};
    struct {
        struct node_regions_message head;
        uint32_t first[NODES + 1];
    } regions = {.head = {.count = NODES + 1}, .first = {0, 10, 20, 30, 40}};
    memset(&world, 0, sizeof world);
    memset(&had, 0, sizeof had);
    world.counted.cube = &world.cube;
    world.counted.self = SELF;
    assert_true(node_shares_bytes(NODES) <= sizeof world.shares_memory);
    assert_true(node_lending_bytes(NODES) <= sizeof world.memory);
    memset(world.memory, 0xa5, sizeof world.memory);
    node_shares_init(&world.shares, world.shares_memory, &setup,
                     &world.counted);
    node_lending_init(&world.lending, world.memory, &setup, &world.shares,
                      &world.counted, &world.fault);
    for (size_t i = node_lending_bytes(NODES); i < sizeof world.memory; i++)
        assert_int_equal(world.memory[i], 0xa5);
    node_requests_init(&world.requests, &setup, &world.lending, &world.counted,
                       &world.fault);
    world.source = node_requests_source(&world.requests);
    assert_true(node_shares_regions(&world.shares, (const uint8_t *)&regions,
                                    sizeof regions));
}

static void asks(uint16_t source, uint32_t page) {
    const struct cube_message message = {.source = source,
                                         .type = NODE_PAGE_REQUEST,
                                         .data = (const uint8_t *)&page,
                                         .size = sizeof page};
    node_lending_take(&world.lending, &message);
}

static unsigned sends(unsigned room) {
    world.cube.room = room;
    world.cube.count = 0;
    unsigned sent = node_lending_send(&world.lending, NULL);
    assert_int_equal(sent, world.cube.count);
    return sent;
}

static void expect(unsigned i, uint16_t dest, uint8_t type, uint32_t first,
                   uint32_t second) {
    assert_true(i < world.cube.count);
    assert_int_equal(world.cube.sent[i].dest, dest);
    assert_int_equal(world.cube.sent[i].type, type);
    assert_int_equal(world.cube.sent[i].word[0], first);
    assert_int_equal(world.cube.sent[i].word[1], second);
}

/* With the tag that it came with, and its bytes. */
static void expect_page(unsigned i, uint16_t dest, uint32_t page) {
    expect(i, dest, NODE_PAGE, page, (uint32_t)had.label[page]);
    assert_int_equal(world.cube.sent[i].word[2],
                     (uint32_t)(had.label[page] >> 32));
    assert_int_equal(world.cube.sent[i].word[3], page * UINT32_C(0x01010101));
}

/* Bricks of who has them, boxes of who has the first brick below: of 40 bricks
 * there are two pages at 40, and the root at 42. */
TEST(keepers) {
    static const uint32_t page[] = {0, 9, 10, 19, 20, 39, 40, 41, 42};
    static const uint16_t keeper[] = {0, 0, CUBE_HOST, CUBE_HOST, 2,
                                      3, 0, 3,         0};
    begin();
    for (size_t i = 0; i < sizeof page / sizeof *page; i++) {
        assert_int_equal(node_lending_keeper(&world.lending, page[i]),
                         keeper[i]);
    }
}

/* A page that is there goes to who asks, as links have room. */
TEST(lent) {
    begin();
    had.place[12] = had.place[13] = READY;
    had.label[12] = UINT64_C(0x0c0c0c0c0a0b0c0d);
    had.label[13] = UINT64_C(0x0d0d0d0d0a0b0c0d);
    asks(3, 12);
    asks(0, 13);
    assert_int_equal(sends(0), 0);
    assert_int_equal(sends(1), 1);
    expect_page(0, 3, 12);
    assert_int_equal(sends(8), 1);
    expect_page(0, 0, 13);
    assert_int_equal(world.cube.sent[0].size, 12 + 24);
    assert_int_equal(world.lending.queued, 0);
    assert_int_equal(world.lending.sent, 2);
    assert_int_equal(world.lending.bytes_out, 2 * (12 + 24));
    assert_false(node_fault_is_set(&world.fault));
}

/* One that the node has not had yet it gets itself, and it waits. */
TEST(not_there_yet) {
    begin();
    had.place[14] = LOADING;
    asks(3, 14);
    asks(3, 15);
    assert_int_equal(sends(8), 0);
    assert_int_equal(sends(8), 0);
    assert_int_equal(had.fetched, 1);
    had.full = true; /* those that are on their way still come */
    assert_int_equal(sends(8), 0);
    had.place[15] = READY;
    assert_int_equal(sends(8), 1);
    expect_page(0, 3, 15);
    had.place[14] = READY;
    assert_int_equal(sends(8), 1);
    assert_int_equal(world.lending.passed, 0);
}

/* One that it has given up it leaves to the host, once. */
TEST(given_up) {
    begin();
    had.full = true;
    asks(2, 16);
    assert_int_equal(sends(0), 0);
    assert_int_equal(sends(8), 1);
    expect(0, CUBE_HOST, NODE_PAGE_PASSED, 2, 16);
    assert_int_equal(world.cube.sent[0].size, 8);
    assert_int_equal(world.counted.sent, 1);
    assert_int_equal(sends(8), 0);
    assert_int_equal(world.lending.passed, 1);
    assert_int_equal(world.lending.sent, 0);
    assert_int_equal(had.fetched, 0);
}

static void refused(uint16_t source, uint32_t page, const char *why) {
    asks(source, page);
    assert_int_equal(world.fault.size, strlen(why));
    assert_memory_equal(world.fault.text, why, world.fault.size);
    begin();
}

/* What no sound node asks for. */
TEST(wrong_requests) {
    begin();
    refused(2, 9, "request for page 9, which node 1 has not");
    refused(2, 40, "request for page 40, which node 1 has not");
    refused(2, 43, "request for page 43, which node 1 has not");
    refused(CUBE_HOST, 12, "request in 4 bytes from node 65534");
    for (uint32_t i = 0; i < (NODES - 1) * NODE_PAGES_LENT_MAX; i++) {
        asks(2, 12);
        assert_false(node_fault_is_set(&world.fault));
    }
    refused(2, 12, "more than 24 pages requested at a time");
}

static unsigned sends_requests(unsigned room) {
    world.cube.room = room;
    world.cube.count = 0;
    (void)node_requests_send(&world.requests);
    return world.cube.count;
}

/* A page comes of that node, `altered` or as the host made it; whether it is to
 * be used, and if not, which is to be asked for again. */
static bool sent_by(uint16_t source, uint32_t page, bool altered,
                    struct node_page *p) {
    struct node_page_message body = {.head.page = page};
    size_t size = node_page_seal(&body, PAGE_KEY, 24);
    body.data[7] ^= altered;
    const struct cube_message message = {.source = source,
                                         .type = NODE_PAGE,
                                         .data = (const uint8_t *)&body,
                                         .size = (uint16_t)size};
    return node_requests_take(&world.requests, &message, p);
}

static void comes(uint16_t source, uint32_t page) {
    struct node_page p;
    assert_true(sent_by(source, page, false, &p));
    assert_int_equal(p.number, page);
    node_requests_judge(&world.requests, 0, &p);
}

/* A node is asked for so many at a time, and others meanwhile; whoever sends a
 * page makes room for another. */
TEST(asked_for) {
    begin();
    for (uint32_t page = 0; page < 10; page++)
        assert_true(world.source.request(world.source.context, page));
    assert_true(world.source.request(world.source.context, 25));
    assert_true(world.source.request(world.source.context, 11));
    assert_int_equal(sends_requests(8), 3);
    expect(0, 0, NODE_PAGE_REQUEST, 0, 1);
    assert_int_equal(world.cube.sent[0].size, 4 * NODE_PAGES_LENT_MAX);
    expect(1, 2, NODE_PAGE_REQUEST, 25, 0);
    expect(2, CUBE_HOST, NODE_PAGE_REQUEST, 11, 0);
    assert_int_equal(node_requests_held(&world.requests), 12);
    assert_int_equal(sends_requests(8), 0);
    comes(2, 25); /* of another */
    assert_int_equal(sends_requests(8), 0);
    comes(0, 3);
    assert_int_equal(sends_requests(8), 1);
    expect(0, 0, NODE_PAGE_REQUEST, 8, 0);
    assert_int_equal(world.cube.sent[0].size, 4);
    for (uint32_t page = 0; page < 9; page++)
        if (page != 3)
            comes(CUBE_HOST, page); /* that keeper has left them to it */
    assert_int_equal(sends_requests(8), 1);
    expect(0, 0, NODE_PAGE_REQUEST, 9, 0);
    comes(0, 9);
    comes(CUBE_HOST, 11);
    assert_int_equal(node_requests_held(&world.requests), 0);
    assert_false(node_fault_is_set(&world.fault));
}

static void expect_report(unsigned i, uint16_t sender, uint32_t page) {
    expect(i, CUBE_HOST, NODE_WRONG_PAGE, page, sender);
    assert_int_equal(world.cube.sent[i].size, 8);
}

/* A page that its keeper has altered is asked of the host; the keeper is named,
 * and others go on as they were. */
TEST(altered) {
    struct node_page p;
    begin();
    for (uint32_t page = 0; page < 9; page++)
        assert_true(world.source.request(world.source.context, page));
    assert_int_equal(sends_requests(8), 1); /* eight of them */
    assert_false(sent_by(0, 5, true, &p));
    assert_int_equal(p.number, 5);
    node_requests_again(&world.requests, p.number, true);
    assert_false(node_requests_few(&world.requests));
    assert_int_equal(node_requests_held(&world.requests), 10);
    assert_int_equal(sends_requests(8), 2);
    expect(0, CUBE_HOST, NODE_PAGE_REQUEST, 5, 0);
    assert_int_equal(world.cube.sent[0].size, 4);
    expect_report(1, 0, 5);
    /* Its keeper has eight to send yet, as far as is known. */
    assert_int_equal(sends_requests(8), 0);
    comes(CUBE_HOST, 5);
    assert_int_equal(sends_requests(8), 1);
    expect(0, 0, NODE_PAGE_REQUEST, 8, 0);
    /* Of the host, too: it is altered on the way. */
    assert_false(sent_by(CUBE_HOST, 6, true, &p));
    node_requests_again(&world.requests, p.number, true);
    assert_int_equal(sends_requests(8), 2);
    expect(0, CUBE_HOST, NODE_PAGE_REQUEST, 6, 0);
    expect_report(1, CUBE_HOST, 6);
    assert_false(node_fault_is_set(&world.fault));
}

/* A node sends what nobody has asked it for: it is named, nothing is used, and
 * nothing is asked for again. */
TEST(not_its_to_send) {
    struct node_page p;
    begin();
    assert_false(sent_by(0, 5, false, &p)); /* nothing is asked for */
    assert_int_equal(p.number, INCODE_NONE);
    assert_int_equal(sends_requests(8), 1);
    expect_report(0, 0, 5);
    assert_true(world.source.request(world.source.context, 5));
    assert_int_equal(sends_requests(8), 1);
    for (unsigned i = 0; i < 2; i++) { /* that is for node 0 to send */
        assert_false(sent_by(3, 5, i == 0, &p));
        assert_int_equal(p.number, INCODE_NONE);
        assert_int_equal(sends_requests(8), 1);
        expect_report(0, 3, 5);
    }
    assert_true(sent_by(0, 4, false, &p)); /* as the maker will say */
    node_requests_judge(&world.requests, INCODE_PAGE_UNASKED, &p);
    assert_int_equal(sends_requests(8), 1);
    expect_report(0, 0, 4);
    comes(0, 5);
    assert_int_equal(node_requests_held(&world.requests), 0);
    assert_false(node_fault_is_set(&world.fault));
}

static uint32_t all_get_altered(uint32_t page, bool altered) {
    struct node_page_message body = {.head.page = page};
    size_t size = node_page_seal(&body, PAGE_KEY, 24);
    body.data[7] ^= altered;
    const struct cube_message message = {.source = CUBE_HOST,
                                         .type = NODE_PAGE_TO_ALL,
                                         .data = (const uint8_t *)&body,
                                         .size = (uint16_t)size};
    return node_lending_take_to_all(&world.lending, &world.requests.check, NULL,
                                    &message);
}

static void all_get(uint32_t page) {
    assert_int_equal(all_get_altered(page, false), INCODE_NONE);
}

/* One that comes to all, and came altered, is asked of the host by who waits
 * for it. */
TEST(to_all_altered) {
    begin();
    node_lending_to_all(&world.lending, 41);
    assert_int_equal(all_get_altered(42, true), 42);
    assert_int_equal(had.puts, 0);
    node_requests_again(&world.requests, 42, false);
    assert_int_equal(sends_requests(8), 2);
    expect(0, CUBE_HOST, NODE_PAGE_REQUEST, 42, 0);
    expect_report(1, CUBE_HOST, 42);
    had.place[41] = LOADING;
    all_get(41);
    assert_int_equal(had.puts, 1);
    assert_int_not_equal(had.label[41], 0);
    comes(CUBE_HOST, 42);
    assert_int_equal(all_get_altered(40, true), INCODE_NONE);
    assert_false(node_fault_is_set(&world.fault));
}

/* What is to come to all is asked of nobody until it has passed. */
TEST(to_all) {
    begin();
    node_lending_to_all(&world.lending, 38);
    assert_int_equal(node_lending_keeper(&world.lending, 37), 3);
    assert_int_equal(node_lending_keeper(&world.lending, 38),
                     NODE_LENDING_COMES);
    assert_true(world.source.request(world.source.context, 38));
    assert_true(world.source.request(world.source.context, 42));
    assert_int_equal(sends_requests(8), 0);
    assert_int_equal(node_requests_held(&world.requests), 0);
    for (uint32_t page = 42; page > 38; page--) {
        all_get(page);
        assert_int_equal(had.put, page);
    }
    assert_int_equal(had.puts, 4);
    assert_int_equal(node_lending_keeper(&world.lending, 39), 3);
    assert_int_equal(node_lending_keeper(&world.lending, 38),
                     NODE_LENDING_COMES);
    all_get(38);
    assert_int_equal(node_lending_keeper(&world.lending, 38), 3);
    assert_false(node_fault_is_set(&world.fault));
    all_get(37); /* is not among them */
    assert_true(node_fault_is_set(&world.fault));
    begin();
    node_lending_to_all(&world.lending, 38);
    all_get(41); /* 42 is missing */
    assert_true(node_fault_is_set(&world.fault));
    begin();
    node_lending_to_all(&world.lending, 38);
    had.unsound = true;
    all_get(42);
    assert_true(node_fault_is_set(&world.fault));
    begin();
    node_lending_to_all(&world.lending, 44); /* past the end */
    assert_true(node_fault_is_set(&world.fault));
}
