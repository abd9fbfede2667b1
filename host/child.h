/* Nodes as children of this process, which end when it does.
 *
 * Memory: none.  Work: a fork, and a wait until the child's program has begun.
 *
 *     status = host_child_start(&pid, &child, &error);
 */
#ifndef HOST_CHILD_H
#define HOST_CHILD_H

#include <sys/types.h>

#include "error.h"

struct host_child {
    unsigned node;
    const char *path;      /* its program, for messages */
    const char *otherwise; /* what to do where there is no process for it */
    /* In the child, whose standard input and output are nothing: becomes the
     * program.  Returns where that fails, with errno. */
    void (*become)(const void *context, unsigned node);
    const void *context;
};

/* 0, or HOST_CUBE, HOST_BROKEN: it has not begun. */
int host_child_start(pid_t *pid, const struct host_child *child,
                     struct host_error *error);

#endif
