/* Time is the processor's own counter.  A tick ends a sleep; the guard is a
 * second timer, whose fast interrupt nothing here keeps away: the board's
 * watchdog would restart it without telling who hung. */
#include "boards/bare/bare.h"
#include "registers.h"

enum { TICK_US = 10000, US = 1000000 };

/* Behind RASPI3B_LOCAL: the timers' interrupts of the first processor. */
enum { TIMERS = 0x40 / 4, TICK = 1 << 1, GUARD_FAST = 1 << 7 };

static struct {
    uint64_t begun;
    uint32_t guard_us;
} time;

static uint64_t counts(uint64_t us) {
    return us * raspi3b_hz() / US;
}

uint64_t board_now_us(void) {
    uint64_t hz = raspi3b_hz(), now = raspi3b_count() - time.begun;
    return now / hz * US + now % hz * US / hz;
}

void board_wait(uint64_t wait_us) {
    raspi3b_tick_at(raspi3b_count() +
                    counts(wait_us < TICK_US ? wait_us : TICK_US));
    raspi3b_sleep();
}

void board_guard(uint32_t period_us) {
    time.guard_us = period_us;
    if (period_us == 0)
        raspi3b_guard_off();
    board_feed();
}

void board_feed(void) {
    if (time.guard_us != 0)
        raspi3b_guard_at(raspi3b_count() + counts(time.guard_us));
}

/* Timers may still be due from before a restart, which an emulator sees only
 * where they are set anew. */
void raspi3b_time_start(void) {
    raspi3b_tick_at(UINT64_MAX);
    raspi3b_guard_at(UINT64_MAX);
    raspi3b_tick_off();
    raspi3b_guard_off();
    time.begun = raspi3b_count();
    raspi3b_at(RASPI3B_LOCAL)[TIMERS] = TICK | GUARD_FAST;
    raspi3b_guard_on();
}
