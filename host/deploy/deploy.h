/* `incode deploy`: puts the node program on boards with Linux over ssh, starts
 * it there, shows whether it runs, updates and removes it; all boards of a cube
 * file at once, each with a line of its own.
 *
 * Memory: 6 KiB a board, and the programs of their processors.  Work: a process
 * of ssh a board, DEPLOY_AT_ONCE at a time.
 *
 *     char *argv[] = {"incode deploy", "--cube", "lab.cube", NULL};
 *     if (host_deploy(3, argv, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_DEPLOY_H
#define HOST_DEPLOY_H

#include "host/base/error.h"

/* The whole command.  0; HOST_CUBE where any board failed, and the others did
 * what was asked for. */
int host_deploy(int argc, char **argv, struct host_error *error);

#endif
