/* Bare boards that QEMU emulates, wired as a cube: one process a node, started
 * again where it dies, with the chip of its flash that it had.
 *
 * Memory: static, for HOST_EMULATED_MAX nodes; a file of HOST_FLASH_BYTES in
 * the system's memory for each that has a flash.  Work: a start takes 20 ms.
 *
 *     if (host_emulated_start(&board, &options, &started, &error) != 0)
 *         return error.code;
 *     machine = started.machine; // whose end stops them
 */
#ifndef HOST_BOARD_EMULATED_H
#define HOST_BOARD_EMULATED_H

#include "host/nodes/boards.h"

enum { HOST_EMULATED_MAX = 1 << (HOST_UARTS_MAX - 1) };

/* The start function of a board whose row names what emulates it. */
int host_emulated_start(const struct host_board *board,
                        const struct host_cluster_options *options,
                        struct host_started *started, struct host_error *error);

/* The file in options->directory at which a board's UART listens: the host's
 * wire of node 0, the console of others, or the wire to a node that is left
 * out. */
void host_emulated_wire(unsigned node, unsigned uart, char name[32]);

#endif
