/* Five MMUARTs: 16550s, with 16 bytes of their own in either direction.  The
 * interrupt for sending comes as long as nothing is left to send: it is on
 * while bytes wait. */
#include "boards/bare/bare.h"
#include "registers.h"

/* Bytes behind a base. */
enum {
    DATA = 0x00,
    IER = 0x04,
    FCR = 0x08,
    LCR = 0x0C,
    LSR = 0x14,
    DIVISOR = 0x00,
    HIGH = 0x04
};
enum { CAME = 1 << 0, OVERRUN = 1 << 1, ROOM = 1 << 5 };
enum { RECEIVES = 1 << 0, SENDS = 1 << 1 };
enum { BUFFERED = 7 /* and empty; an interrupt at each byte */ };
enum { EIGHT_BITS = 3, DIVIDES = 0x83 };
enum { UART_HZ = 150000000, CONSOLE_US = 100000 };

/* Behind ICICLE_PLIC: of hart 1 in supervisor mode. */
enum {
    PRIORITY = 0,
    ENABLES = 0x2100 / 4,
    THRESHOLD = 0x202000 / 4,
    CLAIM = 0x202004 / 4,
    UART_0 = 90
};
enum { DEVICES = 0x1F << 5 }; /* of ICICLE_CLOCKS and ICICLE_RESETS */

typedef volatile uint8_t registers;

static const struct {
    registers *device;
    struct bare_uart *uart;
} uarts[BARE_UARTS_MAX] = {{(registers *)0x20000000, &bare_uart[0]},
                           {(registers *)0x20100000, &bare_uart[1]},
                           {(registers *)0x20102000, &bare_uart[2]},
                           {(registers *)0x20104000, &bare_uart[3]},
                           {(registers *)0x20106000, &bare_uart[4]}};

/* Reading the state clears the mark of an overrun, so each read counts it. */
BARE_INLINE void count(struct bare_uart *uart, uint32_t states) {
    uart->overruns += states / OVERRUN % 2;
}

BARE_INLINE void send(registers *device, struct bare_uart *uart,
                      uint32_t state) {
    uint8_t byte;
    count(uart, state);
    if ((state & ROOM) != 0) /* for 16 */
        for (int n = 0;
             n < BARE_BYTES_A_CALL && bare_ring_take(&uart->send, &byte); n++)
            device[DATA] = byte;
    device[IER] = bare_ring_held(&uart->send) > 0 ? RECEIVES | SENDS : RECEIVES;
}

BARE_INLINE void complete(uint32_t interrupt) {
    icicle_at(ICICLE_PLIC)[CLAIM] = interrupt;
}

ICICLE_HANDLER void icicle_send(registers *device, struct bare_uart *uart,
                                uint32_t state, uint32_t interrupt) {
    send(device, uart, state);
    complete(interrupt);
}

ICICLE_HANDLER void icicle_receive(registers *device, struct bare_uart *uart,
                                   uint32_t state, uint32_t interrupt) {
    uint32_t states = state;
    for (int n = 0; n < BARE_BYTES_A_CALL && (state & CAME) != 0; n++) {
        bare_uart_put(uart, device[DATA]);
        state = device[LSR];
        states |= state;
    }
    count(uart, states);
    complete(interrupt);
}

/* One device a call, in one direction: what waits calls it again. */
ICICLE_HANDLER void icicle_interrupt(void) {
    uint32_t interrupt = icicle_at(ICICLE_PLIC)[CLAIM];
    unsigned i = interrupt - UART_0;
    if (i < BARE_UARTS_MAX) {
        registers *device = uarts[i].device;
        uint32_t state = device[LSR];
        if ((state & CAME) != 0)
            icicle_receive(device, uarts[i].uart, state, interrupt);
        else
            icicle_send(device, uarts[i].uart, state, interrupt);
    } else {
        complete(interrupt);
    }
}

void board_uart_send(unsigned i) {
    uint32_t before = board_lock();
    registers *device = uarts[i].device;
    send(device, uarts[i].uart, device[LSR]);
    board_unlock(before);
}

bool board_console_put(uint8_t byte) {
    uint64_t begun_us = board_now_us();
    while ((uarts[0].device[LSR] & ROOM) == 0)
        if (board_now_us() - begun_us > CONSOLE_US)
            return false;
    uarts[0].device[DATA] = byte;
    return true;
}

static void start(unsigned i) {
    registers *device = uarts[i].device;
    volatile uint32_t *plic = icicle_at(ICICLE_PLIC);
    unsigned number = UART_0 + i;
    uint32_t divisor = (UART_HZ / 16 + board_facts.baud / 2) / board_facts.baud;
    device[IER] = 0;
    device[LCR] = DIVIDES;
    device[HIGH] = (uint8_t)(divisor >> 8);
    device[DIVISOR] = (uint8_t)divisor;
    device[LCR] = EIGHT_BITS;
    device[FCR] = BUFFERED;
    (void)device[LSR];
    plic[PRIORITY + number] = 1;
    plic[ENABLES + number / 32] |= UINT32_C(1) << number % 32;
    /* A handler of the program before may not have come to its end. */
    plic[CLAIM] = number;
    device[IER] = RECEIVES;
}

void icicle_uarts_start(void) {
    volatile uint32_t *system = icicle_at(ICICLE_SYSTEM);
    system[ICICLE_CLOCKS] |= DEVICES;
    system[ICICLE_RESETS] &= ~(uint32_t)DEVICES;
    icicle_at(ICICLE_PLIC)[THRESHOLD] = 0;
    for (unsigned i = 0; i <= board_facts.ports; i++)
        start(i);
}

void board_interrupt(void) {
    uarts[0].device[IER] = RECEIVES | SENDS;
}
