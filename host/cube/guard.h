/* A stretch of time in which a signal that would end, or stop, the program
 * waits until something is put right: Ctrl-C, Ctrl-\, Ctrl-Z, SIGTERM, SIGHUP.
 * What the program does about signals beside is as it was again afterwards, and
 * happens then.  SIGKILL waits for nobody.
 *
 * Memory: struct host_guard; one at a time in the process.  Work: some system
 * calls; waiting sleeps.
 *
 *     if (host_guard_begin(&guard) != 0)
 *         return -1;
 *     bool whole = host_guard_wait(&guard, 100); // else a signal wants an end
 *     host_guard_end(&guard);                    // here it gets it
 */
#ifndef HOST_GUARD_H
#define HOST_GUARD_H

#include <signal.h>
#include <stdbool.h>

enum { HOST_GUARD_SIGNALS = 5 };

struct host_guard {
    struct sigaction before[HOST_GUARD_SIGNALS];
    bool taken[HOST_GUARD_SIGNALS]; /* not one that is ignored */
    int ends[2];                    /* of the pipe that a signal writes to */
};

/* 0, or -1 and errno. */
int host_guard_begin(struct host_guard *guard);

/* Sleeps; false: cut short by a signal.  Ctrl-Z does not cut it short. */
bool host_guard_wait(struct host_guard *guard, unsigned ms);

/* Signals that came meanwhile are raised before it returns. */
void host_guard_end(struct host_guard *guard);

#endif
