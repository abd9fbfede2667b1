/* `incode flash IMAGE`: brings an image to the boards of a cube, and shows how
 * far each is: a row a node on a terminal, lines where there is none.
 *
 * Memory: the image, and that of a visit.  Work: spread.h.
 *
 *     char *argv[] = {"incode flash", "--cube", "lab.cube", "a.img", NULL};
 *     if (host_flash(4, argv, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_FLASH_H
#define HOST_FLASH_H

#include "host/base/error.h"

/* The whole command. */
int host_flash(int argc, char **argv, struct host_error *error);

#endif
