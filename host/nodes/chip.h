/* The flash chip of an emulated board, or its memory card: a file, into which
 * the board's image is put as its loader would have it.
 *
 * Memory: the chip's part that a loader knows, mapped; the image's bytes.
 * Work: a pass over the image; where the chip has it already, none is written.
 *
 *     if (host_chip_make(fd, false) != 0 ||
 *         host_chip_install(fd, false, "mps2-an500.img", &error) != 0)
 *         return -1;
 */
#ifndef HOST_CHIP_H
#define HOST_CHIP_H

#include <stdbool.h>

#include "host/base/error.h"

/* A chip as it is sold, erased, or a card with a table: 0, or -1 and errno. */
int host_chip_make(int fd, bool card);

/* The file has HOST_FLASH_BYTES, and no board uses it.  0, or HOST_CUBE: what
 * is at the path is no image, or the card has no place for it. */
int host_chip_install(int fd, bool card, const char *path,
                      struct host_error *error);

#endif
