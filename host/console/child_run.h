/* `incode run` as a child of the console, with its own group, so that Ctrl-C at
 * the console's line is not its.
 *
 * Memory: struct host_child_run.  Work: a fork and an exec; a look reads what
 * the child has said.
 *
 *     if (host_child_run_begin(&run, words, true, &error) != 0)
 *         return error.code;
 *     while (!host_child_run_look(&run, &status, say, NULL, 100000))
 *         host_child_run_interrupt(&run);
 */
#ifndef HOST_CONSOLE_CHILD_RUN_H
#define HOST_CONSOLE_CHILD_RUN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "host/base/error.h"

struct host_child_run {
    pid_t pid; /* 0: none runs */
    int said;  /* what it says comes there; -1: it has the terminal */
    size_t used;
    char line[1024];
};

/* words: its arguments, the program's name first, NULL last.  quiet: its output
 * comes by `look`, not on the terminal. */
int host_child_run_begin(struct host_child_run *run, const char *const *words,
                         bool quiet, struct host_error *error);

/* Whether it has ended, and then *status, as a shell has it. */
bool host_child_run_look(struct host_child_run *run, int *status,
                         void (*say)(void *context, const char *text),
                         void *context, uint64_t wait_us);

/* As Ctrl-C does. */
void host_child_run_interrupt(const struct host_child_run *run);

#endif
