/* The flash chip of an emulated board: a file, into which the board's image is
 * put as its loader would have it.
 *
 * Memory: the chip's part that a loader knows, mapped; the image's bytes.
 * Work: a pass over the image; where the chip has it already, none is written.
 *
 *     if (host_chip_install(fd, "mps2-an500.img", &error) != 0)
 *         return error.code;
 */
#ifndef HOST_CHIP_H
#define HOST_CHIP_H

#include "host/base/error.h"

/* The file has HOST_FLASH_BYTES, and no board uses it.  0, or HOST_CUBE: what
 * is at the path is no image. */
int host_chip_install(int fd, const char *path, struct host_error *error);

#endif
