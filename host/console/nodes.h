/* `incode nodes`: the console's `nodes`, once: who is there, what is missing,
 * what is wired wrongly, and what to do next.
 *
 * Memory: the shell's.  Work: until all nodes have answered, or those that have
 * not are known to be behind wires that are dead; 12 s at most.
 *
 *     return host_nodes_command(argc, argv, &error);
 */
#ifndef HOST_CONSOLE_NODES_H
#define HOST_CONSOLE_NODES_H

#include "host/base/error.h"

/* 0: all are there, and their wires; HOST_CUBE: not, which is said. */
int host_nodes_command(int argc, char **argv, struct host_error *error);

#endif
