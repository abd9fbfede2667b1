/* What a board does when its program does wrong: a main of its own, linked with
 * a board's start-up code.  Each letter that comes over the console is an order
 * (tests/boards/trial). */
#include "boards/bare/bare.h"
#include "node/loader/slots.h"
#include "boards/bare/console.h"
#include "boards/bare/fault_text.h"
#include "boards/bare/handover.h"
#include "boards/bare/sections.h"
#include "boards/bare/stack.h"

/* clock: more than an emulator is held up on a busy machine. */
enum { GUARD_US = 3000000, SILENCE_US = 1000000, DEEP = 10000 };

static void say(const char *what, const char *name, uint32_t number,
                const char *then) {
    char room[300];
    struct cube_text text = cube_text_in(room, sizeof room);
    cube_text_put(&text, what);
    cube_text_put(&text, name);
    cube_text_number(&text, number);
    cube_text_put(&text, then);
    cube_text_put(&text, "\r\n");
    bare_console_begin();
    bare_console_put(room);
    bare_console_end();
}

static uint8_t next(void) {
    uint8_t byte = 0;
    while (!bare_ring_take(&bare_uart[0].receive, &byte)) {
        uint32_t before = board_lock();
        if (!bare_uart_heard(&bare_uart[0]))
            board_wait(10000);
        board_unlock(before);
        board_feed();
    }
    return byte;
}

/* What it puts on the stack must stay there while it calls itself. */
static uint32_t sink(const volatile uint32_t *deep) {
    volatile uint32_t words[64] = {deep[0] + 1};
    return deep[0] == 0 ? 0 : sink(words) + words[1];
}

static __attribute__((noinline)) uint32_t use(void) {
    volatile uint8_t bytes[DEEP];
    bytes[0] = 1;
    return bytes[0];
}

/* Volatile, so that a compiler takes it for a loop that may end. */
static volatile bool hanging = true;
static __attribute__((noinline)) void hang(void) {
    while (hanging) {
    }
}

/* Hangs so that an interrupt comes at nearly each step. */
static __attribute__((noinline)) void hang_interrupted(void) {
    while (hanging)
        board_interrupt();
}

/* Takes nothing that comes until nothing more does.  clock: for a second. */
static void be_deaf(void) {
    uint32_t seen = 0;
    uint64_t since_us = board_now_us();
    while (board_now_us() - since_us < SILENCE_US) {
        uint32_t now =
            bare_ring_held(&bare_uart[0].receive) + bare_uart[0].overruns;
        board_feed();
        if (now != seen) {
            seen = now;
            since_us = board_now_us(); /* clock: anew */
        }
    }
    while (bare_uart_heard(&bare_uart[0]))
        (void)next();
    /* Last: the next order follows at once. */
    say("overruns ", "", bare_uarts_overruns(), "");
}

static uint8_t *data_end(void) {
    return (uint8_t *)bare_node_stack + board_facts.data_bytes;
}

static void obey(uint8_t order) {
    static const uint32_t one[] = {1};
    if (order == 'e') { /* the last byte is there, */
        say("last byte ", "", *(volatile uint8_t *)(data_end() - 1) & 0, "");
    } else if (order == 'b') { /* and the next is not */
        say("read ", "", *(volatile uint8_t *)data_end(), "");
    } else if (order == 'o') {
        say("sunk ", "", sink(one), "");
    } else if (order == 'h') {
        hang();
    } else if (order == 'l') {
        (void)board_lock();
        hang();
    } else if (order == 'i') {
        hang_interrupted();
    } else if (order == 'u') {
        __builtin_trap();
    } else if (order == 'c') {
        *(volatile uint8_t *)bare_code = 1;
    } else if (order == 's') {
        (void)use();
        say("stack ", "", bare_stack_high_water(), "");
    } else if (order == 'd') {
        be_deaf();
    } else if (order == 'q') {
        bare_reason_keep(BARE_RUN_OVER, NULL);
        board_restart();
    } else if (order == 'x') {
        board_restart();
    }
}

_Noreturn void bare_main(void) {
    uint32_t boot = 0;
    bare_uarts_init();
    board_start();
    board_guard(GUARD_US);
    board_unlock(0);
    struct bare_reason reason = bare_reason_take();
    if (board_facts.flash != NULL)
        (void)loader_boots_next(board_facts.flash, &boot);
    say(bare_reason_name(reason.kind), ", boot ", boot, "");
    for (;;) {
        say("ready, faults ", "", reason.faults, reason.text);
        obey(next());
    }
}
