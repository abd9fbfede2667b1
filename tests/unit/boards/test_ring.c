/* A UART between its handler and its link: rings, and what is lost. */

#include "boards/bare/bare.h"
#include "tests/unit/test.h"

static uint64_t clock_us;
static unsigned kicked;

const struct board_facts board_facts = {.name = "none", .ports = 4};

uint64_t board_now_us(void) {
    return clock_us;
}

uint32_t board_lock(void) {
    return 1;
}

void board_unlock(uint32_t before) {
    assert_int_equal(before, 1);
}

void board_uart_send(unsigned uart) {
    kicked |= 1u << uart;
}

/* A byte of UART 2 leaves. */
void board_wait(uint64_t wait_us) {
    uint8_t byte;
    clock_us += wait_us;
    (void)bare_ring_take(&bare_uart[2].send, &byte);
}

TEST(test_ring_is_a_queue) {
    uint8_t room[8], byte;
    struct bare_ring ring = BARE_RING(room);
    ring.put = ring.taken = UINT32_MAX - 20; /* the counts begin anew */
    for (uint8_t n = 0; n < 100; n = (uint8_t)(n + 5)) {
        for (uint8_t i = 0; i < 8; i++) {
            assert_int_equal(bare_ring_held(&ring), i);
            assert_true(bare_ring_put(&ring, (uint8_t)(n + i)));
        }
        assert_false(bare_ring_put(&ring, 200));
        assert_int_equal(bare_ring_room(&ring), 0);
        for (uint8_t i = 0; i < 8; i++) {
            assert_true(bare_ring_take(&ring, &byte));
            assert_int_equal(byte, n + i);
        }
        assert_false(bare_ring_take(&ring, &byte));
        ring.put += 3; /* another place in the array */
        ring.taken += 3;
    }
}

/* Against a queue that is shifted. */
TEST(test_ring_takes_pieces) {
    uint8_t room[16], queue[16], piece[24], next = 0;
    struct bare_ring ring = BARE_RING(room);
    size_t held = 0;
    srand(7);
    for (int i = 0; i < 20000; i++) {
        size_t size = (size_t)rand() % sizeof piece;
        if (rand() % 2 == 0) {
            for (size_t k = 0; k < size; k++)
                piece[k] = (uint8_t)(next + k);
            size_t written = bare_ring_write(&ring, piece, size);
            assert_int_equal(written, size < 16 - held ? size : 16 - held);
            memcpy(queue + held, piece, written);
            held += written;
            next = (uint8_t)(next + written);
        } else {
            size_t read = bare_ring_read(&ring, piece, size);
            assert_int_equal(read, size < held ? size : held);
            assert_memory_equal(piece, queue, read);
            held -= read;
            memmove(queue, queue + read, held);
        }
        assert_int_equal(bare_ring_held(&ring), held);
    }
}

TEST(test_uart_counts_what_is_lost) {
    uint8_t bytes[BARE_RECEIVE_BYTES];
    bare_uarts_init();
    struct link_pipe pipe = bare_uart_pipe(1);
    assert_false(bare_uart_ready(&bare_uart[1]));
    for (unsigned i = 0; i < BARE_RECEIVE_BYTES + 3; i++)
        bare_uart_put(&bare_uart[1], (uint8_t)i);
    bare_uart_put(&bare_uart[4], 1);
    bare_uart[4].overruns++;
    assert_true(bare_uart_ready(&bare_uart[1]));
    assert_int_equal(bare_uarts_overruns(), 4);
    assert_int_equal(pipe.receive(pipe.context, bytes, sizeof bytes),
                     sizeof bytes);
    for (unsigned i = 0; i < sizeof bytes; i++)
        assert_int_equal(bytes[i], i % 256);
    assert_int_equal(pipe.receive(pipe.context, bytes, sizeof bytes), 0);
}

TEST(test_uart_wakes_who_has_more_to_send) {
    uint8_t bytes[BARE_SEND_BYTES + 1] = {1, 2, 3}, byte = 0;
    bare_uarts_init();
    kicked = 0;
    struct link_pipe pipe = bare_uart_pipe(3);
    assert_int_equal(pipe.send(pipe.context, bytes, 3), 3);
    assert_int_equal(kicked, 1 << 3);
    assert_false(bare_uart_ready(&bare_uart[3]));
    assert_int_equal(pipe.send(pipe.context, bytes, sizeof bytes),
                     BARE_SEND_BYTES - 3);
    for (unsigned i = 0; i < BARE_SEND_BYTES / 2; i++) {
        assert_false(bare_uart_ready(&bare_uart[3]));
        assert_true(bare_ring_take(&bare_uart[3].send, &byte));
    }
    assert_true(bare_uart_ready(&bare_uart[3]));
}

/* Bytes of a frame wake nobody before its end, unless they are many. */
TEST(test_uart_wakes_at_the_end_of_a_frame) {
    uint8_t bytes[64];
    bare_uarts_init();
    struct link_pipe pipe = bare_uart_pipe(2);
    struct bare_uart *uart = &bare_uart[2];
    for (int i = 0; i < 20; i++) {
        bare_uart_put(uart, 7);
        assert_true(bare_uart_heard(uart));
        assert_false(bare_uart_ready(uart));
    }
    bare_uart_put(uart, 0);
    assert_true(bare_uart_ready(uart));
    assert_int_equal(pipe.receive(pipe.context, bytes, 10), 10);
    assert_true(bare_uart_ready(uart)); /* the end is still to come */
    assert_int_equal(pipe.receive(pipe.context, bytes, 64), 11);
    assert_false(bare_uart_ready(uart));
    for (int i = 0; i < BARE_RECEIVE_BYTES / 4; i++) {
        assert_false(bare_uart_ready(uart));
        bare_uart_put(uart, 7);
    }
    assert_true(bare_uart_ready(uart));
}

/* A wire that leads nowhere: noise on it keeps no board awake. */
TEST(test_uart_without_a_link_wakes_nobody) {
    bare_uarts_init();
    bare_uart_leave(4);
    uint32_t before = bare_uarts_overruns();
    for (unsigned i = 0; i <= BARE_RECEIVE_BYTES; i++) {
        bare_uart_put(&bare_uart[4], 0);
        bare_uart_put(&bare_uart[3], 0);
    }
    assert_false(bare_uart_ready(&bare_uart[4]));
    assert_true(bare_uart_ready(&bare_uart[3]));
    assert_int_equal(bare_uarts_overruns(), before + 1);
    bare_uarts_init();
    bare_uart_put(&bare_uart[4], 0);
    assert_true(bare_uart_ready(&bare_uart[4]));
}

TEST(test_uart_flushes) {
    uint8_t bytes[40] = {0};
    bare_uarts_init();
    struct link_pipe pipe = bare_uart_pipe(2);
    clock_us = 0;
    assert_int_equal(pipe.send(pipe.context, bytes, sizeof bytes), 40);
    bare_uarts_flush(1000000);
    assert_int_equal(bare_ring_held(&bare_uart[2].send), 0);
    assert_true(clock_us < 1000000);
    pipe = bare_uart_pipe(1); /* whose other end takes nothing */
    assert_int_equal(pipe.send(pipe.context, bytes, 1), 1);
    clock_us = 0;
    bare_uarts_flush(1000000);
    assert_int_equal(clock_us, 1000000);
}
