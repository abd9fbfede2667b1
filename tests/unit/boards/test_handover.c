/* What a loader leaves for its image, in memory that a restart keeps. */

#include "boards/bare/handover.h"
#include "tests/unit/test.h"

TEST(test_handover_is_taken_once) {
    struct bare_handover given = {.boot = 7, .slot = 1, .number = 3}, taken;
    assert_false(bare_handover_take(&taken)); /* power on */
    assert_false(bare_handover_drop());
    memset(given.digest, 0x5a, sizeof given.digest);
    bare_handover_give(&given);
    assert_true(bare_handover_take(&taken));
    assert_int_equal(taken.boot, 7);
    assert_int_equal(taken.slot, 1);
    assert_memory_equal(taken.digest, given.digest, sizeof taken.digest);
    assert_true(taken.magic != 0); /* by which the program knows it */
    assert_false(bare_handover_take(&taken));
    assert_true(bare_handover_drop()); /* the last start was of an image, */
    assert_false(bare_handover_drop());
    bare_handover_give(&given); /* and also where that never came so far */
    assert_true(bare_handover_drop());
    assert_false(bare_handover_take(&taken));
}

TEST(test_reason_is_the_loader_s) {
    struct bare_reason reason = bare_reason_take();
    assert_int_equal(reason.kind, BARE_POWER_ON);
    assert_int_equal(reason.starts, 1);
    bare_reason_keep(BARE_FAULT, "a stack overflow");
    reason = bare_reason_take(); /* the loader's */
    assert_int_equal(reason.kind, BARE_FAULT);
    struct bare_reason again = bare_reason_taken(reason.kind);
    assert_int_equal(again.kind, BARE_FAULT);
    assert_int_equal(again.starts, 2);
    assert_int_equal(again.faults, 1);
    assert_string_equal(again.text, "a stack overflow");
    assert_int_equal(bare_reason_take().kind, BARE_OUTSIDE);
    for (enum bare_reason_kind kind = BARE_POWER_ON; kind <= BARE_BOOT;
         kind++) {
        assert_non_null(bare_reason_name(kind));
        bare_reason_keep(kind, NULL);
        assert_int_equal(bare_reason_take().kind, kind);
    }
}
