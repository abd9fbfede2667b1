/* `incode console`: a person, or a script, and a cube.
 *
 * Memory: the shell's.  Work: until the person leaves, or the script ends.
 *
 *     return host_console_command(argc, argv, &error);
 */
#ifndef HOST_CONSOLE_CONSOLE_H
#define HOST_CONSOLE_CONSOLE_H

#include "host/base/error.h"

int host_console_command(int argc, char **argv, struct host_error *error);

#endif
