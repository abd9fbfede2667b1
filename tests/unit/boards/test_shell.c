/* Text and frames on one wire: neither harms the other. */

#include "boards/bare/bare.h"
#include "boards/bare/shell.h"
#include "transport/frame.h"
#include "tests/unit/test.h"

enum { WIRE_BYTES = 1 << 20, PAYLOAD_MAX = 500 };

static uint64_t clock_us;

uint64_t board_now_us(void) {
    return clock_us;
}

bool board_console_put(uint8_t byte) {
    (void)byte;
    return true;
}

/* A wire that gives and takes a few bytes at a time. */
static struct {
    uint8_t in[WIRE_BYTES], out[WIRE_BYTES];
    size_t in_size, in_taken, out_size, room;
} wire;

static int wire_send(void *context, const uint8_t *bytes, size_t size) {
    size_t taken = size < wire.room ? size : wire.room;
    (void)context;
    assert_true(wire.out_size + taken <= WIRE_BYTES);
    memcpy(wire.out + wire.out_size, bytes, taken);
    wire.out_size += taken;
    return (int)taken;
}

static int wire_receive(void *context, uint8_t *bytes, size_t size) {
    size_t left = wire.in_size - wire.in_taken;
    size_t given = left < size ? left : size;
    (void)context;
    memcpy(bytes, wire.in + wire.in_taken, given);
    wire.in_taken += given;
    return (int)given;
}

static struct bare_shell begin(void) {
    struct bare_shell shell;
    wire.in_size = wire.in_taken = wire.out_size = 0;
    wire.room = WIRE_BYTES;
    clock_us = 1000000;
    bare_shell_init(&shell, (struct link_pipe){NULL, wire_send, wire_receive});
    return shell;
}

static void type(const char *text) {
    memcpy(wire.in + wire.in_size, text, strlen(text));
    wire.in_size += strlen(text);
}

static void takes(struct bare_shell *shell, const char *expected) {
    char line[BARE_SHELL_LINE + 1];
    assert_true(bare_shell_line(shell, line, clock_us));
    assert_string_equal(line, expected);
}

/* As a link may send it: of the kinds that there are, and anything else. */
static size_t make_frame(uint8_t *out) {
    uint8_t payload[PAYLOAD_MAX];
    struct frame_header header = {.kind = (uint8_t)(1 + rand() % 5),
                                  .flags = (uint8_t)(rand() % 4),
                                  .credit = (uint8_t)rand(),
                                  .session = (uint32_t)rand() ^ (uint32_t)rand()
                                                                    << 16,
                                  .sequence = (uint16_t)rand(),
                                  .acknowledge = (uint16_t)rand(),
                                  .size = (uint16_t)(rand() % PAYLOAD_MAX)};
    bool text = rand() % 3 == 0; /* which is not to be mistaken */
    for (unsigned i = 0; i < header.size; i++)
        payload[i] = (uint8_t)(text ? "who\r\nhelp"[rand() % 9] : rand());
    return frame_encode(out, &header, payload);
}

/* Reads all there is, in pieces: what the link gets. */
static size_t read_all(struct bare_shell *shell, uint8_t *bytes) {
    struct link_pipe pipe = bare_shell_pipe(shell);
    size_t size = 0;
    int got;
    do {
        got =
            pipe.receive(pipe.context, bytes + size, (size_t)(1 + rand() % 90));
        size += (size_t)got;
    } while (got > 0 || wire.in_taken < wire.in_size);
    return size;
}

TEST(test_frames_pass_and_lines_are_taken) {
    static const char *const words[] = {"who", "links", "help me", "Fault 3"};
    static uint8_t frames[WIRE_BYTES], got[WIRE_BYTES];
    static uint8_t frame[FRAME_ENCODED(PAYLOAD_MAX) + FRAME_SLACK];
    char line[BARE_SHELL_LINE + 1];
    struct bare_shell shell = begin();
    size_t size = 0, read = 0;
    srand(1);
    for (unsigned turn = 0; turn < 2000; turn++) {
        const char *word = words[rand() % 4];
        bool typed = rand() % 3 == 0;
        for (int n = rand() % 3; n > 0; n--) {
            size_t bytes = make_frame(frame);
            memcpy(frames + size, frame, bytes);
            memcpy(wire.in + wire.in_size, frame, bytes);
            size += bytes;
            wire.in_size += bytes;
        }
        if (typed) {
            type(word);
            type(rand() % 2 == 0 ? "\r" : "\r\n");
        }
        clock_us += 10;
        read += read_all(&shell, got + read);
        assert_int_equal(bare_shell_line(&shell, line, clock_us), typed);
        if (typed)
            assert_string_equal(line, word);
    }
    assert_int_equal(read, size);
    assert_memory_equal(got, frames, size);
}

TEST(test_a_frame_in_pieces_is_no_line) {
    static uint8_t frame[FRAME_ENCODED(PAYLOAD_MAX) + FRAME_SLACK];
    uint8_t got[2 * sizeof frame];
    char line[BARE_SHELL_LINE + 1];
    struct bare_shell shell = begin();
    struct link_pipe pipe = bare_shell_pipe(&shell);
    srand(2);
    for (unsigned turn = 0; turn < 500; turn++) {
        size_t size = make_frame(frame), read = 0;
        for (size_t i = 0; i < size; i++) {
            wire.in_size = wire.in_taken = 0;
            wire.in[wire.in_size++] = frame[i];
            clock_us += 1000; /* as at 9,600 baud */
            read +=
                (size_t)pipe.receive(pipe.context, got + read, sizeof frame);
            assert_false(bare_shell_line(&shell, line, clock_us));
        }
        assert_int_equal(read, size);
        assert_memory_equal(got, frame, size);
    }
}

TEST(test_enter_alone_is_a_line) {
    uint8_t bytes[8];
    char line[BARE_SHELL_LINE + 1];
    struct bare_shell shell = begin();
    type("\r");
    assert_int_equal(read_all(&shell, bytes), 0);
    assert_false(bare_shell_line(&shell, line, clock_us));
    clock_us += BARE_SHELL_SILENCE_US;
    takes(&shell, "");
    type("whp\bo\n"); /* and who rubs out what was wrong */
    assert_int_equal(read_all(&shell, bytes), 0);
    takes(&shell, "who");
}

/* After noise without an end: a silence ends it. */
TEST(test_noise_is_passed_on) {
    uint8_t bytes[100];
    char line[BARE_SHELL_LINE + 1];
    struct bare_shell shell = begin();
    type("\x81\x92 noise");
    assert_int_equal(read_all(&shell, bytes), 8);
    clock_us += BARE_SHELL_SILENCE_US;
    assert_false(bare_shell_line(&shell, line, clock_us));
    type("a line that is longer than any that somebody types\rwho\r");
    assert_true(read_all(&shell, bytes) > 0);
    assert_false(bare_shell_line(&shell, line, clock_us));
    wire.in[wire.in_size++] = 0;
    type("who\r");
    assert_int_equal(read_all(&shell, bytes), 1);
    takes(&shell, "who");
}

/* What is said stands between two frames, whole. */
TEST(test_text_goes_between_frames) {
    static uint8_t frame[FRAME_ENCODED(PAYLOAD_MAX) + FRAME_SLACK];
    static const char said[] = "\0\xff"
                               "incode: here\0";
    char line[BARE_SHELL_LINE + 1];
    struct bare_shell shell = begin();
    struct link_pipe pipe = bare_shell_pipe(&shell);
    srand(3);
    for (unsigned turn = 0; turn < 500; turn++) {
        size_t size = make_frame(frame), sent = 0;
        wire.out_size = 0;
        size_t at = (size_t)rand() % size;
        while (sent < size) {
            if (sent >= at && at != SIZE_MAX) {
                bare_shell_say(&shell, "incode: here");
                at = SIZE_MAX;
            }
            wire.room = (size_t)rand() % 40;
            (void)bare_shell_line(&shell, line, clock_us);
            sent += (size_t)pipe.send(pipe.context, frame + sent, size - sent);
        }
        if (at != SIZE_MAX)
            bare_shell_say(&shell, "incode: here");
        wire.room = 40;
        (void)bare_shell_line(&shell, line, clock_us);
        (void)bare_shell_line(&shell, line, clock_us);
        assert_int_equal(wire.out_size, size + sizeof said - 1);
        bool first = memcmp(wire.out, said, sizeof said - 1) == 0;
        assert_memory_equal(wire.out + (first ? sizeof said - 1 : 0), frame,
                            size);
        assert_memory_equal(wire.out + (first ? 0 : size), said,
                            sizeof said - 1);
    }
}

/* Who types sees no frames; who sends one has them again. */
TEST(test_frames_are_kept_back_for_who_types) {
    static uint8_t frame[FRAME_ENCODED(PAYLOAD_MAX) + FRAME_SLACK];
    uint8_t got[sizeof frame];
    char line[BARE_SHELL_LINE + 1];
    struct bare_shell shell = begin();
    struct link_pipe pipe = bare_shell_pipe(&shell);
    size_t size = make_frame(frame);
    type("who\r");
    (void)read_all(&shell, got);
    assert_true(bare_shell_line(&shell, line, clock_us));
    assert_int_equal(pipe.send(pipe.context, frame, size), size);
    assert_int_equal(wire.out_size, 0);
    memcpy(wire.in + wire.in_size, frame, size);
    wire.in_size += size;
    assert_int_equal(read_all(&shell, got), size);
    assert_int_equal(pipe.send(pipe.context, frame, size), size);
    assert_int_equal(wire.out_size, size);
    type("who\r");
    (void)read_all(&shell, got);
    clock_us += BARE_SHELL_HUSH_US;
    assert_int_equal(pipe.send(pipe.context, frame, size), size);
    assert_int_equal(wire.out_size, 2 * size);
}

/* After a restart nobody is known to type: one key, and frames cease; a frame's
 * first byte, with the rest behind it, is no key. */
TEST(test_one_key_keeps_frames_back) {
    static uint8_t frame[FRAME_ENCODED(PAYLOAD_MAX) + FRAME_SLACK];
    uint8_t got[sizeof frame];
    char line[BARE_SHELL_LINE + 1];
    size_t size = make_frame(frame);
    for (unsigned i = 0; i < 2; i++) {
        struct bare_shell shell = begin();
        struct link_pipe pipe = bare_shell_pipe(&shell);
        assert_int_equal(pipe.send(pipe.context, frame, size), size);
        type(i == 0 ? "w" : "who");
        (void)read_all(&shell, got);
        assert_false(bare_shell_line(&shell, line, clock_us));
        assert_int_equal(pipe.send(pipe.context, frame, size), size);
        assert_int_equal(wire.out_size, 2 * size); /* not a key yet */
        clock_us += BARE_SHELL_SILENCE_US;
        assert_false(bare_shell_line(&shell, line, clock_us));
        assert_int_equal(pipe.send(pipe.context, frame, size), size);
        assert_int_equal(wire.out_size, 2 * size);
        type(i == 0 ? "ho\r" : "\r"); /* and the line is whole */
        (void)read_all(&shell, got);
        assert_true(bare_shell_line(&shell, line, clock_us));
        assert_string_equal(line, "who");
    }
}

TEST(test_lines_wait_for_each_other) {
    static const char *const words[] = {"who", "links", "", "memory"};
    uint8_t bytes[8];
    char line[BARE_SHELL_LINE + 1];
    struct bare_shell shell = begin();
    type("who\r\nlinks\r\n\r\nmemory\r\n");
    assert_int_equal(read_all(&shell, bytes), 0);
    for (unsigned i = 0; i < 4; i++) {
        takes(&shell, words[i]);
        bare_shell_say(&shell, "an answer");
        wire.room = 0;
        assert_false(bare_shell_line(&shell, line, clock_us));
        wire.room = WIRE_BYTES;
    }
    assert_false(bare_shell_line(&shell, line, clock_us));
    for (unsigned i = 0; i < 100; i++)
        type("who\n");
    assert_int_equal(read_all(&shell, bytes), 0);
    for (unsigned i = 0; i < BARE_SHELL_LINES; i++)
        assert_true(bare_shell_line(&shell, line, clock_us));
    assert_false(bare_shell_line(&shell, line, clock_us));
}

TEST(test_a_uart_without_a_link_is_read) {
    struct bare_shell shell = begin();
    for (unsigned i = 0; i < 1000; i++) {
        type("\x81 some noise\r");
        wire.in[wire.in_size++] = 0;
    }
    type("links\r");
    bare_shell_alone(&shell);
    takes(&shell, "links");
}
