/* Time: a counter of 32 bits, which is looked at often enough that it cannot
 * pass unseen.  Ticks are not counted: some are lost where a processor is
 * emulated. */
#include "boards/bare/bare.h"
#include "registers.h"

enum { HZ_A_US = CMSDK_HZ / 1000000, TICK_US = 10000 };

enum { SYSTICK_ON = 7 /* its interrupt, the processor's clock */ };

static struct {
    uint32_t begun; /* the counter is not the processor's: it may go on when
                       that is reset */
    uint32_t last, high;
} seen;

/* With interrupts away. */
BARE_INLINE uint64_t look(void) {
    uint32_t now = *cmsdk_at(CMSDK_TIMER);
    seen.high += now < seen.last;
    seen.last = now;
    return (uint64_t)seen.high << 32 | now;
}

/* Each time that nothing else has woken the program. */
CMSDK_HANDLER void cmsdk_tick(void);
CMSDK_HANDLER void cmsdk_tick(void) {
    (void)look();
}

uint64_t board_now_us(void) {
    uint32_t before = board_lock();
    uint64_t now = look();
    board_unlock(before);
    return (now - seen.begun) / HZ_A_US;
}

static void tick_in(uint32_t us) {
    volatile uint32_t *systick = cmsdk_at(CORTEX_SYSTICK);
    systick[1] = us * HZ_A_US - 1;
    systick[2] = 0;
    systick[0] = SYSTICK_ON;
}

/* A tick comes at the latest after TICK_US, always: an emulator may need it to
 * see that a byte has come.  The timer begins anew by itself, so a short wait
 * is not left there: ticks a microsecond apart would take all of the time. */
void board_wait(uint64_t wait_us) {
    tick_in(wait_us == 0 ? 1 : wait_us < TICK_US ? (uint32_t)wait_us : TICK_US);
    cortex_wait();
    tick_in(TICK_US);
}

void cmsdk_time_start(void) {
    seen.begun = seen.last = *cmsdk_at(CMSDK_TIMER);
    tick_in(TICK_US);
}
