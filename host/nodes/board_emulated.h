/* Bare boards that QEMU emulates, wired as a cube: one process a node, started
 * again where it dies, with the chip of its flash that it had.
 *
 * Memory: static, for HOST_EMULATED_MAX nodes; a file of HOST_FLASH_BYTES in
 * the system's memory for each that has a flash.  Work: a start takes 20 ms.
 */
#ifndef HOST_BOARD_EMULATED_H
#define HOST_BOARD_EMULATED_H

#include <stdbool.h>

#include "boards.h"
#include "host/base/error.h"
#include "transport/drivers/tcp.h"
#include "transport/drivers/unix_file.h"

enum { HOST_EMULATED_MAX = 1 << (HOST_UARTS_MAX - 1) };

/* The file in options->directory at which a board's UART listens: the host's
 * wire of node 0, the console of others, or the wire to a node that is left
 * out. */
void host_emulated_wire(unsigned node, unsigned uart, char name[32]);

/* The start function of a board whose row names what emulates it. */
int host_emulated_start(const struct host_board *board,
                        const struct host_cluster_options *options,
                        struct host_started *started, struct host_error *error);

/* The row of a bare board, of what its folder's facts.h defines: the build
 * makes a source of it for each such folder. */
#define HOST_BOARD_ROW(row)                                                    \
    static const struct host_bare bare = {.machine = BOARD_MACHINE,            \
                                          .program = BOARD_EMULATOR,           \
                                          .package = BOARD_PACKAGE,            \
                                          .option = BOARD_PROGRAM_OPTION,      \
                                          .image = BOARD_NAME ".img",          \
                                          .loader =                            \
                                              "loader/" BOARD_NAME ".img",     \
                                          .uarts = BOARD_UARTS,                \
                                          .flash = BOARD_FLASH,                \
                                          .serial_baud = BOARD_BAUD,           \
                                          .pair = BOARD_WIRE};                 \
    extern const struct host_board row;                                        \
    const struct host_board row = {.name = BOARD_NAME,                         \
                                   .help = BOARD_HELP,                         \
                                   .bare = &bare,                              \
                                   .start = host_emulated_start};

#endif
