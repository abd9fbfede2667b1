/* A UART between its interrupts and a link: two rings.  The handler of a board
 * puts what comes and takes what goes; a link's pipe does the other half.  A
 * byte that finds no room is dropped and counted, as one that the UART itself
 * lost: the link repairs it.
 *
 * Memory: the struct, BARE_RECEIVE_BYTES and BARE_SEND_BYTES included.  Work:
 * constant a byte.
 *
 *     bare_uarts_init();
 *     board.pipes[0] = bare_uart_pipe(1);
 *     bare_uart_put(&bare_uart[1], byte);   // in the handler
 */
#ifndef BOARDS_BARE_UART_H
#define BOARDS_BARE_UART_H

#include "ring.h"
#include "transport/link.h"

enum {
    BARE_UARTS_MAX = 5,
    /* 355 ms of a wire at 115,200 baud, 44 ms at 921,600. */
    BARE_RECEIVE_BYTES = 4096,
    BARE_SEND_BYTES = 512,
    /* That a call of a handler moves, at most: what comes meanwhile, or can go,
     * calls it again, so that it is never long away from what it has
     * interrupted. */
    BARE_BYTES_A_CALL = 4
};

struct bare_uart {
    struct bare_ring receive, send;
    volatile uint32_t overruns; /* bytes that were lost, or times some were */
    volatile uint32_t ends;     /* zeros that came: each ends a frame */
    uint32_t ends_taken;        /* of those, before the link looked */
    bool starved; /* a link had more to send than there was room */
    bool unused;  /* no link reads it: noise on it wakes nobody */
    uint8_t received[BARE_RECEIVE_BYTES], sent[BARE_SEND_BYTES];
};

extern struct bare_uart bare_uart[BARE_UARTS_MAX];

void bare_uarts_init(void);

/* For a board's handlers. */
BARE_INLINE void bare_uart_put(struct bare_uart *uart, uint8_t byte) {
    if (!bare_ring_put(&uart->receive, byte)) {
        uart->overruns++;
    }
    uart->ends += byte == 0;
}

static inline bool bare_uart_heard(const struct bare_uart *uart) {
    return bare_ring_held(&uart->receive) > 0;
}

/* Whether its link has something to do: a frame may be whole, so many bytes
 * came that they want room, or those that went have made some. */
bool bare_uart_ready(const struct bare_uart *uart);

struct link_pipe bare_uart_pipe(unsigned uart);

/* It has no link any more: what comes by it is nobody's, and not counted. */
void bare_uart_leave(unsigned uart);

/* Sum of the overruns of all that have a link. */
uint32_t bare_uarts_overruns(void);

/* Waits until all has left that links have put, at most limit_us. */
void bare_uarts_flush(uint64_t limit_us);

#endif
