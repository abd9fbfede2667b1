/* Facts of the board: for its firmware, for the host, and for tests.
 * boards/README.md explains each. */
#define BOARD_NAME "raspi3b"
#define BOARD_HELP                                                             \
    "emulated: Raspberry Pi 3 without an operating system, 2 nodes"
#define BOARD_UARTS 2
#define BOARD_BAUD 115200
#define BOARD_FLASH HOST_FLASH_CARD

/* In the emulator. */
#define BOARD_EMULATOR "qemu-system-aarch64"
#define BOARD_PACKAGE "qemu-system-arm"
#define BOARD_MACHINE "raspi3b"
#define BOARD_PROGRAM_OPTION "-kernel"
#define BOARD_WIRE tcp_pair
