/* A memory card as a board's flash, by a controller of the SD Host Controller
 * standard, version 3: a block at a time, one line of data, without interrupts.
 *
 * Work: each wait has its end: 0.1 s for a command, a second for data, three
 * times. */
#ifndef BOARDS_SDHCI_SDHCI_H
#define BOARDS_SDHCI_SDHCI_H

#include <stdint.h>

#include "node/loader/flash.h"

extern const struct loader_flash sdhci_flash;

/* --- what a board gives --------------------------------------------------- */

volatile uint32_t *sdhci_registers(void);

/* Clocks and pins, before the controller's reset.  What is to be put to the
 * register of lines and power after it: one line of data. */
uint32_t sdhci_start(void);

#endif
