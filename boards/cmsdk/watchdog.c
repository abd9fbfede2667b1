/* The guard: it calls the NMI first, which tells who hung, and resets the board
 * if that does not. */
#include "boards/bare/bare.h"
#include "registers.h"

enum { LOAD, VALUE, CONTROL, INTCLR, LOCK = 0xC00 / 4 };
enum { INTERRUPT_AND_RESET = 3 };

#define UNLOCK UINT32_C(0x1ACCE551)

void board_guard(uint32_t period_us) {
    volatile uint32_t *watchdog = cmsdk_at(CMSDK_WATCHDOG);
    watchdog[LOCK] = UNLOCK;
    watchdog[LOAD] = period_us * (CMSDK_HZ / 1000000);
    watchdog[CONTROL] = period_us == 0 ? 0 : INTERRUPT_AND_RESET;
    watchdog[LOCK] = 0;
}

void board_feed(void) {
    volatile uint32_t *watchdog = cmsdk_at(CMSDK_WATCHDOG);
    watchdog[LOCK] = UNLOCK;
    watchdog[INTCLR] = 1;
    watchdog[LOCK] = 0;
}
