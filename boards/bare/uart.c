#include "uart.h"

#include <string.h>

#include "bare.h"

/* Bytes from `at` on that lie in one piece, of `size`. */
static size_t piece(const struct bare_ring *ring, uint32_t at, size_t size) {
    size_t to_end = ring->mask + 1 - (at & ring->mask);
    return size < to_end ? size : to_end;
}

size_t bare_ring_write(struct bare_ring *ring, const uint8_t *bytes,
                       size_t size) {
    uint32_t put = ring->put, room = bare_ring_room(ring);
    size_t all = size < room ? size : room;
    size_t first = piece(ring, put, all);
    memcpy(ring->bytes + (put & ring->mask), bytes, first);
    memcpy(ring->bytes, bytes + first, all - first);
    atomic_signal_fence(memory_order_release);
    ring->put = put + (uint32_t)all;
    return all;
}

size_t bare_ring_read(struct bare_ring *ring, uint8_t *bytes, size_t size) {
    uint32_t taken = ring->taken, held = bare_ring_held(ring);
    size_t all = size < held ? size : held;
    size_t first = piece(ring, taken, all);
    atomic_signal_fence(memory_order_acquire);
    memcpy(bytes, ring->bytes + (taken & ring->mask), first);
    memcpy(bytes + first, ring->bytes, all - first);
    atomic_signal_fence(memory_order_release);
    ring->taken = taken + (uint32_t)all;
    return all;
}

/* --- uart ----------------------------------------------------------------- */

enum { FLUSH_LOOK_US = 1000 };

struct bare_uart bare_uart[BARE_UARTS_MAX];

void bare_uarts_init(void) {
    for (unsigned i = 0; i < BARE_UARTS_MAX; i++) {
        struct bare_uart *uart = &bare_uart[i];
        uart->receive = (struct bare_ring)BARE_RING(uart->received);
        uart->send = (struct bare_ring)BARE_RING(uart->sent);
        uart->ends = uart->ends_taken = 0;
        uart->unused = false;
    }
}

bool bare_uart_ready(const struct bare_uart *uart) {
    return !uart->unused &&
           (uart->ends != uart->ends_taken ||
            bare_ring_held(&uart->receive) >= BARE_RECEIVE_BYTES / 4 ||
            (uart->starved &&
             bare_ring_room(&uart->send) >= BARE_SEND_BYTES / 2));
}

static int send(void *context, const uint8_t *bytes, size_t size) {
    struct bare_uart *uart = context;
    size_t taken = bare_ring_write(&uart->send, bytes, size);
    uart->starved = taken < size;
    board_uart_send((unsigned)(uart - bare_uart));
    return (int)taken;
}

static int receive(void *context, uint8_t *bytes, size_t size) {
    struct bare_uart *uart = context;
    uint32_t ends = uart->ends;
    size_t held = bare_ring_held(&uart->receive);
    if (size >= held) /* else there may be an end in what stays */
        uart->ends_taken = ends;
    return (int)bare_ring_read(&uart->receive, bytes, size);
}

struct link_pipe bare_uart_pipe(unsigned uart) {
    return (struct link_pipe){&bare_uart[uart], send, receive};
}

void bare_uart_leave(unsigned uart) {
    bare_uart[uart].unused = true;
}

uint32_t bare_uarts_overruns(void) {
    uint32_t sum = 0;
    for (unsigned i = 0; i < BARE_UARTS_MAX; i++)
        sum += bare_uart[i].unused ? 0 : bare_uart[i].overruns;
    return sum;
}

static bool all_sent(void) {
    for (unsigned i = 0; i <= board_facts.ports; i++)
        if (bare_ring_held(&bare_uart[i].send) > 0)
            return false;
    return true;
}

void bare_uarts_flush(uint64_t limit_us) {
    uint64_t until_us = board_now_us() + limit_us;
    while (!all_sent() && board_now_us() < until_us) {
        uint32_t before = board_lock();
        board_wait(FLUSH_LOOK_US);
        board_unlock(before);
    }
}
