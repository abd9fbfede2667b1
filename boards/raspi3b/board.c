/* Raspberry Pi 3: UART 0 is the PL011 (GPIO 14, 15), UART 1, which is dimension
 * 0, the mini UART (GPIO 32, 33).  Its flash is a partition of its card. */
#include "boards/bare/bare.h"
#include "boards/sdhci/sdhci.h"
#include "facts.h"
#include "registers.h"

const struct board_facts board_facts = {.name = BOARD_NAME,
                                        .ports = BOARD_UARTS - 1,
                                        .baud = BOARD_BAUD,
                                        .data_bytes = 4u << 20,
                                        .flash = &sdhci_flash,
                                        .image_at = 2u << 20,
                                        .image_bytes = 2u << 20};

enum { PENDING_1 = 1, PENDING_2 = 2 }; /* words behind RASPI3B_INTERRUPTS */
enum { AUX_PENDING = 1 << 29, PL011_PENDING = 1 << 25 };

enum { SOURCE = 0x60 / 4, TICK_DUE = 1 << 1 }; /* behind RASPI3B_LOCAL */

/* One device a call: another that waits calls it again. */
RASPI3B_HANDLER void raspi3b_interrupt(void) {
    volatile uint32_t *pending = raspi3b_at(RASPI3B_INTERRUPTS);
    if ((raspi3b_at(RASPI3B_LOCAL)[SOURCE] & TICK_DUE) != 0)
        raspi3b_tick_off();
    else if ((pending[PENDING_2] & PL011_PENDING) != 0)
        raspi3b_pl011();
    else if ((pending[PENDING_1] & AUX_PENDING) != 0)
        raspi3b_mini();
}

void board_start(void) {
    raspi3b_time_start();
    raspi3b_uarts_start();
}

enum { RSTC = 0x1C / 4, WDOG = 0x24 / 4 }; /* behind RASPI3B_PM */
enum { FULL_RESET = 0x20, KIND = 0x30, SOON = 10 };

enum { HELD_BITS = 18 * 10 }; /* in a UART: 16 bytes, and that being sent */

#define PASSWORD UINT32_C(0x5A000000)

/* What a UART has of its own is the end of a report, or of a farewell. */
static void see_off(void) {
    uint64_t begun_us = board_now_us();
    while (board_now_us() - begun_us <=
           HELD_BITS * 1000000u / board_facts.baud) {
    }
}

void board_restart(void) {
    volatile uint32_t *pm = raspi3b_at(RASPI3B_PM);
    (void)board_lock();
    see_off();
    raspi3b_barrier();
    pm[WDOG] = PASSWORD | SOON;
    pm[RSTC] =
        PASSWORD | (pm[RSTC] & ~(PASSWORD | (uint32_t)KIND)) | FULL_RESET;
    for (;;)
        raspi3b_barrier();
}
