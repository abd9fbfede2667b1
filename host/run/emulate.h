/* `incode emulate`: emulated boards, wired as a cube, that stay until the
 * program is interrupted, and the cube file that leads to them.  Beside FILE
 * stands the directory FILE.d with their sockets, what their consoles say, and
 * their flash chips: who starts it again on the same FILE has turned all boards
 * off and on.
 *
 * Work: a look at the boards every 20 ms. */
#ifndef HOST_EMULATE_H
#define HOST_EMULATE_H

#include "host/base/error.h"

/* The whole command.  0 after an interrupt or termination. */
int host_emulate(int argc, char **argv, struct host_error *error);

#endif
