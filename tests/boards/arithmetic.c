/* A bare board's main that answers over UART 0 as native.c does (talk.h). */
#include "boards/bare/bare.h"
#include "tests/arithmetic/talk.h"

enum { ASKED_MAX = 120, GUARD_US = 60000000, WAIT_US = 10000 };

static void put(void *context, const char *line) {
    (void)context;
    board_feed();
    while (*line != 0)
        (void)board_console_put((uint8_t)*line++);
    (void)board_console_put('\r');
    (void)board_console_put('\n');
}

static uint8_t next(struct bare_ring *ring) {
    uint8_t byte;
    while (!bare_ring_take(ring, &byte)) {
        uint32_t before = board_lock();
        if (bare_ring_held(ring) == 0)
            board_wait(WAIT_US);
        board_unlock(before);
        board_feed();
    }
    return byte;
}

_Noreturn void bare_main(void) {
    char asked[ASKED_MAX + 1];
    bare_uarts_init();
    board_start();
    board_guard(GUARD_US);
    board_unlock(0);
    for (;;) {
        unsigned length = 0;
        uint8_t byte;
        while ((byte = next(&bare_uart[0].receive)) != '\n')
            if (length < ASKED_MAX && byte >= ' ')
                asked[length++] = (char)byte;
        asked[length] = 0;
        talk_answer(asked, put, NULL);
    }
}
