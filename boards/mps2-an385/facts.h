/* Facts of the board: for its firmware, for the host, and for tests.
 * boards/README.md explains each. */
#define BOARD_NAME "mps2-an385"
#define BOARD_HELP "emulated: Cortex-M3, up to 16 nodes"
#define BOARD_UARTS 5
#define BOARD_BAUD 115200
#define BOARD_FLASH HOST_FLASH_CHIP

/* In the emulator. */
#define BOARD_EMULATOR "qemu-system-arm"
#define BOARD_PACKAGE "qemu-system-arm"
#define BOARD_MACHINE "mps2-an385"
#define BOARD_PROGRAM_OPTION "-kernel"
#define BOARD_WIRE unix_file_pair
