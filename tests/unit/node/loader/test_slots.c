/* Which image a board starts, what it takes, and what it keeps. */
#include "loader_chip.h"

enum { IMAGE = 3 * LOADER_BLOCK_BYTES + 700 };

static struct made old, new, third;
static struct loader_slots slots;
static struct loader_incoming in;

static unsigned starts(bool ended_badly) {
    loader_slots_open(&slots, &chip_rules);
    return loader_slots_choose(&slots, ended_badly);
}

static void begin(const struct made *made) {
    (void)starts(false);
    loader_incoming_init(&in, &slots);
    chip_begin(&in, made);
}

static void bring(const struct made *made) {
    begin(made);
    chip_bring(&in, made);
    chip_verify(&in);
    assert_int_equal(in.phase, LOADER_VERIFIED);
}

static void bring_and_confirm(const struct made *made) {
    bring(made);
    unsigned slot = starts(false);
    assert_true(loader_slots_try(&slots));
    assert_true(chip_confirm(&chip, slot));
}

static void spare_slot(unsigned slot) {
    struct loader_layout layout = loader_layout(&chip.flash);
    chip.sacred = loader_slot_at(&layout, &chip.flash, slot);
    chip.sacred_bytes = layout.sectors * chip.flash.sector_bytes;
}

static int blank_board(void **state) {
    (void)state;
    chip_make(&chip, 512, 64, 45);
    made_make(&old, IMAGE, 5);
    made_make(&new, IMAGE - 300, 6);
    made_make(&third, IMAGE + 100, 7);
    return 0;
}

TEST_WITH(test_slots_layout, blank_board, NULL) {
    static const uint32_t all[][3] = {
        {4096, 256, 1024}, {4096, 256, 64}, {4096, 256, 63}, {65536, 256, 32},
        {131072, 32, 8},   {512, 64, 45},   {4096, 256, 5},  {4096, 256, 6}};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        struct loader_flash flash = {.sector_bytes = all[i][0],
                                     .page_bytes = all[i][1],
                                     .sectors = all[i][2]};
        struct loader_layout layout = loader_layout(&flash);
        uint32_t blocks = layout.bytes / LOADER_BLOCK_BYTES + 1;
        assert_true(layout.first >= 5);
        assert_true(layout.bytes == 0 ||
                    layout.first + 2 * layout.sectors <= flash.sectors);
        assert_true(blocks <= LOADER_BLOCKS_MAX);
        if (layout.bytes > 0) {
            assert_true(loader_marks_in(&flash) + 4 * blocks <=
                        layout.journal * flash.sector_bytes);
            assert_int_equal(loader_journal_at(&layout, &flash, 0) +
                                 layout.journal * flash.sector_bytes,
                             loader_slot_at(&layout, &flash, 1));
        }
    }
}

TEST_WITH(test_slots_of_an_empty_board, blank_board, NULL) {
    assert_int_equal(starts(false), LOADER_SLOTS);
    assert_int_equal(starts(true), LOADER_SLOTS);
    memset(chip.bytes, 0, chip_size(&chip));
    assert_int_equal(starts(false), LOADER_SLOTS);
    bring(&old);
    assert_int_equal(starts(false), 0);
}

TEST_WITH(test_slots_install, blank_board, NULL) {
    assert_true(loader_slots_install(&chip.flash, old.all, old.bytes));
    assert_int_equal(starts(true), 0);
    assert_int_equal(slots.image[0].number, 5);
    assert_int_equal(slots.state.trial, 0);
    assert_false(loader_slots_install(&chip.flash, old.all, CHIP_IMAGE_MAX));
}

/* Three starts that confirm nothing, or one that ends in a fault. */
TEST_WITH(test_slots_fall_back, blank_board, NULL) {
    for (unsigned badly = 0; badly < 2; badly++) {
        blank_board(NULL);
        bring_and_confirm(&old);
        bring(&new);
        for (unsigned i = 0; i < (badly ? 1 : LOADER_TRIES); i++) {
            assert_int_equal(starts(false), 1);
            assert_true(loader_slots_try(&slots));
        }
        assert_int_equal(starts(badly), 0);
        assert_int_equal(slots.state.trial, 0);
        assert_int_equal(starts(true), 0);
    }
    blank_board(NULL);
    bring(&new);
    assert_int_equal(starts(true), 0); /* that was the loader's own start */
    for (unsigned i = 0; i < 2; i++) {
        assert_true(loader_slots_try(&slots));
        assert_int_equal(starts(i == 1), i == 0 ? 0 : LOADER_SLOTS);
    }
    assert_int_equal(starts(false), LOADER_SLOTS); /* it waits from now on, */
    bring_and_confirm(&new);                       /* until it is told again */
    assert_int_equal(starts(true), 0);
}

/* Who turns a board off and on that is not wired yet, and each time lets it run
 * for a while, does not lose the image; one that crashes still falls back. */
TEST_WITH(test_slots_outlive_power_cycles, blank_board, NULL) {
    bring_and_confirm(&old);
    bring(&new);
    for (unsigned i = 0; i < 4 * LOADER_TRIES; i++) {
        assert_int_equal(starts(false), 1);
        assert_true(loader_slots_try(&slots));
        long done = chip.done;
        assert_true(loader_slots_lived(&chip.flash, 0)); /* not in use */
        assert_int_equal(chip.done, done);
        assert_true(loader_slots_lived(&chip.flash, 1));
        assert_int_equal(chip.done != done, i > 0);
    }
    for (unsigned i = 1; i < LOADER_TRIES; i++) { /* then some short ones */
        assert_int_equal(starts(false), 1);
        assert_int_equal(slots.state.trial, 1);
        assert_true(loader_slots_try(&slots));
    }
    assert_int_equal(starts(false), 0);
    blank_board(NULL);
    bring_and_confirm(&old);
    bring(&new);
    assert_int_equal(starts(false), 1);
    assert_true(loader_slots_try(&slots));
    assert_true(loader_slots_lived(&chip.flash, 1));
    assert_int_equal(starts(true), 0); /* it hung, however late */
}

TEST_WITH(test_slots_confirm_once, blank_board, NULL) {
    bring_and_confirm(&old);
    long done = chip.done;
    assert_true(chip_confirm(&chip, 0));
    assert_true(chip_confirm(&chip, 1)); /* not in use */
    assert_int_equal(chip.done, done);
    (void)starts(false);
    assert_true(loader_slots_try(&slots)); /* no trial: no record */
    assert_int_equal(chip.done, done);
}

/* What has lost a bit is not started; the other one is, on trial, as it may be
 * one that never came up. */
TEST_WITH(test_slots_leave_what_has_rotted, blank_board, NULL) {
    bring_and_confirm(&old);
    bring_and_confirm(&new);
    assert_int_equal(starts(false), 1);
    chip.bytes[loader_slots_code(&slots, 1) + 999] ^= 4;
    assert_int_equal(starts(false), 0);
    assert_int_equal(slots.state.trial, 1);
    chip.bytes[loader_slots_code(&slots, 0) + 99] ^= 4;
    assert_int_equal(starts(false), LOADER_SLOTS);
    assert_int_equal(slots.fault[0], LOADER_WRONG_DIGEST);
    bring(&third);
    assert_true(starts(false) < LOADER_SLOTS);
}

/* Neither the one in use, nor the only one that has ever come up. */
TEST_WITH(test_slots_are_spared, blank_board, NULL) {
    bring_and_confirm(&old); /* in slot 0 */
    spare_slot(0);
    bring(&new);
    bring(&third);
    assert_int_equal(starts(false), 1);
    assert_true(loader_slots_try(&slots));
    bring(&new);
    assert_int_equal(starts(false), 1);
    begin(&old); /* the way back, without a block */
    assert_int_equal(in.phase, LOADER_THERE);
    assert_int_equal(starts(false), 0);
    begin(&new);
    assert_int_equal(in.phase, LOADER_WHOLE); /* as it still lies there */
    chip_verify(&in);
    unsigned slot = starts(false);
    assert_true(loader_slots_try(&slots));
    assert_true(chip_confirm(&chip, slot));
    spare_slot(1);
    bring(&third);
    chip.sacred_bytes = 0;
}

TEST_WITH(test_slots_serial, blank_board, NULL) {
    static const uint8_t one[LOADER_SERIAL_BYTES] = {1, 2, 3, 4, 5, 6, 7, 8};
    static const uint8_t two[LOADER_SERIAL_BYTES] = {9};
    uint8_t serial[LOADER_SERIAL_BYTES];
    for (volatile unsigned tear = 0; tear < 40; tear++) {
        blank_board(NULL);
        chip.random = tear;
        assert_false(loader_slots_serial(&chip.flash, serial));
        chip.until_loss = tear == 0 ? -1 : 0;
        if (setjmp(chip.lost) == 0)
            (void)loader_slots_name(&chip.flash, two);
        chip.until_loss = -1;
        bool named = loader_slots_serial(&chip.flash, serial);
        assert_true(loader_slots_name(&chip.flash, one));
        assert_true(loader_slots_serial(&chip.flash, serial));
        assert_memory_equal(serial, named ? two : one, sizeof serial);
    }
    memset(chip.bytes, 0, chip_size(&chip));
    assert_true(loader_slots_name(&chip.flash, one));
    assert_true(loader_slots_serial(&chip.flash, serial));
    assert_memory_equal(serial, one, sizeof serial);
}

/* --- what is refused: nothing in the flash changes then ------------------- */

static void refuses(const struct made *made, enum loader_fault fault) {
    static uint8_t before[CHIP_BYTES];
    memcpy(before, chip.bytes, chip_size(&chip));
    begin(made);
    assert_int_equal(in.phase, LOADER_REFUSES);
    assert_int_equal(in.fault, fault);
    assert_memory_equal(before, chip.bytes, chip_size(&chip));
    chip_block(&in, made, 0);
    chip_verify(&in);
    assert_memory_equal(before, chip.bytes, chip_size(&chip));
}

TEST_WITH(test_slots_refuse, blank_board, NULL) {
    bring_and_confirm(&old);
    struct made bad = new;
    bad.all[20] ^= 1;
    refuses(&bad, LOADER_NO_IMAGE);
    bad = new;
    bad.bytes--; /* truncated */
    refuses(&bad, LOADER_NO_IMAGE);
    bad = new;
    bad.image.bytes = CHIP_IMAGE_MAX + 1;
    loader_image_pack(&bad.image, bad.all);
    refuses(&bad, LOADER_TOO_LARGE);
    bad.image.bytes = UINT32_MAX;
    loader_image_pack(&bad.image, bad.all);
    refuses(&bad, LOADER_TOO_LARGE);
    made_make(&bad, 17 * 512 + 1, 9); /* a slot has 20 sectors, one of them
                                         the journal; see below */
    begin(&bad);
    assert_int_equal(in.phase, LOADER_TAKES);
    made_make(&bad, 19 * 512 + 1, 9);
    refuses(&bad, LOADER_TOO_LARGE);
    bad = new;
    strcpy(bad.image.board, "raspi3b");
    made_seal(&bad);
    refuses(&bad, LOADER_WRONG_BOARD);
    bad = new;
    bad.image.address = 0;
    made_seal(&bad);
    refuses(&bad, LOADER_WRONG_ADDRESS);
    bad = new;
    memset(bad.image.key, 0, sizeof bad.image.key);
    made_seal(&bad);
    refuses(&bad, LOADER_UNSIGNED);
    bad = new;
    bad.image.key[0] ^= 1;
    made_seal(&bad);
    refuses(&bad, LOADER_WRONG_KEY);
    bad = new;
    bad.image.signature[0] ^= 1;
    loader_image_pack(&bad.image, bad.all);
    refuses(&bad, LOADER_WRONG_SIGNATURE);
    assert_int_equal(starts(false), 0);
}

TEST_WITH(test_slots_have_no_way_back, blank_board, NULL) {
    bring_and_confirm(&old);
    struct made strict = new;
    strict.image.flags = LOADER_NO_WAY_BACK;
    made_seal(&strict);
    bring(&strict);
    begin(&old); /* on trial it may go back, */
    assert_int_equal(in.phase, LOADER_THERE);
    bring_and_confirm(&third);
    begin(&strict);
    chip_bring(&in, &strict);
    chip_verify(&in);
    unsigned slot = starts(false);
    assert_true(chip_confirm(&chip, slot));
    refuses(&old, LOADER_TOO_OLD); /* and then no more */
    chip.bytes[loader_slots_code(&slots, slot)] ^= 1;
    assert_int_equal(starts(false), 1 - slot); /* 7 after 6 */
}

/* --- blocks --------------------------------------------------------------- */

TEST_WITH(test_slots_take_blocks_in_any_order, blank_board, NULL) {
    memset(chip.bytes, 0x5a, chip_size(&chip));
    begin(&old);
    for (uint32_t b = in.blocks; b-- > 0;) {
        chip_block(&in, &old, b);
        chip_block(&in, &old, b);
    }
    chip_bring(&in, &old);
    assert_int_equal(in.phase, LOADER_WHOLE);
    uint32_t programmed = in.programmed;
    chip_block(&in, &old, 1);
    assert_int_equal(in.programmed, programmed);
    chip_verify(&in);
    assert_int_equal(starts(false), 0);
}

TEST_WITH(test_slots_pass_over_bad_blocks, blank_board, NULL) {
    uint8_t block[LOADER_BLOCK_BYTES + 1] = {0};
    begin(&old);
    memcpy(block, old.all + LOADER_BLOCK_BYTES, LOADER_BLOCK_BYTES);
    uint32_t crc = frame_crc32c(0, block, LOADER_BLOCK_BYTES);
    loader_incoming_block(&in, 1, block, LOADER_BLOCK_BYTES, crc ^ 1);
    loader_incoming_block(&in, 1, block, LOADER_BLOCK_BYTES - 1, crc);
    loader_incoming_block(&in, in.blocks, block, LOADER_BLOCK_BYTES, crc);
    loader_incoming_block(&in, UINT32_MAX, block, LOADER_BLOCK_BYTES, crc);
    loader_incoming_block(&in, 0, block, LOADER_BLOCK_BYTES, crc);
    loader_incoming_block(&in, 1, block, 0, 0);
    loader_incoming_block(&in, 1, block, LOADER_BLOCK_BYTES + 1,
                          frame_crc32c(0, block, LOADER_BLOCK_BYTES + 1));
    loader_incoming_block(&in, in.blocks - 1, block, LOADER_BLOCK_BYTES, crc);
    assert_false(loader_incoming_busy(&in));
    assert_int_equal(in.held, 0);
    loader_incoming_verify(&in); /* too early */
    assert_false(loader_incoming_busy(&in));
    assert_int_equal(in.phase, LOADER_TAKES);
}

/* Blocks whose CRC is right, and which are not what was signed. */
TEST_WITH(test_slots_refuse_another_code, blank_board, NULL) {
    bring_and_confirm(&old);
    struct made bad = new;
    bad.all[2000] ^= 1;
    begin(&bad);
    chip_bring(&in, &bad);
    chip_verify(&in);
    assert_int_equal(in.phase, LOADER_REFUSES);
    assert_int_equal(in.fault, LOADER_WRONG_DIGEST);
    assert_int_equal(starts(false), 0);
    bring(&new); /* and nothing of it is left */
    assert_int_equal(starts(false), 1);
}

TEST_WITH(test_slots_go_on, blank_board, NULL) {
    begin(&old);
    chip_block(&in, &old, 2);
    chip_block(&in, &old, 0);
    begin(&old); /* as after a restart */
    assert_int_equal(in.held, 2);
    begin(&new); /* another, in its place, */
    assert_int_equal(in.held, 0);
    chip_block(&in, &new, 1);
    begin(&old); /* and back: from the first block on */
    assert_int_equal(in.held, 0);
    bring(&old);
    assert_int_equal(starts(false), 0);
}

/* Without a restart: the same again changes nothing; what is refused costs
 * nothing of what has come; another image takes its place. */
TEST_WITH(test_slots_begin_in_the_midst, blank_board, NULL) {
    bring_and_confirm(&old);
    begin(&new);
    chip_block(&in, &new, 2);
    uint32_t erased = in.erased, programmed = in.programmed;
    loader_incoming_begin(&in, new.all, new.bytes);
    assert_false(loader_incoming_busy(&in));
    assert_int_equal(in.held, 1);
    struct made bad = new;
    bad.image.signature[0] ^= 1;
    loader_image_pack(&bad.image, bad.all);
    chip_begin(&in, &bad);
    assert_int_equal(in.phase, LOADER_REFUSES);
    chip_block(&in, &new, 1);
    chip_verify(&in);
    assert_int_equal(in.phase, LOADER_REFUSES);
    assert_int_equal(in.erased, erased);
    assert_int_equal(in.programmed, programmed);
    chip_begin(&in, &new);
    assert_int_equal(in.phase, LOADER_TAKES);
    assert_int_equal(in.held, 1);
    chip_begin(&in, &third);
    assert_int_equal(in.held, 0);
    chip_bring(&in, &third);
    chip_verify(&in);
    assert_int_equal(in.phase, LOADER_VERIFIED);
    assert_int_equal(starts(false), 1);
    assert_int_equal(slots.image[1].number, 7);
    begin(&old); /* it was not touched */
    assert_int_equal(in.phase, LOADER_THERE);
}

/* An image that is in the flash already: what does not bear the board's
 * signature is neither started nor fallen back to, although its digest is
 * right.
 */
static void starts_not(const struct made *made, enum loader_fault fault) {
    uint32_t boot;
    assert_true(loader_slots_install(&chip.flash, made->all, made->bytes));
    assert_int_equal(loader_slots_start(&slots, &chip_rules, false, &boot),
                     LOADER_SLOTS);
    assert_int_equal(slots.fault[0], fault);
    assert_true(loader_slots_use(&slots, 1, false)); /* where nothing is */
    assert_int_equal(loader_slots_start(&slots, &chip_rules, false, &boot),
                     LOADER_SLOTS);
    assert_int_equal(slots.fault[0], fault);
}

TEST_WITH(test_slots_start_what_is_signed, blank_board, NULL) {
    static struct made bad;
    uint32_t boot;
    for (unsigned bit = 0; bit < 8 * SIGN_BYTES; bit += 37) {
        bad = new;
        bad.image.signature[bit / 8] ^= (uint8_t)(1u << bit % 8);
        loader_image_pack(&bad.image, bad.all);
        starts_not(&bad, LOADER_WRONG_SIGNATURE);
    }
    bad = new; /* sealed, with the signature of another number */
    bad.image.number++;
    made_seal(&bad);
    memcpy(bad.image.signature, new.image.signature, SIGN_BYTES);
    loader_image_pack(&bad.image, bad.all);
    starts_not(&bad, LOADER_WRONG_SIGNATURE);
    bad.image.key[0] ^= 1;
    made_seal(&bad);
    starts_not(&bad, LOADER_WRONG_KEY);
    memset(bad.image.key, 0, sizeof bad.image.key);
    made_seal(&bad);
    starts_not(&bad, LOADER_UNSIGNED);
    assert_true(loader_slots_install(&chip.flash, new.all, new.bytes));
    assert_int_equal(loader_slots_start(&slots, &chip_rules, false, &boot), 0);
}

/* What runs is what was signed, also where the flash gives something else by
 * then, of code or header. */
TEST_WITH(test_slots_look_at_the_copy, blank_board, NULL) {
    struct loader_look look;
    uint8_t *code = new.all + LOADER_HEADER_BYTES;
    bring_and_confirm(&new);
    assert_int_equal(starts(false), 0);
    assert_true(loader_look_copy(&look, &slots, 0, code));
    code[new.image.bytes - 1] ^= 1;
    assert_false(loader_look_copy(&look, &slots, 0, code));
    code[new.image.bytes - 1] ^= 1;
    chip.bytes[loader_slots_code(&slots, 0) - LOADER_HEADER_BYTES + 17] ^= 1;
    assert_false(loader_look_copy(&look, &slots, 0, code));
    assert_int_equal(slots.fault[0], LOADER_WRONG_DIGEST);
}

TEST_WITH(test_slots_tell_of_a_worn_flash, blank_board, NULL) {
    bring_and_confirm(&old);
    chip.worn = 5 + 20 + 3; /* in slot 1 */
    begin(&new);
    for (int i = 0; i < 20 && in.phase == LOADER_TAKES; i++)
        chip_bring(&in, &new);
    assert_int_equal(in.phase, LOADER_REFUSES);
    assert_int_equal(in.fault, LOADER_WORN);
    assert_int_equal(starts(false), 0);
}

/* It would only restart, again and again, and lose what it had. */
TEST_WITH(test_slots_wait_where_no_start_is_recorded, blank_board, NULL) {
    uint32_t boot = 0, programs;
    bring_and_confirm(&old);
    assert_int_equal(loader_slots_start(&slots, &chip_rules, false, &boot), 0);
    assert_int_equal(boot, 1);
    chip.worn_out = true;
    for (unsigned i = 0; i < 100; i++) {
        boot = 7;
        assert_int_equal(loader_slots_start(&slots, &chip_rules, i % 2, &boot),
                         LOADER_SLOTS);
        assert_int_equal(boot, 0);
        assert_true(slots.worn);
    }
    programs = chip.programs;
    loader_incoming_init(&in, &slots);
    chip_begin(&in, &new);
    assert_int_equal(in.phase, LOADER_REFUSES);
    assert_int_equal(in.fault, LOADER_WORN);
    assert_int_equal(chip.programs, programs);
    chip.worn_out = false;
    assert_int_equal(loader_slots_start(&slots, &chip_rules, false, &boot), 0);
    assert_true(boot > 1);
    assert_false(slots.worn);
}

/* A trial that cannot be counted would have no end. */
TEST_WITH(test_slots_wait_where_no_trial_is_counted, blank_board, NULL) {
    bring(&old);
    chip.worn_out = true;
    for (unsigned i = 0; i < 2 * LOADER_TRIES; i++) {
        assert_int_equal(starts(i > 0), 0);
        assert_false(loader_slots_try(&slots));
        assert_true(slots.worn);
    }
}
