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

/* The start function of a board whose row names what emulates it. */
int host_emulated_start(const struct host_board *board,
                        const struct host_cluster_options *options,
                        struct host_started *started, struct host_error *error);

/* The file in options->directory at which a board's UART listens: the host's
 * wire of node 0, the console of others, or the wire to a node that is left
 * out. */
void host_emulated_wire(unsigned node, unsigned uart, char name[32]);

/* The flash chip of an emulated board, or its memory card: a file, into which
 * the board's image is put as its loader would have it.
 *
 * Memory: the chip's part that a loader knows, mapped; the image's bytes.
 * Work: a pass over the image; where the chip has it already, none is written.
 */

/* A chip as it is sold, erased, or a card with a table: 0, or -1 and errno. */
int host_chip_make(int fd, bool card);

/* The file has HOST_FLASH_BYTES, and no board uses it.  0, or HOST_CUBE: what
 * is at the path is no image, or the card has no place for it. */
int host_chip_install(int fd, bool card, const char *path,
                      struct host_error *error);

#endif
