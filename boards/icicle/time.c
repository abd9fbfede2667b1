/* Time is the processors' common counter, of microseconds.  Its interrupt goes
 * to machine mode (start.S), whatever the program keeps away: it ends a sleep,
 * and it is the guard, which the program only sets the time of. */
#include "boards/bare/bare.h"
#include "registers.h"

enum { TICK_US = 10000 };

/* Behind ICICLE_CLINT: of hart 1, and of all. */
enum { MTIMECMP = 0x4008, MTIME = 0xBFF8 };

volatile uint64_t icicle_guard_due = UINT64_MAX;

static struct {
    uint64_t begun;
    uint32_t guard_us;
} time;

static volatile uint64_t *timer(uint64_t offset) {
    return (volatile uint64_t *)(volatile void *)icicle_at(ICICLE_CLINT +
                                                           offset);
}

uint64_t board_now_us(void) {
    return *timer(MTIME) - time.begun;
}

/* The tick that ends it begins anew by itself. */
void board_wait(uint64_t wait_us) {
    *timer(MTIMECMP) = *timer(MTIME) + (wait_us < TICK_US ? wait_us : TICK_US);
    icicle_sleep();
}

void board_guard(uint32_t period_us) {
    time.guard_us = period_us;
    if (period_us == 0)
        icicle_guard_due = UINT64_MAX;
    board_feed();
}

void board_feed(void) {
    if (time.guard_us != 0)
        icicle_guard_due = *timer(MTIME) + time.guard_us;
}

void icicle_time_start(void) {
    time.begun = *timer(MTIME);
    *timer(MTIMECMP) = time.begun + TICK_US;
}
