/* Nodes as children of this process, which end when it does.  One that dies may
 * be started again, but not for ever.
 *
 * Memory: struct host_process.  Work: a fork, and a wait until the child's
 * program has begun; a system call a look.
 *
 *     if (host_child_start(&process, &child, &error) != 0)
 *         return error.code;
 *     if (host_child_died(&process)) // may it be started again?
 *         status = host_child_check(&process, 3, 0, &error);
 *     if (host_child_kill(&process))
 *         host_child_wait(&process);
 */
#ifndef HOST_CHILD_H
#define HOST_CHILD_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "host/base/error.h"

enum { HOST_FAULTS_MAX = 3, HOST_DEATHS_MAX = 10, HOST_DEATHS_US = 10000000 };

struct host_process {
    pid_t pid;          /* 0: it does not run */
    int status;         /* as waitpid gave it, of the last that died */
    unsigned faults;    /* times that it ended without being killed */
    unsigned deaths;    /* times that it ended since... */
    uint64_t deaths_us; /* ...this time */
};

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
int host_child_start(struct host_process *process,
                     const struct host_child *child, struct host_error *error);

/* Whether any child has ended that nobody has asked for. */
bool host_child_any_died(void);

/* Whether it ran and has ended. */
bool host_child_died(struct host_process *process);

/* After that.  0, or HOST_CUBE where it has done so too often: HOST_FAULTS_MAX
 * times by itself, or HOST_DEATHS_MAX times within HOST_DEATHS_US however it
 * came.  link: by which the node is reached, for the message. */
int host_child_check(struct host_process *process, unsigned node, unsigned link,
                     struct host_error *error);

/* Ends it if it runs, which host_child_died finds; false: it does not. */
bool host_child_kill(const struct host_process *process);

/* Microseconds that it was kept waiting for a processor since its start; 0: the
 * kernel does not say. */
uint64_t host_child_starved_us(const struct host_process *process);

/* Waits for the end of one that was killed. */
void host_child_wait(struct host_process *process);

#endif
