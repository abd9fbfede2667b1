/* `incode key FILE`: makes a cube's key, 64 hexadecimal digits of the kernel's
 * random numbers, in a file for its owner alone.
 *
 * Memory: the digits, wiped.  Work: a few system calls.
 *
 *     if (host_key_make("cube.key", &error) != 0)
 *         return error.code;
 */
#ifndef HOST_CUBE_KEY_H
#define HOST_CUBE_KEY_H

#include <stddef.h>
#include <sys/types.h>

#include "host/base/error.h"

/* Mode 0600 whatever the umask, and on the disk when it returns.  0; HOST_INPUT
 * where there is such a file already, which stays as it is, or where it cannot
 * be written: then nothing is left. */
int host_key_make(const char *path, struct host_error *error);

/* The same with a text of the caller's, and any mode. */
int host_key_write(const char *path, const char *text, size_t size, mode_t mode,
                   struct host_error *error);

#endif
