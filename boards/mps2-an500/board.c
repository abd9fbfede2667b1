/* Arm's MPS2 as AN500: a Cortex-M7 with a double-precision unit, five UARTs. */
#include "boards/bare/bare.h"
#include "node/loader/flash.h"

/* The PSRAM, which stands for the flash chip that the board has not. */
static const struct loader_flash flash = LOADER_RAM((void *)0x60000000);

const struct board_facts board_facts = {.name = "mps2-an500",
                                        .ports = 4,
                                        .baud = 115200,
                                        .data_bytes = 4u << 20,
                                        .flash = &flash,
                                        .image_at = 64u << 10,
                                        .image_bytes =
                                            (4u << 20) - (64u << 10)};
