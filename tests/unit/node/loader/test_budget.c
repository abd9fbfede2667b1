/* What a flash comes to that somebody who gives orders wears on purpose, as
 * fast as a board obeys: restarts, images that were signed once and are brought
 * with false code, false signatures. */
#include "loader_chip.h"
#include "node/loader/slots.h"

enum {
    IMAGE = 5 * LOADER_BLOCK_BYTES + 700,
    DAYS = 20,
    DAY_S = 86400,
    ERASURES = 100000, /* of a sector, in the data sheets of serial NOR flash */
    SECTORS = 64
};

static struct loader_budget budget;
static struct loader_rules rules;
static struct loader_slots slots;
static struct loader_incoming in;
static struct made one, two;
static uint32_t erasures[SECTORS], proofs;
static uint64_t now_us, started_us; /* since the beginning */

static bool count_erasure(void *context, uint32_t sector) {
    erasures[sector]++;
    return chip_erase(context, sector);
}

static bool count_proof(const uint8_t signature[SIGN_BYTES],
                        const uint8_t *bytes, size_t size,
                        const uint8_t key[SIGN_PUBLIC_BYTES]) {
    proofs++;
    return quick_good(signature, bytes, size, key);
}

static const struct sign_suite counting = {quick_begin, quick_add, quick_end,
                                           count_proof};

static int blank_board(void **state) {
    (void)state;
    chip_make(&chip, 4096, 256, SECTORS);
    chip.flash.erase = count_erasure;
    rules = chip_rules;
    rules.suite = &counting;
    rules.budget = &budget;
    made_make(&one, IMAGE, 5);
    made_make(&two, IMAGE - 300, 6);
    memset(erasures, 0, sizeof erasures);
    memset(&budget, 0x5a, sizeof budget); /* as after power on */
    now_us = started_us = proofs = 0;
    return 0;
}

static void pass(uint64_t us) {
    now_us += us;
    loader_budget_pass(&budget, now_us - started_us);
}

/* As a board does it; whether it had to wait. */
static bool start(void) {
    bool waited = false;
    uint32_t boot;
    started_us = now_us;
    loader_budget_open(&budget);
    while (!loader_budget_take(&budget, LOADER_STARTS)) {
        pass(50000);
        waited = true;
    }
    (void)loader_slots_start(&slots, &rules, false, &boot);
    loader_incoming_init(&in, &slots);
    return waited;
}

static uint32_t most_of(uint32_t first, uint32_t sectors) {
    uint32_t most = 0;
    for (uint32_t i = first; i < first + sectors; i++)
        most = erasures[i] > most ? erasures[i] : most;
    return most;
}

/* Of a sector that was erased so often meanwhile, but for the first times. */
static double years(uint32_t erased, uint64_t us) {
    return (double)ERASURES / (double)erased * 1e-6 * (double)us / DAY_S /
           365.25;
}

TEST_WITH(restarts_cannot_wear_out_a_board, blank_board, NULL) {
    uint32_t starts = 0, at_once = 0;
    while (!start()) {
        assert_true(at_once++ < 2000);
        pass(100000); /* restart orders are obeyed so soon */
    }
    assert_in_range(at_once, 1000, 1010); /* one came back each minute */
    memset(erasures, 0, sizeof erasures);
    uint64_t from_us = now_us;
    while (now_us - from_us < DAYS * DAY_S * UINT64_C(1000000)) {
        pass(100000);
        (void)start();
        starts++;
    }
    assert_in_range(starts, DAYS * 1420, DAYS * 1440); /* seconds are whole */
    double most = years(most_of(0, 5), now_us - from_us);
    print_message("%u starts in %d days, sectors of boots last %.0f years\n",
                  starts, DAYS, most);
    assert_true(most > 95);
    memset(&budget, 0, sizeof budget); /* the power was off */
    assert_false(start());
}

/* Brings code that is not what was signed, twice where the board restarts in
 * the midst of it; false: it is not begun. */
static bool bring_false(const struct made *made, bool restarts) {
    static struct made bad;
    bad = *made;
    for (uint32_t i = LOADER_HEADER_BYTES; i < bad.bytes; i++)
        bad.all[i] ^= 0xff;
    chip_begin(&in, &bad);
    if (in.phase == LOADER_REFUSES) {
        assert_int_equal(in.fault, LOADER_TOO_OFTEN);
        return false;
    }
    chip_bring(&in, &bad);
    if (restarts) {
        (void)start();
        return true;
    }
    chip_verify(&in);
    if (in.phase == LOADER_TAKES) { /* parts of it were there before */
        chip_bring(&in, &bad);
        chip_verify(&in);
    }
    assert_int_equal(in.phase, LOADER_REFUSES);
    assert_int_equal(in.fault, LOADER_WRONG_DIGEST);
    return true;
}

TEST_WITH(false_transfers_cannot_wear_out_a_slot, blank_board, NULL) {
    const struct loader_layout layout = loader_layout(&chip.flash);
    uint32_t begun = 0, before[SECTORS];
    uint64_t from_us = 0;
    (void)start();
    pass(1000000);
    while (from_us == 0 ||
           now_us - from_us < DAYS * DAY_S * UINT64_C(1000000)) {
        memcpy(before, erasures, sizeof before);
        if (bring_false(begun % 4 < 2 ? &one : &two, begun % 2 == 0)) {
            begun++;
            for (uint32_t i = layout.first; i < SECTORS; i++)
                assert_true(erasures[i] - before[i] <= 3);
            continue;
        }
        if (from_us == 0) {
            assert_int_equal(begun, 100);
            memset(erasures, 0, sizeof erasures);
            begun = 0;
            from_us = now_us;
        }
        pass(60000000);
        (void)start(); /* which gives nothing back */
    }
    assert_in_range(begun, DAYS * 6 - 1, DAYS * 6 + 1);
    double most = years(most_of(layout.first, LOADER_SLOTS * layout.sectors),
                        now_us - from_us);
    print_message("%u false transfers in %d days, slots last %.0f years\n",
                  begun, DAYS, most);
    assert_true(most > 15);
}

/* Nothing is written for them, and of many few are looked at. */
TEST_WITH(false_signatures_cost_little, blank_board, NULL) {
    struct made bad = one;
    (void)start();
    bad.image.signature[0] ^= 1;
    loader_image_pack(&bad.image, bad.all);
    memset(erasures, 0, sizeof erasures);
    uint32_t programs = chip.programs;
    proofs = 0;
    for (unsigned i = 0; i < 6; i++) {
        chip_begin(&in, &bad);
        assert_int_equal(in.fault, LOADER_WRONG_SIGNATURE);
    }
    for (unsigned i = 0; i < 1000; i++) {
        chip_begin(&in, i % 2 == 0 ? &bad : &one);
        assert_int_equal(in.phase, LOADER_REFUSES);
        assert_int_equal(in.fault, LOADER_TOO_OFTEN);
        assert_false(loader_incoming_proved(&in));
    }
    assert_int_equal(proofs, 6);
    assert_int_equal(most_of(0, SECTORS), 0);
    assert_int_equal(chip.programs, programs);
    pass(10000000);
    chip_begin(&in, &one);
    assert_int_equal(in.phase, LOADER_TAKES);
    assert_true(loader_incoming_proved(&in));
}
