/* `incode sign` and `incode image`: makes an image of a board's binary, or
 * signs one anew; says what is in one.
 *
 * Memory: the file's bytes.  Work: a pass over them.
 *
 *     char *argv[] = {"incode image", "lab.img", NULL};
 *     if (host_image_show(2, argv, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_SIGN_H
#define HOST_SIGN_H

#include "host/base/error.h"

/* The whole commands. */
int host_sign(int argc, char **argv, struct host_error *error);
int host_image_show(int argc, char **argv, struct host_error *error);

#endif
