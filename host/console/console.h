/* `incode console`: a person, or a script, and a cube.
 *
 * Work: until the person leaves, or the script ends. */
#ifndef HOST_CONSOLE_CONSOLE_H
#define HOST_CONSOLE_CONSOLE_H

#include "host/base/error.h"
#include "shell.h"

int host_console_command(int argc, char **argv, struct host_error *error);

/* `incode nodes`: the console's `nodes`, once: who is there, what is missing,
 * what is wired wrongly, and what to do next.
 *
 * Work: until all nodes have answered, or those that have not are known to be
 * behind wires that are dead; 12 s at most. */

/* 0: all are there, and their wires; HOST_CUBE: not, which is said. */
int host_nodes_command(int argc, char **argv, struct host_error *error);

/* The console without a person: lines of a file, of a pipe or of an option, and
 * answers on standard output.
 *
 * Memory: HOST_SCRIPT_LINE bytes. */

enum { HOST_SCRIPT_LINE = 65536 };

#endif
