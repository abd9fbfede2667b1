/* A node without an operating system: what its board must give, and what all
 * such boards share (this folder).  A board's start-up code sets up stacks,
 * .data and .bss (start.ld), and calls bare_main with interrupts off. */
#ifndef BOARDS_BARE_BARE_H
#define BOARDS_BARE_BARE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "node/loader/flash.h"
#include "uart.h"

/* Of the linker script, which asserts it. */
enum {
    BARE_STACK_BYTES = 49152,
    /* Memory that a restart leaves as it is. */
    BARE_REASON_BYTES = 224,
    BARE_BUDGET_BYTES = 32,
    BARE_HANDOVER_BYTES = 256
};

/* --- what a board gives --------------------------------------------------- */

struct board_facts {
    const char *name; /* of its folder */
    /* UART 0 is the console and the host's wire, UARTs 1 .. ports are those of
     * dimensions 0 .. ports - 1; at most BARE_UARTS_MAX - 1. */
    unsigned ports;
    uint32_t baud;
    size_t data_bytes; /* of its data memory: .noinit included, at most 4 MiB */
    const struct loader_flash *flash; /* NULL: it has none */
    /* Where its loader copies an image to, and runs it; 0: it has no loader. */
    uint32_t image_at, image_bytes;
};

extern const struct board_facts board_facts;

/* Begins time, the guard, and the UARTs with their interrupts. */
void board_start(void);

/* Microseconds since board_start, never going back.  In handlers too. */
uint64_t board_now_us(void);

/* Keeps interrupts away; gives back how it was. */
uint32_t board_lock(void);
void board_unlock(uint32_t before);

/* Under a lock: sleeps until an interrupt is due, or wait_us are over, or
 * before.  The interrupt is taken once the lock is given back. */
void board_wait(uint64_t wait_us);

/* Bytes were put to bare_uart[uart].send: sees to it that they go, now or when
 * those before them are gone. */
void board_uart_send(unsigned uart);

/* Sends a byte of the console, by waiting until the UART takes it, at most
 * 100 ms.  Works when nothing else does.  False: it was not taken. */
bool board_console_put(uint8_t byte);

/* Restarts the board unless board_feed is called again within so long, telling
 * who hung.  0: the guard is off. */
void board_guard(uint32_t period_us);
void board_feed(void);

/* Everything begins anew, as after power on; .noinit stays.  What the UARTs
 * have been given goes first, as far as they still can. */
_Noreturn void board_restart(void);

/* Of a board that has a loader: runs the image that lies at this address, as
 * after power on, but that the guard goes on. */
_Noreturn void board_launch(uint32_t address);

/* Makes an interrupt due, whose handler returns.  For tests: a program that
 * does not call it is linked without it. */
void board_interrupt(void);

/* --- what all share ------------------------------------------------------- */

/* The node program, or the loader, from start to restart. */
_Noreturn void bare_main(void);

#endif
