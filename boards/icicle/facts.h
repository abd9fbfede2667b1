/* Facts of the board: for its firmware, for the host, and for tests.
 * boards/README.md explains each. */
#define BOARD_NAME "icicle"
#define BOARD_HELP "emulated: PolarFire SoC, RISC-V of 64 bits, up to 16 nodes"
#define BOARD_UARTS 5
#define BOARD_BAUD 115200
#define BOARD_FLASH HOST_FLASH_CARD

/* In the emulator. */
#define BOARD_EMULATOR "qemu-system-riscv64"
#define BOARD_PACKAGE "qemu-system-misc"
#define BOARD_MACHINE "microchip-icicle-kit"
#define BOARD_PROGRAM_OPTION "-bios"
#define BOARD_WIRE tcp_pair
