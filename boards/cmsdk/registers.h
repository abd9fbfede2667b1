/* Registers of Arm's Cortex-M System Design Kit, as on the MPS2 boards, and of
 * the Cortex-M processor itself. */
#ifndef BOARDS_CMSDK_REGISTERS_H
#define BOARDS_CMSDK_REGISTERS_H

#include <stdint.h>

#define CMSDK_PORT_0 UINT32_C(0x40010000) /* of pins */
#define CMSDK_PORT_1 UINT32_C(0x40011000)
#define CMSDK_TIMER UINT32_C(0x40028018) /* counts the clock, 32 bits */
#define CMSDK_WATCHDOG UINT32_C(0x40008000)
#define CORTEX_SYSTICK UINT32_C(0xE000E010)
#define CORTEX_NVIC UINT32_C(0xE000E100) /* enables interrupts 0 .. 31 */
#define CORTEX_SCB UINT32_C(0xE000ED00)
#define CORTEX_MPU UINT32_C(0xE000ED90)

enum { CMSDK_HZ = 25000000 };

/* What interrupts' handlers consist of: tests/firmware counts it. */
#define CMSDK_HANDLER __attribute__((section(".text.handlers")))

/* The register at an address. */
static inline volatile uint32_t *cmsdk_at(uint32_t address) {
    /* NOLINTNEXTLINE(performance-no-int-to-ptr) */
    return (volatile uint32_t *)(uintptr_t)address;
}

/* In start.S: all memory accesses before are done, and instructions after are
 * fetched anew; sleep until an interrupt is due. */
void cortex_barrier(void);
void cortex_wait(void);

/* In what starts before main. */
void cmsdk_mpu_start(void);
void cmsdk_time_start(void);
void cmsdk_uarts_start(void);

#endif
