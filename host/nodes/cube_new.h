/* `incode cube FILE` checks a cube file and prints how its nodes are started;
 * `incode cube --new N -o FILE` writes one to start from, which is valid as it
 * stands, and says what to edit. */
#ifndef HOST_CUBE_NEW_H
#define HOST_CUBE_NEW_H

#include "host/base/error.h"

/* The whole command. */
int host_cube_command(int argc, char **argv, struct host_error *error);

#endif
