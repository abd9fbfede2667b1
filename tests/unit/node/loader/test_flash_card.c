/* A flash on a memory card: where it is, its rules, what it asks of the card,
 * and what a block that was torn, or a card that fails, takes with it. */

#include "node/loader/slots.h"
#include "node/loader/flash.h"
#include "transport/bytes.h"
#include "tests/unit/test.h"

enum {
    BLOCK = LOADER_CARD_BLOCK,
    ALL = LOADER_CARD_SECTORS * LOADER_CARD_SECTOR,
    CARD_BLOCKS = LOADER_CARD_FIRST + LOADER_CARD_BLOCKS
};

static struct {
    uint8_t *bytes; /* CARD_BLOCKS of them */
    unsigned reads, writes;
    uint32_t written; /* block, the last one */
    bool dead;
    long until_loss; /* writes; below 0: never */
    uint32_t random;
    jmp_buf lost;
} device;

static bool read_block(void *context, uint32_t block, uint8_t *bytes) {
    device.reads++;
    assert_true(block < CARD_BLOCKS);
    return !device.dead && loader_card_fetch(context, block, bytes);
}

static bool write_block(void *context, uint32_t block, const uint8_t *bytes) {
    device.writes++;
    device.written = block;
    assert_true(block < CARD_BLOCKS);
    if (device.dead)
        return false;
    if (device.until_loss >= 0 && device.until_loss-- == 0) {
        for (unsigned i = 0; i < BLOCK; i++) {
            device.random = device.random * 1664525u + 1013904223u;
            device.bytes[(size_t)block * BLOCK + i] =
                (uint8_t)(device.random >> 24);
        }
        longjmp(device.lost, 1);
    }
    return loader_card_store(context, block, bytes);
}

static struct loader_card card;
static const struct loader_flash flash = LOADER_CARD(&card);

static uint8_t *entry(unsigned i) {
    return device.bytes + 446 + (size_t)i * 16;
}

static int insert(void **state) {
    (void)state;
    if (device.bytes == NULL) {
        device.bytes = malloc((size_t)CARD_BLOCKS * BLOCK);
        assert_non_null(device.bytes);
    }
    memset(device.bytes, 0x5a, (size_t)CARD_BLOCKS * BLOCK);
    device.dead = false;
    device.until_loss = -1;
    card =
        (struct loader_card){device.bytes, read_block, write_block, 0, 0, {0}};
    assert_true(loader_card_format(&card));
    device.reads = device.writes = 0;
    return 0;
}

static int take_out(void **state) {
    (void)state;
    free(device.bytes);
    return 0;
}

TEST_WITH(test_the_partition_is_found, insert, NULL) {
    assert_int_equal(card.first, LOADER_CARD_FIRST);
    memmove(entry(2), entry(0), 16);
    entry(0)[4] = 0x0c; /* a partition of files */
    memmove(entry(1), entry(2), 16);
    bytes_put32(entry(1) + 12, LOADER_CARD_BLOCKS - 1); /* too small */
    bytes_put32(entry(2) + 8, 77);
    assert_true(loader_card_open(&card));
    assert_int_equal(card.first, 77);
    bytes_put32(entry(2) + 8, UINT32_MAX - 5);
    assert_false(loader_card_open(&card));
    bytes_put32(entry(2) + 8, 77);
    device.bytes[510] = 0;
    assert_false(loader_card_open(&card));
    device.bytes[510] = 0x55;
    device.dead = true;
    assert_false(loader_card_open(&card));
}

/* It is looked for again by who needs it. */
TEST_WITH(test_without_it_nothing_is_taken, insert, NULL) {
    uint8_t bytes[4] = {0};
    uint32_t boot;
    entry(0)[4] = 0x83;
    card.first = 0;
    assert_false(flash.program(flash.context, 0, bytes, 4));
    assert_false(flash.erase(flash.context, 0));
    flash.read(flash.context, 0, bytes, 4);
    assert_int_equal(bytes_get32(bytes), UINT32_MAX);
    assert_false(loader_boots_next(&flash, &boot));
    assert_int_equal(device.writes, 0);
    entry(0)[4] = LOADER_CARD_TYPE;
    assert_true(loader_boots_next(&flash, &boot));
}

TEST_WITH(test_it_has_a_flash_s_rules, insert, NULL) {
    uint8_t out[2 * BLOCK], in[4] = {0x0f, 0xf0, 0x55, 0xff};
    uint8_t wide[BLOCK + 1] = {0};
    size_t begin = (size_t)LOADER_CARD_FIRST * BLOCK;
    assert_true(flash.erase(flash.context, 1));
    assert_int_equal(device.bytes[begin + LOADER_CARD_SECTOR - 1], 0x5a);
    assert_int_equal(device.bytes[begin + LOADER_CARD_SECTOR], 0xff);
    assert_int_equal(device.bytes[begin + 2 * LOADER_CARD_SECTOR - 1], 0xff);
    assert_int_equal(device.bytes[begin + 2 * LOADER_CARD_SECTOR], 0x5a);
    uint32_t at = LOADER_CARD_SECTOR + 8;
    assert_true(flash.program(flash.context, at, in, 4));
    flash.read(flash.context, at, out, 4);
    assert_memory_equal(in, out, 4);
    in[0] = 0x07; /* a bit more is cleared, */
    assert_true(flash.program(flash.context, at, in, 4));
    in[0] = 0x0f; /* and none is set */
    assert_false(flash.program(flash.context, at, in, 4));
    flash.read(flash.context, at - 8, out, sizeof out);
    assert_int_equal(out[7], 0xff);
    assert_int_equal(out[8], 0x07);
    assert_int_equal(out[BLOCK], 0xff);
    assert_false(
        flash.program(flash.context, LOADER_CARD_SECTOR, wide, sizeof wide));
    assert_false(
        flash.program(flash.context, LOADER_CARD_SECTOR + BLOCK - 2, in, 4));
    assert_false(flash.program(flash.context, ALL, in, 1));
    assert_false(flash.erase(flash.context, LOADER_CARD_SECTORS));
    flash.read(flash.context, ALL - 1, out, 2);
    assert_int_equal(out[0], 0x5a);
    assert_int_equal(out[1], 0xff);
}

/* Bytes of one block are one read; what is erased is not written. */
TEST_WITH(test_it_asks_little_of_the_card, insert, NULL) {
    uint8_t out[64], in = 0;
    assert_true(flash.erase(flash.context, 3));
    assert_int_equal(device.writes, LOADER_CARD_SECTOR / BLOCK);
    assert_true(flash.program(flash.context, 3 * LOADER_CARD_SECTOR, &in, 1));
    device.reads = device.writes = 0;
    for (uint32_t at = 0; at < BLOCK; at += sizeof out)
        flash.read(flash.context, 3 * LOADER_CARD_SECTOR + at, out, sizeof out);
    assert_int_equal(device.reads, 1);
    assert_true(flash.erase(flash.context, 3));
    assert_int_equal(device.writes, 1);
    assert_int_equal(device.written,
                     LOADER_CARD_FIRST + 3 * LOADER_CARD_SECTOR / BLOCK);
}

TEST_WITH(test_a_card_that_fails_is_told, insert, NULL) {
    uint8_t byte = 0;
    uint32_t boot;
    assert_true(loader_boots_next(&flash, &boot));
    device.dead = true;
    assert_false(flash.erase(flash.context, 5));
    assert_false(flash.program(flash.context, 0, &byte, 1));
    assert_false(loader_boots_next(&flash, &boot));
    flash.read(flash.context, 0, &byte, 1);
    assert_int_equal(byte, 0xff);
    device.dead = false;
    assert_true(loader_boots_next(&flash, &boot));
    assert_int_equal(boot, 2);
}

/* What is told of starts and of the serial number outlives every write that
 * leaves a block of which nothing is right. */
TEST_WITH(test_a_torn_block_takes_its_own_alone, insert, NULL) {
    const uint8_t name[LOADER_SERIAL_BYTES] = {1, 2, 3, 4, 5, 6, 7, 8};
    uint8_t serial[LOADER_SERIAL_BYTES];
    static uint32_t last;
    uint32_t boot;
    assert_true(loader_slots_name(&flash, name));
    last = 0;
    for (unsigned i = 0; i < 300; i++) {
        device.until_loss = (long)(i % 7);
        if (setjmp(device.lost) == 0) {
            for (unsigned k = 0; k < 9; k++) {
                assert_true(loader_boots_next(&flash, &boot));
                assert_true(boot > last);
                last = boot;
            }
        }
        card.held = 0; /* it begins anew */
        device.until_loss = -1;
        assert_true(loader_boots_next(&flash, &boot));
        assert_true(boot > last);
        last = boot;
        assert_true(loader_slots_serial(&flash, serial));
        assert_memory_equal(serial, name, sizeof name);
    }
    assert_true(last > 300);
}

TEST_GROUP(NULL, take_out)
