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

enum { HOST_EMULATED_MAX = 1 << (HOST_UARTS_MAX - 1) };

/* The file in options->directory at which a board's UART listens: the host's
 * wire of node 0, the console of others, or the wire to a node that is left
 * out. */
void host_emulated_wire(unsigned node, unsigned uart, char name[32]);

/* The flash chip of an emulated board, or its memory card: a file, into which
 * the board's image is put as its loader would have it. */

#endif
