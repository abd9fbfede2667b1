/* What the chip's pins are, and which are held high where nobody drives them.
 */
#include "boards/bare/bare.h"
#include "boards/sdhci/sdhci.h"
#include "registers.h"

enum { PUD = 0x94 / 4, PUDCLK = 0x98 / 4 }; /* words behind RASPI3B_GPIO */
enum { PULL_UP = 2, SETTLE_US = 10 };

static void settle(void) {
    uint64_t until_us = board_now_us() + SETTLE_US;
    while (board_now_us() < until_us) {
    }
}

/* Three bits each, ten pins a word. */
void raspi3b_pin(unsigned number, uint32_t function) {
    volatile uint32_t *select = &raspi3b_at(RASPI3B_GPIO)[number / 10];
    unsigned at = number % 10 * 3;
    *select = (*select & ~(UINT32_C(7) << at)) | function << at;
}

void raspi3b_pull_up(uint64_t pins) {
    volatile uint32_t *gpio = raspi3b_at(RASPI3B_GPIO);
    gpio[PUD] = PULL_UP;
    settle();
    gpio[PUDCLK] = (uint32_t)pins;
    gpio[PUDCLK + 1] = (uint32_t)(pins >> 32);
    settle();
    gpio[PUD] = 0;
    gpio[PUDCLK] = gpio[PUDCLK + 1] = 0;
}

/* --- the card's ----------------------------------------------------------- */

enum { CLOCK_PIN = 48, LAST_PIN = 53 };

volatile uint32_t *sdhci_registers(void) {
    return raspi3b_at(RASPI3B_CARD);
}

/* Its power is the board's. */
uint32_t sdhci_start(void) {
    for (unsigned i = CLOCK_PIN; i <= LAST_PIN; i++)
        raspi3b_pin(i, RASPI3B_FUNCTION_3);
    raspi3b_pull_up(UINT64_C(0x1F) << (CLOCK_PIN + 1)); /* not the clock */
    return 0;
}
