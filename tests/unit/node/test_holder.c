/* A holder by itself: what it sends, and to whom, where its links have room for
 * so many messages and no more. */

#include "node/page_check.h"
#include "node/roles/holder.h"
#include "tests/unit/test.h"

enum { SENT_MAX = 16, ARENA = 8192, PAGE_KEY = 0x5eed };

/* --- links, in the place of transport/cube.c ------------------------------ */

struct cube {
    unsigned room, count;
    struct sent {
        uint16_t dest;
        uint8_t type;
        uint32_t first, second; /* words of the message */
        uint32_t data;          /* of a page */
    } sent[SENT_MAX];
};

int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size) {
    if (cube->room == 0)
        return CUBE_AGAIN;
    assert_true(cube->count < SENT_MAX);
    struct sent *sent = &cube->sent[cube->count];
    *sent = (struct sent){.dest = dest, .type = type};
    memcpy(&sent->first, data, size < 8 ? size : 8);
    if (type == NODE_PAGE)
        memcpy(&sent->data, (const uint8_t *)data + 12, 4);
    cube->room--;
    cube->count++;
    return 0;
}

unsigned cube_room(const struct cube *cube, uint16_t dest) {
    (void)dest;
    return cube->room;
}

/* --- the holder ----------------------------------------------------------- */

static struct {
    _Alignas(64) uint8_t arena[ARENA];
    struct cube cube;
    struct node_counted counted;
    struct node_fault fault;
} world;

static const struct node_role *const role = &node_holder_role;

static void begin(size_t bytes) {
    const struct node_setup_message setup = {
        .nodes = 2,
        .holders = 1,
        .page_key = PAGE_KEY,
        .setup = {.bricks = 50, .index = INCODE_KD, .hi = {1, 1, 1}}};
    memset(&world, 0, sizeof world);
    world.counted.cube = &world.cube;
    world.counted.self = 1;
    assert_true(bytes <= sizeof world.arena);
    assert_true(
        role->start(world.arena, bytes, &setup, &world.counted, &world.fault));
}

static void say(uint16_t source, uint8_t type, const void *data, size_t size) {
    const struct cube_message message = {
        .source = source, .type = type, .data = data, .size = (uint16_t)size};
    role->message(world.arena, &message, 0);
    assert_false(node_fault_is_set(&world.fault));
}

static void asks(uint16_t source, uint32_t page) {
    say(source, NODE_PAGE_REQUEST, &page, sizeof page);
}

/* A point, whose first coordinate is about a half. */
static void page_of(uint16_t source, uint32_t page, bool altered) {
    const uint32_t data[6] = {~page, 0x3fe00000};
    struct node_page_message body = {.head.page = page};
    memcpy(body.data, data, sizeof data);
    size_t size = node_page_seal(&body, PAGE_KEY, sizeof data);
    body.data[1] ^= altered;
    say(source, NODE_PAGE, &body, size);
}

static void page_comes(uint32_t page) {
    page_of(CUBE_HOST, page, false);
}

/* What leaves where there is room for so many messages: their number. */
static unsigned sends(unsigned room) {
    world.cube.room = room;
    world.cube.count = 0;
    unsigned sent = role->send(world.arena);
    assert_int_equal(sent, world.cube.count);
    return sent;
}

static void expect(unsigned i, uint16_t dest, uint8_t type, uint32_t page) {
    assert_true(i < world.cube.count);
    assert_int_equal(world.cube.sent[i].dest, dest);
    assert_int_equal(world.cube.sent[i].type, type);
    assert_int_equal(world.cube.sent[i].first, page);
    if (type == NODE_PAGE)
        assert_int_equal(world.cube.sent[i].data, ~page);
}

static struct node_finished_message totals(void) {
    struct node_finished_message sum;
    memset(&sum, 0, sizeof sum);
    role->totals(world.arena, &sum, 0);
    return sum;
}

/* Each gets what it has asked for, of the host once. */
TEST(two_sources) {
    begin(ARENA);
    asks(0, 4);
    asks(6, 4);
    asks(6, 5);
    assert_int_equal(sends(8), 1);
    expect(0, CUBE_HOST, NODE_PAGE_REQUEST, 4);
    assert_int_equal(world.cube.sent[0].second, 5);
    assert_int_equal(role->held(world.arena), 3);
    page_comes(5);
    assert_int_equal(sends(8), 1);
    expect(0, 6, NODE_PAGE, 5);
    page_comes(4);
    assert_int_equal(sends(8), 2);
    expect(0, 0, NODE_PAGE, 4);
    expect(1, 6, NODE_PAGE, 4);
    assert_int_equal(role->held(world.arena), 0);
    asks(CUBE_HOST, 5);
    assert_int_equal(sends(8), 1);
    expect(0, CUBE_HOST, NODE_PAGE, 5);
    assert_int_equal(world.counted.sent, 2); /* to the host */
    assert_int_equal(totals().pages_held, 2);
    assert_int_equal(totals().pages_forwarded, 2);
}

/* A page that goes out takes the room of a request: what the request was to
 * displace stays there, and nothing is counted until it leaves. */
TEST(no_room_for_a_request) {
    const struct node_setup_message setup = {.nodes = 2, .holders = 1};
    struct node_map map;
    memset(&map, 0, sizeof map);
    begin(ARENA);
    role->map(world.arena, &map);
    uint32_t frames = map.pages;
    assert_in_range(frames, 2, SENT_MAX);
    assert_true(role->arena_min(ARENA, &setup) < ARENA);
    for (uint32_t page = 0; page < frames; page++) {
        asks(0, page);
        assert_int_equal(sends(1), 1);
        page_comes(page);
        assert_int_equal(sends(1), 1);
    }
    uint64_t high = totals().memory_high_water;
    assert_true(high <= ARENA);
    asks(0, frames); /* in the frame of page 0 */
    asks(0, 1);
    assert_int_equal(sends(1), 1);
    expect(0, 0, NODE_PAGE, 1);
    for (unsigned i = 0; i < 3; i++)
        assert_int_equal(sends(0), 0);
    assert_int_equal(totals().pages_forwarded, frames);
    asks(0, 0);
    assert_int_equal(sends(1), 1);
    expect(0, 0, NODE_PAGE, 0); /* still there */
    assert_int_equal(sends(1), 1);
    expect(0, CUBE_HOST, NODE_PAGE_REQUEST, frames);
    assert_int_equal(totals().pages_forwarded, frames + 1);
    assert_int_equal(totals().memory_high_water, high);
}

/* One that came altered is asked for again, and reported; so is a node that
 * sends one: only the host has any for a holder. */
TEST(wrong_pages) {
    begin(ARENA);
    asks(0, 4);
    assert_int_equal(sends(8), 1);
    page_of(CUBE_HOST, 4, true);
    assert_int_equal(role->held(world.arena), 2);
    assert_int_equal(sends(8), 2);
    expect(0, CUBE_HOST, NODE_PAGE_REQUEST, 4);
    expect(1, CUBE_HOST, NODE_WRONG_PAGE, 4);
    assert_int_equal(world.cube.sent[1].second, CUBE_HOST);
    for (unsigned altered = 0; altered < 2; altered++) {
        page_of(6, 4, altered);
        assert_int_equal(sends(8), 1);
        expect(0, CUBE_HOST, NODE_WRONG_PAGE, 4);
        assert_int_equal(world.cube.sent[0].second, 6);
    }
    page_comes(4);
    assert_int_equal(sends(8), 1);
    expect(0, 0, NODE_PAGE, 4);
    assert_int_equal(role->held(world.arena), 0);
}
