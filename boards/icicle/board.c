/* Microchip's PolarFire SoC Icicle Kit: UARTs 0 to 4 are MMUARTs 0 to 4.  Its
 * flash is a partition of its card. */
#include "boards/bare/bare.h"
#include "boards/sdhci/sdhci.h"
#include "facts.h"
#include "registers.h"

const struct board_facts board_facts = {.name = BOARD_NAME,
                                        .ports = BOARD_UARTS - 1,
                                        .baud = BOARD_BAUD,
                                        .data_bytes = 4u << 20,
                                        .flash = &sdhci_flash,
                                        .image_at = UINT32_C(0x80000000),
                                        .image_bytes = 2u << 20};

void board_start(void) {
    icicle_time_start();
    icicle_uarts_start();
}

enum { HELD_BITS = 18 * 10 }; /* in a UART: 16 bytes, and that being sent */

/* What a UART has of its own is the end of a report, or of a farewell. */
static void see_off(void) {
    uint64_t begun_us = board_now_us();
    while (board_now_us() - begun_us <=
           HELD_BITS * 1000000u / board_facts.baud) {
    }
}

/* The processor alone begins anew: the chip's own reset would take the memory
 * with it, and the emulator has none. */
void board_restart(void) {
    (void)board_lock();
    see_off();
    icicle_jump(ICICLE_ENVM);
}

void board_launch(uint32_t address) {
    (void)board_lock();
    icicle_jump(address);
}

enum { CARD = 1 << 3 };         /* of ICICLE_CLOCKS and ICICLE_RESETS */
enum { POWER_3V3 = 0x0F << 8 }; /* on */

volatile uint32_t *sdhci_registers(void) {
    return icicle_at(ICICLE_CARD);
}

uint32_t sdhci_start(void) {
    volatile uint32_t *system = icicle_at(ICICLE_SYSTEM);
    system[ICICLE_CLOCKS] |= CARD;
    system[ICICLE_RESETS] &= ~(uint32_t)CARD;
    return POWER_3V3;
}
