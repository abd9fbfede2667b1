/* The UARTs, each with one byte of its own in either direction. */
#include "boards/bare/bare.h"
#include "registers.h"

enum { DATA, STATE, CTRL, INT, BAUDDIV }; /* words behind the base */
enum { TXFULL = 1, RXFULL = 2, RXOVER = 8 };
enum { INT_SEND = 1, INT_RECEIVE = 2 };
enum { ALL_ON = 15 /* both directions and their interrupts, at once */ };

enum { CONSOLE_US = 100000 };

/* Pins that belong to a UART only where they are told so, words behind the base
 * of a port: the XBee socket is UART 1, shield 0 UART 3, shield 1 UART 4. */
enum { FUNCTION_SET = 0x18 / 4 };
enum { SHIELD_0 = 1 << 0 | 1 << 4 };                           /* of port 0 */
enum { XBEE = 1 << 7 | 1 << 8, SHIELD_1 = 1 << 10 | 1 << 14 }; /* of port 1 */

static const uint32_t base[BARE_UARTS_MAX] = {
    0x40004000, 0x40005000, 0x40006000, 0x40007000, 0x40009000};
static const uint8_t interrupt[BARE_UARTS_MAX] = {0, 2, 4, 18, 20};

/* The mark is taken away before the bytes are, so that one which comes then
 * sets it again. */
BARE_INLINE void receive(unsigned i) {
    volatile uint32_t *uart = cmsdk_at(base[i]);
    uart[INT] = INT_RECEIVE;
    for (int n = 0; n < BARE_BYTES_A_CALL && (uart[STATE] & RXFULL) != 0; n++)
        bare_uart_put(&bare_uart[i], (uint8_t)uart[DATA]);
    if ((uart[STATE] & RXOVER) != 0) {
        uart[STATE] = RXOVER;
        bare_uart[i].overruns++;
    }
}

BARE_INLINE void send(unsigned i) {
    volatile uint32_t *uart = cmsdk_at(base[i]);
    uint8_t byte;
    uart[INT] = INT_SEND;
    for (int n = 0; n < BARE_BYTES_A_CALL && (uart[STATE] & TXFULL) == 0 &&
                    bare_ring_take(&bare_uart[i].send, &byte);
         n++)
        uart[DATA] = byte;
}

#define HANDLERS(i)                                                            \
    CMSDK_HANDLER void cmsdk_uart##i##_receive(void);                          \
    CMSDK_HANDLER void cmsdk_uart##i##_receive(void) {                         \
        receive(i);                                                            \
    }                                                                          \
    CMSDK_HANDLER void cmsdk_uart##i##_send(void);                             \
    CMSDK_HANDLER void cmsdk_uart##i##_send(void) {                            \
        send(i);                                                               \
    }

HANDLERS(0)
HANDLERS(1)
HANDLERS(2)
HANDLERS(3)
HANDLERS(4)

void board_uart_send(unsigned i) {
    uint32_t before = board_lock();
    send(i);
    board_unlock(before);
}

bool board_console_put(uint8_t byte) {
    volatile uint32_t *uart = cmsdk_at(base[0]);
    uint64_t begun_us = board_now_us();
    while ((uart[STATE] & TXFULL) != 0)
        if (board_now_us() - begun_us > CONSOLE_US)
            return false;
    uart[DATA] = byte;
    return true;
}

/* A byte that came before the interrupt was on would never call its handler:
 * it is taken by the first call of all. */
void cmsdk_uarts_start(void) {
    cmsdk_at(CMSDK_PORT_0)[FUNCTION_SET] = SHIELD_0;
    cmsdk_at(CMSDK_PORT_1)[FUNCTION_SET] = XBEE | SHIELD_1;
    for (unsigned i = 0; i <= board_facts.ports; i++) {
        volatile uint32_t *uart = cmsdk_at(base[i]);
        uart[BAUDDIV] = (CMSDK_HZ + board_facts.baud / 2) / board_facts.baud;
        uart[CTRL] = ALL_ON;
        receive(i);
        *cmsdk_at(CORTEX_NVIC) = UINT32_C(3) << interrupt[i];
    }
}

enum { PENDING = 0x100 }; /* behind CORTEX_NVIC */

void board_interrupt(void) {
    *cmsdk_at(CORTEX_NVIC + PENDING) = UINT32_C(1) << interrupt[0];
}
