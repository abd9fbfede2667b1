/* Registers of the Raspberry Pi 3 (Broadcom, BCM2835 ARM Peripherals, and
 * QA7 for those of the processors), and what C cannot say (start.S). */
#ifndef BOARDS_RASPI3B_REGISTERS_H
#define BOARDS_RASPI3B_REGISTERS_H

#include <stdint.h>

#define RASPI3B_INTERRUPTS UINT32_C(0x3F00B200)
#define RASPI3B_PM UINT32_C(0x3F100000)
#define RASPI3B_GPIO UINT32_C(0x3F200000)
#define RASPI3B_PL011 UINT32_C(0x3F201000)
#define RASPI3B_AUX UINT32_C(0x3F215000)
#define RASPI3B_CARD UINT32_C(0x3F300000)
#define RASPI3B_LOCAL UINT32_C(0x40000000)

/* What interrupts' handlers consist of: tests/firmware counts it. */
#define RASPI3B_HANDLER __attribute__((section(".text.handlers")))

static inline volatile uint32_t *raspi3b_at(uint32_t address) {
    /* NOLINTNEXTLINE(performance-no-int-to-ptr): that is where it is */
    return (volatile uint32_t *)(uintptr_t)address;
}

/* --- in start.S ----------------------------------------------------------- */

/* The timers' counter, and its beats a second. */
uint64_t raspi3b_count(void);
uint64_t raspi3b_hz(void);

/* An interrupt, and the guard's fast one, once the count is reached; those of
 * before are taken back. */
void raspi3b_tick_at(uint64_t count);
void raspi3b_guard_at(uint64_t count);
void raspi3b_tick_off(void);
void raspi3b_guard_off(void);

/* Sleeps until an interrupt is due. */
void raspi3b_sleep(void);

/* All memory accesses before are done. */
void raspi3b_barrier(void);

/* Lets the guard's interrupt through, for good. */
void raspi3b_guard_on(void);

/* --- what start.S calls --------------------------------------------------- */

void raspi3b_tables(void);
void raspi3b_interrupt(void);

/* --- in what starts before main ------------------------------------------- */

void raspi3b_uarts_start(void);
void raspi3b_time_start(void);

/* --- the pins ------------------------------------------------------------- */

enum { RASPI3B_FUNCTION_0 = 4, RASPI3B_FUNCTION_3 = 7, RASPI3B_FUNCTION_5 = 2 };
void raspi3b_pin(unsigned number, uint32_t function);
void raspi3b_pull_up(uint64_t pins); /* a bit each */

/* --- handlers ------------------------------------------------------------- */

void raspi3b_pl011(void);
void raspi3b_pl011_receive(void);
void raspi3b_pl011_send(void);
void raspi3b_mini(void);
void raspi3b_mini_receive(void);
void raspi3b_mini_send(void);

#endif
