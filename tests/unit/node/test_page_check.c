/* A page's tag: the checksum is HalfSipHash, nothing of a page may change
 * without it, and a page that is not as it was made is reported. */

#include "node/page_check.h"
#include "tests/unit/test.h"

/* --- a link, in the place of transport/cube.c ----------------------------- */

struct cube {
    unsigned room, count;
    uint16_t dest;
    uint8_t type;
    struct node_wrong_page_message wrong;
};

int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size) {
    if (cube->room == 0)
        return CUBE_AGAIN;
    cube->room--;
    cube->count++;
    cube->dest = dest;
    cube->type = type;
    assert_int_equal(size, sizeof cube->wrong);
    memcpy(&cube->wrong, data, size);
    return 0;
}

/* --- the checksum --------------------------------------------------------- */

/* Of the reference implementation (github.com/veorq/SipHash): key bytes 0 to 7,
 * input bytes 0 to size - 1. */
static const struct {
    size_t size;
    uint64_t sum;
} vectors[] = {{0, 0xc83cb8b9591f8d21},  {1, 0x157338f8122455be},
               {2, 0x57eb507cef394f06},  {3, 0x790606f7451a0fce},
               {4, 0xa12ee55b178ae7d5},  {5, 0x80b53d2f3f7c9dcb},
               {7, 0x84c67bb0282720ff},  {8, 0x8c85e4bc20e8feed},
               {12, 0x99c7f5ae9f1fc77b}, {15, 0x02c9814ecb0b7d21},
               {16, 0xb5f37b5fd2aa3673}, {63, 0x876032bf713ca62e}};

TEST(test_vectors) {
    const uint64_t key = 0x0706050403020100;
    uint8_t bytes[64];
    uint32_t words[16];
    for (unsigned i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)i;
    memcpy(words, bytes, sizeof words);
    for (size_t i = 0; i < sizeof vectors / sizeof vectors[0]; i++) {
        size_t size = vectors[i].size, split = size / 8 * 2;
        assert_int_equal(node_half_siphash(key, NULL, 0, bytes, size),
                         vectors[i].sum);
        /* The same bytes, some of them as words. */
        assert_int_equal(node_half_siphash(key, words, split, bytes + 4 * split,
                                           size - 4 * split),
                         vectors[i].sum);
    }
}

/* --- pages ---------------------------------------------------------------- */

enum { KEEPER = 3, BYTES = 24 };

static struct {
    struct cube cube;
    struct node_counted counted;
    struct node_fault fault;
    struct node_page_check check;
    struct node_page page;
} world;

static void begin(uint64_t key) {
    const struct node_setup_message setup = {.page_key = key};
    memset(&world, 0, sizeof world);
    world.counted.cube = &world.cube;
    world.counted.self = 1;
    node_page_check_init(&world.check, &setup, &world.counted, &world.fault);
}

static bool comes(uint16_t source, const struct node_page_message *page,
                  size_t size) {
    const struct cube_message message = {.source = source,
                                         .type = NODE_PAGE,
                                         .data = (const uint8_t *)page,
                                         .size = (uint16_t)size};
    return node_page_check_take(&world.check, &message, &world.page);
}

static struct node_page_message page_of(uint32_t number) {
    struct node_page_message page = {.head.page = number};
    memset(page.data, (int)number, BYTES);
    return page;
}

static void expect_report(uint16_t sender, uint32_t page) {
    world.cube.room = 1;
    assert_int_equal(node_page_check_send(&world.check), 1);
    assert_int_equal(world.cube.dest, CUBE_HOST);
    assert_int_equal(world.cube.type, NODE_WRONG_PAGE);
    assert_int_equal(world.cube.wrong.sender, sender);
    assert_int_equal(world.cube.wrong.page, page);
}

TEST(test_right) {
    struct node_page_message page = page_of(9);
    size_t size = node_page_seal(&page, 77, BYTES);
    begin(77);
    assert_int_equal(size, sizeof page.head + BYTES);
    assert_true(comes(KEEPER, &page, size));
    assert_int_equal(world.page.number, 9);
    assert_int_equal(world.page.source, KEEPER);
    assert_int_equal(world.page.size, BYTES);
    assert_memory_equal(world.page.bytes, page.data, BYTES);
    assert_memory_equal(&world.page.tag, page.head.tag, 8);
    world.cube.room = 1;
    assert_int_equal(node_page_check_send(&world.check), 0);
}

/* The example of transport/PROTOCOL.md. */
TEST(test_example) {
    static const uint8_t expected[] = {
        0x05, 0x00, 0x00, 0x00, 0x2b, 0x47, 0x2f, 0x1e, 0xa6, 0x63, 0x80, 0x03,
        0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xe0, 0x3f, 0x00, 0x00, 0x00, 0x00,
        0x00, 0x00, 0xd0, 0x3f, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xf0, 0xbf};
    const double point[3] = {0.5, 0.25, -1};
    struct node_page_message page = {.head.page = 5};
    memcpy(page.data, point, sizeof point);
    assert_int_equal(node_page_seal(&page, 0x0706050403020100, sizeof point),
                     sizeof expected);
    assert_memory_equal(&page, expected, sizeof expected);
}

/* Every bit, one more byte or less, another key. */
TEST(test_altered) {
    struct node_page_message page = page_of(9);
    size_t size = node_page_seal(&page, 77, BYTES);
    for (size_t bit = 0; bit < 8 * size; bit++) {
        struct node_page_message altered = page;
        ((uint8_t *)&altered)[bit / 8] ^= (uint8_t)(1 << bit % 8);
        begin(77);
        assert_false(comes(KEEPER, &altered, size));
        assert_int_equal(world.page.number, altered.head.page);
        expect_report(KEEPER, altered.head.page);
    }
    begin(77);
    assert_false(comes(KEEPER, &page, size - 1));
    assert_false(comes(KEEPER, &page, size + 1));
    begin(78);
    assert_false(comes(CUBE_HOST, &page, size));
    expect_report(CUBE_HOST, 9);
    begin(77 + (UINT64_C(1) << 32));
    assert_false(comes(CUBE_HOST, &page, size));
    assert_false(node_fault_is_set(&world.fault));
}

/* The first report stays until it has left. */
TEST(test_reports) {
    const struct node_page_message page = page_of(9);
    begin(77);
    assert_false(comes(KEEPER, &page, 11));
    assert_int_equal(world.page.number, INCODE_NONE);
    assert_false(node_fault_is_set(&world.fault));
    assert_false(comes(2, &page, sizeof page.head + BYTES));
    assert_int_equal(node_page_check_send(&world.check), 0);
    assert_int_equal(world.cube.count, 0);
    expect_report(KEEPER, INCODE_NONE);
    assert_int_equal(world.counted.sent, 1);
    assert_int_equal(node_page_check_send(&world.check), 0);
    assert_false(comes(CUBE_HOST, &page, 11));
    assert_true(node_fault_is_set(&world.fault));
}
