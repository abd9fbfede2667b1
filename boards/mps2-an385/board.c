/* Arm's MPS2 as AN385: a Cortex-M3, five UARTs. */
#include "boards/bare/bare.h"
#include "node/loader/flash.h"
#include "facts.h"

/* The PSRAM, which stands for the flash chip that the board has not. */
static const struct loader_flash flash = LOADER_RAM((void *)0x21000000);

const struct board_facts board_facts = {.name = BOARD_NAME,
                                        .ports = BOARD_UARTS - 1,
                                        .baud = BOARD_BAUD,
                                        .data_bytes = 4u << 20,
                                        .flash = &flash,
                                        .image_at = 64u << 10,
                                        .image_bytes =
                                            (4u << 20) - (64u << 10)};
