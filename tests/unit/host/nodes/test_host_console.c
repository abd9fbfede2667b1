/* What a board's console says is heard among frames, and a fault is kept. */

#include "host/nodes/port.h"
#include "transport/frame.h"
#include "tests/unit/test.h"

#define START "incode: mps2-an500: started, version 1, after power on\r\n"
#define REPORT                                                                 \
    "incode: mps2-an500: a stack overflow, address 0x1ffffffc; restarting\r\n" \
    " pc 0x00001234 lr 0x00005678\r\n"

static void hear_record(struct host_console *console, const char *text) {
    static const uint8_t mark[] = {0, 0xff}, end[] = {0};
    host_console_hear(console, mark, sizeof mark);
    host_console_hear(console, (const uint8_t *)text, strlen(text));
    host_console_hear(console, end, sizeof end);
}

TEST(a_fault_is_kept) {
    struct host_console console;
    host_console_init(&console, 3, "mps2-an500");
    assert_null(host_console_fault(&console));
    hear_record(&console, START);
    assert_null(host_console_fault(&console));
    hear_record(&console, REPORT);
    assert_string_equal(host_console_fault(&console),
                        "a stack overflow, address 0x1ffffffc");
    assert_int_equal(console.faults, 1);
    hear_record(&console, START);
    assert_int_equal(console.faults, 1);
}

/* Frames that hold the same bytes, whole and in pieces, are no records. */
TEST(frames_are_passed_over) {
    static uint8_t wire[FRAME_ENCODED(LINK_MESSAGE_MAX) + FRAME_SLACK];
    static uint8_t payload[LINK_MESSAGE_MAX];
    struct frame_header header = {.session = 0x01010101, .size = 1500};
    struct host_console console;
    host_console_init(&console, 0, "mps2-an500");
    for (unsigned round = 0; round < 300; round++) {
        memset(payload, 0xff, sizeof payload);
        payload[round] = 0;
        payload[round + 1] = 0xff;
        memcpy(payload + round + 2, REPORT, sizeof REPORT);
        payload[round + 2 + sizeof REPORT] = 0;
        size_t size = frame_encode(wire, &header, payload);
        host_console_hear(&console, wire, size);
    }
    assert_int_equal(console.faults, 0);
    hear_record(&console, REPORT);
    assert_int_equal(console.faults, 1);
}

/* No text is too long. */
TEST(a_long_record_is_cut) {
    static const char end[] = "; restarting";
    static char text[3 * HOST_CONSOLE_TEXT];
    struct host_console console;
    host_console_init(&console, 1, "board");
    memset(text, 'x', sizeof text - 1);
    for (size_t i = 0; i < sizeof end - 1; i++)
        text[600 + i] = end[i];
    hear_record(&console, text);
    assert_int_equal(console.faults, 1);
    assert_int_equal(strlen(console.fault), 600);
}

static int bring(void *context, uint8_t *bytes, size_t size) {
    static const uint8_t record[] = "\0\377" REPORT;
    size_t *at = context;
    size_t n = sizeof record - *at < size ? sizeof record - *at : size;
    memcpy(bytes, record + *at, n);
    *at += n;
    return (int)n;
}

static int take(void *context, const uint8_t *bytes, size_t size) {
    (void)context, (void)bytes;
    return (int)size;
}

TEST(a_pipe_stays_as_it_is) {
    struct host_console console;
    uint8_t bytes[7];
    size_t at = 0, got = 0;
    int n;
    host_console_init(&console, 0, "mps2-an500");
    struct link_pipe pipe =
        host_console_pipe(&console, (struct link_pipe){&at, take, bring});
    assert_int_equal(pipe.send(pipe.context, bytes, sizeof bytes),
                     sizeof bytes);
    while ((n = pipe.receive(pipe.context, bytes, sizeof bytes)) > 0)
        got += (size_t)n;
    assert_int_equal(got, sizeof "\0\377" REPORT);
    assert_int_equal(console.faults, 1);
}
