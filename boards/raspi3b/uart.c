/* Two UARTs of different kinds: the PL011, with 16 bytes of its own in either
 * direction, and the mini UART, with 8. */
#include "boards/bare/bare.h"
#include "registers.h"

enum { CONSOLE_US = 100000 };

/* --- the PL011: words behind RASPI3B_PL011 -------------------------------- */

enum {
    DR = 0,
    FR = 0x18 / 4,
    IBRD = 0x24 / 4,
    FBRD = 0x28 / 4,
    LCRH = 0x2C / 4,
    CR = 0x30 / 4,
    IFLS = 0x34 / 4,
    IMSC = 0x38 / 4,
    ICR = 0x44 / 4
};
enum { FR_NOTHING_CAME = 1 << 4, FR_NO_ROOM = 1 << 5 };
enum { DR_OVERRUN = 1 << 11 };
enum {
    INT_RECEIVE = 1 << 4,
    INT_SEND = 1 << 5,
    INT_LATE = 1 << 6,
    INT_ALL = 0x7FF
};
enum { EIGHT_BITS_BUFFERED = 0x70, ON_BOTH_WAYS = 0x301 };
enum { PL011_HZ = 48000000 };

/* --- the mini UART: words behind RASPI3B_AUX ------------------------------ */

enum {
    ENABLES = 0x04 / 4,
    IO = 0x40 / 4,
    IER = 0x44 / 4,
    IIR = 0x48 / 4,
    LCR = 0x4C / 4,
    LSR = 0x54 / 4,
    CNTL = 0x60 / 4,
    BAUD = 0x68 / 4
};
enum { LSR_CAME = 1, LSR_OVERRUN = 2, LSR_ROOM = 1 << 5 };
/* Bits 2 and 3 must be set for any interrupt to come (the manual's errata). */
enum { IER_RECEIVE = 1 | 3 << 2, IER_SEND = 2 };
enum { EIGHT_BITS = 3, CLEAR_BOTH = 0xC6, BOTH_WAYS = 3 };
enum { CORE_HZ = 250000000 }; /* enable_uart=1 in config.txt holds it there */

/* Bytes that come leave the interrupt when they are taken; it is never cleared,
 * as that would hide those that are left. */
RASPI3B_HANDLER void raspi3b_pl011_receive(void) {
    volatile uint32_t *uart = raspi3b_at(RASPI3B_PL011);
    for (int n = 0; n < BARE_BYTES_A_CALL && (uart[FR] & FR_NOTHING_CAME) == 0;
         n++) {
        uint32_t got = uart[DR];
        bare_uart_put(&bare_uart[0], (uint8_t)got);
        bare_uart[0].overruns += (got & DR_OVERRUN) != 0;
    }
}

/* The interrupt comes when no more than 2 bytes are left; as long as there are
 * others to send, 4 are put at least, so that it comes again. */
RASPI3B_HANDLER void raspi3b_pl011_send(void) {
    volatile uint32_t *uart = raspi3b_at(RASPI3B_PL011);
    uint8_t byte;
    uart[ICR] = INT_SEND;
    for (int n = 0; n < BARE_BYTES_A_CALL && (uart[FR] & FR_NO_ROOM) == 0 &&
                    bare_ring_take(&bare_uart[0].send, &byte);
         n++)
        uart[DR] = byte;
}

RASPI3B_HANDLER void raspi3b_mini_receive(void) {
    volatile uint32_t *uart = raspi3b_at(RASPI3B_AUX);
    uint32_t state = LSR_CAME;
    for (int n = 0; n < BARE_BYTES_A_CALL && (state & LSR_CAME) != 0; n++) {
        bare_uart_put(&bare_uart[1], (uint8_t)uart[IO]);
        state = uart[LSR];
        bare_uart[1].overruns += (state & LSR_OVERRUN) != 0;
    }
}

/* Its interrupt comes as long as it has nothing to send: so it is asked for
 * while there is. */
RASPI3B_HANDLER void raspi3b_mini_send(void) {
    volatile uint32_t *uart = raspi3b_at(RASPI3B_AUX);
    uint8_t byte;
    for (int n = 0; n < BARE_BYTES_A_CALL && (uart[LSR] & LSR_ROOM) != 0 &&
                    bare_ring_take(&bare_uart[1].send, &byte);
         n++)
        uart[IO] = byte;
    uart[IER] = bare_ring_held(&bare_uart[1].send) > 0 ? IER_RECEIVE | IER_SEND
                                                       : IER_RECEIVE;
}

/* One way a call: what can go calls again when nothing more comes. */
RASPI3B_HANDLER void raspi3b_pl011(void) {
    if ((raspi3b_at(RASPI3B_PL011)[FR] & FR_NOTHING_CAME) == 0)
        raspi3b_pl011_receive();
    else
        raspi3b_pl011_send();
}

/* The overrun's mark goes with the first look at the state. */
RASPI3B_HANDLER void raspi3b_mini(void) {
    uint32_t state = raspi3b_at(RASPI3B_AUX)[LSR];
    bare_uart[1].overruns += (state & LSR_OVERRUN) != 0;
    if ((state & LSR_CAME) != 0)
        raspi3b_mini_receive();
    else
        raspi3b_mini_send();
}

void board_uart_send(unsigned uart) {
    uint32_t before = board_lock();
    if (uart == 0)
        raspi3b_pl011_send();
    else
        raspi3b_mini_send();
    board_unlock(before);
}

bool board_console_put(uint8_t byte) {
    volatile uint32_t *uart = raspi3b_at(RASPI3B_PL011);
    uint64_t begun_us = board_now_us();
    while ((uart[FR] & FR_NO_ROOM) != 0)
        if (board_now_us() - begun_us > CONSOLE_US)
            return false;
    uart[DR] = byte;
    return true;
}

/* Inputs that lead nowhere are held high, as a silent wire is. */
static void pins(void) {
    raspi3b_pin(14, RASPI3B_FUNCTION_0);
    raspi3b_pin(15, RASPI3B_FUNCTION_0);
    raspi3b_pin(32, RASPI3B_FUNCTION_5);
    raspi3b_pin(33, RASPI3B_FUNCTION_5);
    raspi3b_pull_up(UINT64_C(1) << 15 | UINT64_C(1) << 33);
}

/* What has called for an interrupt and is gone with the change of the buffers
 * would call for ever; what came behind it is taken, as it may not call. */
static void pl011_start(void) {
    volatile uint32_t *uart = raspi3b_at(RASPI3B_PL011);
    /* In 64ths, as the UART divides. */
    uint32_t divisor = (4 * PL011_HZ + board_facts.baud / 2) / board_facts.baud;
    uart[CR] = 0;
    uart[IBRD] = divisor / 64;
    uart[FBRD] = divisor % 64;
    uart[LCRH] = EIGHT_BITS_BUFFERED;
    uart[IFLS] = 0; /* at 2 bytes either way */
    uart[ICR] = INT_ALL;
    while ((uart[FR] & FR_NOTHING_CAME) == 0)
        raspi3b_pl011_receive();
    uart[IMSC] = INT_RECEIVE | INT_SEND | INT_LATE;
    uart[CR] = ON_BOTH_WAYS;
}

static void mini_start(void) {
    volatile uint32_t *uart = raspi3b_at(RASPI3B_AUX);
    uart[ENABLES] |= 1;
    uart[CNTL] = 0;
    uart[IER] = 0;
    uart[LCR] = EIGHT_BITS;
    uart[IIR] = CLEAR_BOTH;
    uart[BAUD] = (CORE_HZ + 4 * board_facts.baud) / (8 * board_facts.baud) - 1;
    uart[CNTL] = BOTH_WAYS;
    uart[IER] = IER_RECEIVE;
}

enum { ENABLE_1 = 4, ENABLE_2 = 5 }; /* words behind RASPI3B_INTERRUPTS */

void raspi3b_uarts_start(void) {
    pins();
    pl011_start();
    mini_start();
    raspi3b_at(RASPI3B_INTERRUPTS)[ENABLE_1] = UINT32_C(1) << 29;
    raspi3b_at(RASPI3B_INTERRUPTS)[ENABLE_2] = UINT32_C(1) << 25;
}
