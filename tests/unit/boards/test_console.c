/* What a board says: records that no link takes for a frame, registers in
 * words, why it was restarted, how deep its stack was. */

#include "boards/bare/bare.h"
#include "boards/bare/console.h"
#include "boards/bare/fault_text.h"
#include "boards/bare/handover.h"
#include "boards/bare/stack.h"
#include "transport/frame.h"
#include "transport/link.h"
#include "tests/unit/test.h"

static uint8_t said[300];
static size_t said_size, said_max;
static jmp_buf restarted;

const struct board_facts board_facts = {.name = "none", .ports = 4};
uint32_t bare_node_stack[BARE_STACK_BYTES / sizeof(uint32_t)];

bool board_console_put(uint8_t byte) {
    if (said_size >= said_max)
        return false;
    said[said_size++] = byte;
    return true;
}

void board_feed(void) {}

static bool locked;

uint32_t board_lock(void) {
    return locked = true;
}

void board_restart(void) {
    longjmp(restarted, 1);
}

static int listen(void **state) {
    (void)state;
    said_size = 0;
    said_max = sizeof said;
    memset(said, 0, sizeof said);
    return 0;
}

TEST_WITH(test_console_record, listen, NULL) {
    static const uint8_t record[] = {0, 0xff, 'a', ' ', 'b', 0};
    bare_console_begin();
    bare_console_put("a ");
    bare_console_put("b");
    bare_console_end();
    assert_int_equal(said_size, sizeof record);
    assert_memory_equal(said, record, sizeof record);
}

/* Between the two zeros. */
TEST_WITH(test_console_record_is_no_frame, listen, NULL) {
    struct frame_reader reader;
    struct frame_header header;
    for (size_t size = 0; size < 250; size++) {
        char text[251];
        (void)listen(NULL);
        memset(text, ' ' + (int)(size % 90), size);
        text[size] = '\0';
        bare_console_begin();
        bare_console_put(text);
        bare_console_end();
        assert_int_equal(said_size, size + 3);
        assert_true(frame_open(&reader, said + 1, said_size - 2, &header) !=
                    FRAME_GOOD);
        assert_false(link_greets(said, said_size));
    }
}

/* Its end says at least that it ends. */
TEST_WITH(test_console_gives_up, listen, NULL) {
    said_max = 5;
    bare_console_begin();
    bare_console_put("abcdef");
    bare_console_end();
    assert_int_equal(said_size, 5);
    assert_memory_equal(said + 2, "abc", 3);
}

TEST_WITH(test_hex, listen, NULL) {
    char room[80];
    struct cube_text text = cube_text_in(room, sizeof room);
    struct bare_register registers[] = {{"pc", 0x1234},
                                        {"x0", UINT64_C(0xfedcba9876543210)}};
    bare_text_hex(&text, 0, 1);
    cube_text_put(&text, " ");
    bare_text_hex(&text, 0x5af, 2);
    bare_text_registers(&text, registers, 2);
    assert_string_equal(room, "0x0 0x5af pc 0x00001234 x0 0xfedcba9876543210");
}

TEST_WITH(test_reason_is_kept, listen, NULL) {
    struct bare_reason reason = bare_reason_take();
    assert_int_equal(reason.kind, BARE_POWER_ON);
    assert_int_equal(reason.starts, 1);
    assert_int_equal(reason.faults, 0);
    assert_int_equal(bare_reason_take().kind, BARE_OUTSIDE);
    bare_reason_keep(BARE_RUN_OVER, NULL);
    assert_int_equal(bare_reason_take().kind, BARE_RUN_OVER);
    bare_reason_keep(BARE_HUNG, "at home");
    reason = bare_reason_take();
    assert_int_equal(reason.kind, BARE_HUNG);
    assert_int_equal(reason.faults, 1);
    assert_string_equal(reason.text, "at home");
    reason = bare_reason_take(); /* the text of the last stays */
    assert_int_equal(reason.kind, BARE_OUTSIDE);
    assert_int_equal(reason.starts, 5);
    assert_string_equal(reason.text, "at home");
    for (int kind = BARE_POWER_ON; kind <= BARE_HUNG; kind++)
        assert_true(strlen(bare_reason_name((enum bare_reason_kind)kind)) > 4);
}

TEST_WITH(test_fault_is_told_and_kept, listen, NULL) {
    struct bare_register pc = {"pc", 0x10};
    (void)bare_reason_take();
    locked = false;
    if (setjmp(restarted) == 0)
        bare_fault("a thing", &pc, 1, 0);
    assert_true(locked);
    assert_non_null(
        strstr((char *)said + 2, "incode: none: a thing; restarting"));
    assert_non_null(strstr((char *)said + 2, " pc 0x00000010"));
    assert_int_equal(said[said_size - 1], 0);
    struct bare_reason reason = bare_reason_take();
    assert_int_equal(reason.kind, BARE_FAULT);
    assert_string_equal(reason.text, "a thing");
}

TEST_WITH(test_stack_s_paint, listen, NULL) {
    uint32_t words[16];
    for (size_t used = 0; used <= 16; used++) {
        for (size_t i = 0; i < 16; i++)
            words[i] = i < 16 - used ? BARE_PAINT : (uint32_t)i;
        words[15] = used > 3 ? BARE_PAINT : words[15]; /* above: no matter */
        assert_int_equal(bare_stack_used(words, sizeof words), 4 * used);
    }
    assert_int_equal(bare_stack_high_water(), BARE_STACK_BYTES);
}
