/* The arguments of incode-node.
 *
 * Memory: the caller's; texts stay those of the arguments.  Work: one pass.
 *
 *     if (!straps_read(argv + 1, &straps, &fault))
 *         fault_print(&fault);
 */
#ifndef BOARDS_LINUX_STRAPS_H
#define BOARDS_LINUX_STRAPS_H

#include <stdbool.h>
#include <stdint.h>

#include "transport/cube.h"
#include "fault.h"

#define STRAPS_UNNAMED UINT64_MAX /* as a node: it is to learn who it is */

struct straps {
    uint64_t node, dimension, memory, stack, window, epoch, lines, host_wire,
        dead, watch;
    int links[CUBE_LINKS_MAX];
    unsigned links_count;
    /* That the node opens itself: the arguments, as "2=call:10.0.0.1:7001". */
    const char *wire[CUBE_LINKS_MAX];
    unsigned wires_count;
    const char *key; /* a file */
};

/* False: *fault says which argument is wrong. */
bool straps_read(char **argv, struct straps *straps, struct linux_fault *fault);

/* What --help prints. */
void straps_help(void);

#endif
