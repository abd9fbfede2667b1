/* Power is lost at every operation of the flash in the life of an image, words
 * torn: the board starts what is whole, keeps what it has, and gets on. */
#include "loader_chip.h"
#include "node/loader/slots.h"

enum { IMAGE = 4 * LOADER_BLOCK_BYTES + 1000, TEARS = 16 };

static struct made old, new, third;

/* What the board would run, byte for byte; LOADER_SLOTS: it waits. */
static unsigned starts(struct loader_slots *slots, bool ended_badly) {
    uint32_t boot;
    assert_true(loader_boots_next(&chip.flash, &boot));
    loader_slots_open(slots, &chip_rules);
    return loader_slots_choose(slots, ended_badly);
}

static bool is_image(const struct loader_slots *slots, unsigned slot,
                     const struct made *made) {
    return slot < LOADER_SLOTS &&
           memcmp(chip.bytes + loader_slots_code(slots, slot),
                  made->all + LOADER_HEADER_BYTES, made->image.bytes) == 0;
}

static struct loader_incoming in;

/* The board is on, takes an image and runs it once. */
static void live(const struct made *made, bool confirms) {
    struct loader_slots slots;
    (void)starts(&slots, false);
    loader_incoming_init(&in, &slots);
    chip_begin(&in, made);
    for (int i = 0; i < 2; i++) { /* what was there may be of no use */
        chip_bring(&in, made);
        chip_verify(&in);
    }
    assert_true(in.phase == LOADER_VERIFIED || in.phase == LOADER_THERE);
    unsigned slot = starts(&slots, false);
    assert_true(is_image(&slots, slot, made));
    assert_true(loader_slots_try(&slots));
    if (confirms)
        assert_true(chip_confirm(&chip, slot));
}

/* An image that never comes up, tried until it is given up. */
static void give_up(const struct made *made, bool badly) {
    struct loader_slots slots;
    live(made, false);
    for (unsigned i = 1; i <= LOADER_TRIES; i++) {
        unsigned slot = starts(&slots, badly);
        if (!is_image(&slots, slot, made))
            return;
        assert_true(loader_slots_try(&slots));
    }
    assert_true(false);
}

static bool until_loss(void (*act)(void), long loss) {
    chip.until_loss = loss;
    if (setjmp(chip.lost) == 0) {
        act();
        chip.until_loss = -1;
        return true;
    }
    chip.until_loss = -1;
    return false;
}

static void take_new(void) {
    live(&new, true);
}

static void fail_new(void) {
    give_up(&new, true);
}

static void fail_new_slowly(void) {
    give_up(&new, false);
}

static const struct {
    uint32_t sector, page, sectors, torn;
} geometries[] = {{512, 64, 45, 0},
                  {4096, 256, 13, 0},
                  {2048, 512, 64, 0},
                  {4096, 512, 15, 512}, /* a card's blocks */
                  {512, 512, 80, 512}};

/* What is behind a loss: the board starts one of the two, whole; what it held
 * it holds; and the transfer ends as if nothing had been. */
static void recover(const struct made *before, uint32_t held) {
    struct loader_slots slots;
    unsigned slot = starts(&slots, false);
    if (before != NULL)
        assert_true(slot < LOADER_SLOTS);
    assert_true(slot == LOADER_SLOTS || is_image(&slots, slot, &new) ||
                (before != NULL && is_image(&slots, slot, before)));
    loader_incoming_init(&in, &slots);
    chip_begin(&in, &new);
    assert_true(in.phase == LOADER_THERE || in.held >= held);
    live(&new, true);
    slot = starts(&slots, true);
    assert_true(is_image(&slots, slot, &new));
}

static void cut_everywhere(const struct made *before, void (*act)(void)) {
    static uint8_t image[CHIP_BYTES];
    memcpy(image, chip.bytes, chip_size(&chip));
    chip.done = 0;
    assert_true(until_loss(act, -1));
    long all = chip.done;
    assert_true(all > 20);
    for (long loss = 0; loss < all; loss++) {
        for (unsigned tear = 0; tear < TEARS; tear++) {
            memcpy(chip.bytes, image, chip_size(&chip));
            chip.random = (uint32_t)loss * TEARS + tear;
            memset(&in, 0, sizeof in);
            assert_false(until_loss(act, loss));
            uint32_t held = in.phase == LOADER_TAKES ? in.held : 0;
            recover(before, held);
        }
    }
}

static void each_geometry(bool empty, void (*act)(void)) {
    for (size_t g = 0; g < sizeof geometries / sizeof geometries[0]; g++) {
        chip_make(&chip, geometries[g].sector, geometries[g].page,
                  geometries[g].sectors);
        chip.flash.torn_bytes = geometries[g].torn;
        if (!empty) {
            live(&third, true);
            live(&old, true);
        }
        cut_everywhere(empty ? NULL : &old, act);
    }
}

TEST(test_cuts_of_an_empty_board) {
    each_geometry(true, take_new);
}

TEST(test_cuts_of_a_second_image) {
    each_geometry(false, take_new);
}

TEST(test_cuts_of_an_image_that_fails) {
    each_geometry(false, fail_new);
    each_geometry(false, fail_new_slowly);
}

/* Images by turns, power lost again and again, other images begun while one is
 * half there: what runs is always one of them, whole, and the last one comes
 * through in the end. */
static const struct made *wanted;

static void take_wanted(void) {
    live(wanted, true);
}

TEST(test_cuts_at_random) {
    const struct made *const all[] = {&old, &new, &third};
    chip_make(&chip, 512, 64, 45);
    live(&old, true);
    for (uint32_t i = 0; i < 6000; i++) {
        struct loader_slots slots;
        chip.random = i * 2654435761u;
        wanted = all[chip_draw(&chip) % 3];
        bool done = until_loss(take_wanted, (long)(chip_draw(&chip) % 240));
        unsigned slot = starts(&slots, false);
        assert_true(slot < LOADER_SLOTS);
        assert_true(is_image(&slots, slot, &old) ||
                    is_image(&slots, slot, &new) ||
                    is_image(&slots, slot, &third));
        assert_true(!done || is_image(&slots, slot, wanted));
        if (i % 10 == 0)
            live(wanted, true);
    }
}

static int make_images(void **state) {
    (void)state;
    made_make(&old, IMAGE, 5);
    made_make(&new, IMAGE - 300, 6);
    made_make(&third, IMAGE + 100, 7);
    return 0;
}

TEST_GROUP(make_images, NULL)
