/* Registers of the PolarFire SoC (Microchip, PolarFire SoC MSS Technical
 * Reference Manual and register map), and what C cannot say (start.S). */
#ifndef BOARDS_ICICLE_REGISTERS_H
#define BOARDS_ICICLE_REGISTERS_H

#include <stdint.h>

#define ICICLE_CLINT UINT64_C(0x02000000)
#define ICICLE_PLIC UINT64_C(0x0C000000)
#define ICICLE_SYSTEM UINT64_C(0x20002000)
#define ICICLE_CARD UINT64_C(0x20008200)
#define ICICLE_ENVM UINT64_C(0x20220000)
#define ICICLE_DATA UINT64_C(0x80800000) /* as in board.ld */

/* What interrupts' handlers consist of: tests/firmware counts it. */
#define ICICLE_HANDLER __attribute__((section(".text.handlers")))

static inline volatile uint32_t *icicle_at(uint64_t address) {
    /* NOLINTNEXTLINE(performance-no-int-to-ptr): that is where it is */
    return (volatile uint32_t *)(uintptr_t)address;
}

/* Behind ICICLE_SYSTEM: bits of devices, a clock's and a reset's. */
enum { ICICLE_CLOCKS = 0x84 / 4, ICICLE_RESETS = 0x88 / 4 };

/* --- in start.S ----------------------------------------------------------- */

/* Sleeps until an interrupt is due. */
void icicle_sleep(void);

/* Jumps to an address as after a reset: in machine mode, no interrupt on, no
 * memory protected. */
_Noreturn void icicle_jump(uint64_t address);

/* --- what start.S calls, and reads ---------------------------------------- */

/* Settings of memory protection, as start.S puts them to the processor. */
enum { ICICLE_REGIONS = 6 };
struct icicle_protection {
    uint64_t settings; /* a byte each */
    uint64_t address[ICICLE_REGIONS];
};
extern struct icicle_protection icicle_protection;
void icicle_protect(void);

void icicle_interrupt(void);

/* Parts of it: of a UART whose state was just seen. */
struct bare_uart;
void icicle_receive(volatile uint8_t *device, struct bare_uart *uart,
                    uint32_t state, uint32_t interrupt);
void icicle_send(volatile uint8_t *device, struct bare_uart *uart,
                 uint32_t state, uint32_t interrupt);

/* The time at which the guard reports a hang. */
extern volatile uint64_t icicle_guard_due;

/* --- in what starts before main ------------------------------------------- */

void icicle_uarts_start(void);
void icicle_time_start(void);

#endif
