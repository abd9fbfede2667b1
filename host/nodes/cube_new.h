/* `incode cube FILE` checks a cube file and prints how its nodes are started;
 * `incode cube --new N -o FILE` writes one to start from, which is valid as it
 * stands, and says what to edit.
 *
 * Memory: none to speak of.  Work: a line a link.
 *
 *     char *argv[] = {"incode cube", "--new", "8", "-o", "lab.cube", NULL};
 *     if (host_cube_command(5, argv, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_CUBE_NEW_H
#define HOST_CUBE_NEW_H

#include "host/base/error.h"

/* The whole command. */
int host_cube_command(int argc, char **argv, struct host_error *error);

#endif
