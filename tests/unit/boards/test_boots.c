/* A flash's rules, and the number of a start: it comes once only, whenever
 * power is lost. */

#include "node/loader/slots.h"
#include "node/loader/flash.h"
#include "tests/unit/test.h"

enum { SECTORS = 4, BYTES = LOADER_RAM_SECTOR * SECTORS };

/* Half of a byte's bits that were to change have. */
static uint8_t half_done(uint8_t from, uint8_t to) {
    return (uint8_t)(from ^ ((from ^ to) & rand()));
}

/* A flash whose power is lost after so many bytes: the one then is half
 * done, and nothing follows. */
static struct chip {
    uint8_t bytes[BYTES];
    long until_loss; /* bytes; below 0: never */
    long changed;
    bool worn;
    jmp_buf lost;
} chip;

static void change(size_t at, uint8_t to) {
    chip.changed++;
    if (chip.until_loss == 0) {
        chip.bytes[at] = half_done(chip.bytes[at], to);
        longjmp(chip.lost, 1);
    }
    chip.until_loss -= chip.until_loss > 0;
    chip.bytes[at] = to;
}

static bool program(void *context, uint32_t at, const void *bytes,
                    size_t size) {
    const uint8_t *in = bytes;
    (void)context;
    assert_true(size <= LOADER_RAM_PAGE - at % LOADER_RAM_PAGE);
    for (size_t i = 0; i < size; i++) {
        assert_int_equal(chip.bytes[at + i] & in[i], in[i]);
        change(at + i, (uint8_t)(chip.worn ? 0 : in[i]));
    }
    return true;
}

static bool erase(void *context, uint32_t sector) {
    (void)context;
    for (size_t i = 0; i < LOADER_RAM_SECTOR; i++)
        change(sector * LOADER_RAM_SECTOR + i, 0xff);
    return true;
}

static const struct loader_flash flash = {.context = chip.bytes,
                                          .sector_bytes = LOADER_RAM_SECTOR,
                                          .page_bytes = LOADER_RAM_PAGE,
                                          .sectors = SECTORS,
                                          .read = loader_ram_read,
                                          .program = program,
                                          .erase = erase};

/* 0: power was lost before the number was told. */
static uint32_t start(long until_loss) {
    uint32_t boot = 0;
    chip.until_loss = until_loss;
    if (setjmp(chip.lost) == 0) {
        assert_true(loader_boots_next(&flash, &boot));
        assert_true(boot > 0);
        return boot;
    }
    return 0;
}

TEST(test_boots_count) {
    for (int blank = 0; blank < 256; blank += 0x55) {
        memset(chip.bytes, blank, BYTES);
        for (uint32_t i = 1; i < 3000; i++) /* five sectors */
            assert_int_equal(start(-1), i);
    }
}

/* At every byte of the starts that matter, but for the midst of an erasure: the
 * first, one in the midst of a
 * sector, those that begin one; and of those behind the first loss. */
TEST(test_boots_outlive_every_loss) {
    static uint8_t before[BYTES];
    static const uint32_t starts[] = {0, 1, 17, 255, 256, 257, 511, 512, 700};
    srand(3);
    for (size_t s = 0; s < sizeof starts / sizeof starts[0]; s++) {
        memset(chip.bytes, 0xff, BYTES);
        uint32_t told = 0;
        while (told < starts[s])
            told = start(-1);
        memcpy(before, chip.bytes, BYTES);
        chip.changed = 0;
        (void)start(-1);
        for (long loss = 0, all = chip.changed; loss <= all;
             loss += loss < 64 || loss > all - 64 ? 1 : 37) {
            memcpy(chip.bytes, before, BYTES);
            uint32_t last = told;
            for (long again = loss; again > 0; again /= 2) {
                uint32_t boot = start(again);
                assert_true(boot == 0 || boot > last);
                last = boot == 0 ? last : boot;
            }
            uint32_t boot = start(-1);
            assert_true(boot > last);
            assert_true(start(-1) > boot);
        }
    }
}

/* A record that was torn may read as whole later: as if its last bits had
 * settled. */
TEST(test_boots_pass_over_what_settles) {
    for (long loss = 0; loss < LOADER_BOOT_BYTES; loss++) {
        memset(chip.bytes, 0xff, BYTES);
        assert_int_equal(start(-1), 1);
        assert_int_equal(start(-1), 2);
        static uint8_t whole[BYTES];
        memcpy(whole, chip.bytes, BYTES);
        uint32_t settled = start(-1);
        memcpy(whole, chip.bytes, BYTES);
        memset(chip.bytes + 2 * LOADER_BOOT_BYTES, 0xff, LOADER_BOOT_BYTES);
        assert_int_equal(start(loss), 0);
        uint32_t next = start(-1);
        assert_true(next >= settled);
        memcpy(chip.bytes + 2 * LOADER_BOOT_BYTES,
               whole + 2 * LOADER_BOOT_BYTES, LOADER_BOOT_BYTES);
        assert_true(start(-1) > next);
    }
}

TEST(test_boots_at_random) {
    uint32_t last = 0;
    srand(11);
    memset(chip.bytes, 0xff, BYTES);
    for (int i = 0; i < 20000; i++) {
        uint32_t boot = start(rand() % 3 == 0 ? rand() % 6000 : -1);
        assert_true(boot == 0 || boot > last);
        last = boot == 0 ? last : boot;
    }
    assert_true(last < 60000);
}

TEST(test_boots_tell_of_a_worn_flash) {
    uint32_t boot = 5;
    memset(chip.bytes, 0xff, BYTES);
    assert_int_equal(start(-1), 1);
    chip.worn = true;
    chip.until_loss = -1;
    assert_false(loader_boots_next(&flash, &boot));
    chip.worn = false;
    assert_true(start(-1) > 1);
}

TEST(test_flash_ram_has_a_flash_s_rules) {
    enum { ALL = LOADER_RAM_SECTOR * LOADER_RAM_SECTORS };
    static uint8_t memory[ALL];
    const struct loader_flash ram = LOADER_RAM(memory);
    uint8_t out[4], in[4] = {0x0f, 0xf0, 0x55, 0xff};
    uint8_t wide[LOADER_RAM_PAGE + 1] = {0};
    assert_true(ram.erase(ram.context, 1));
    assert_int_equal(memory[LOADER_RAM_SECTOR - 1], 0);
    assert_int_equal(memory[2 * LOADER_RAM_SECTOR - 1], 0xff);
    assert_int_equal(memory[2 * LOADER_RAM_SECTOR], 0);
    assert_true(ram.program(ram.context, LOADER_RAM_SECTOR + 8, in, 4));
    ram.read(ram.context, LOADER_RAM_SECTOR + 8, out, 4);
    assert_memory_equal(in, out, 4);
    in[0] = 0x07; /* a bit more is cleared, */
    assert_true(ram.program(ram.context, LOADER_RAM_SECTOR + 8, in, 4));
    in[0] = 0x0f; /* and none is set */
    assert_false(ram.program(ram.context, LOADER_RAM_SECTOR + 8, in, 4));
    ram.read(ram.context, LOADER_RAM_SECTOR + 8, out, 4);
    assert_int_equal(out[0], 0x07);
    assert_false(
        ram.program(ram.context, LOADER_RAM_SECTOR, wide, sizeof wide));
    assert_false(ram.program(ram.context,
                             LOADER_RAM_SECTOR + LOADER_RAM_PAGE - 2, in, 4));
    assert_int_equal(memory[LOADER_RAM_SECTOR], 0xff);
    assert_false(ram.program(ram.context, ALL, in, 1));
    assert_false(ram.erase(ram.context, LOADER_RAM_SECTORS));
    ram.read(ram.context, ALL - 1, out, 2);
    assert_int_equal(out[1], 0xff);
}
