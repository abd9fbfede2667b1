/* The console on a terminal: a line that can be edited, with history and
 * completion, while the cube beneath is tended.  Ctrl-C abandons the line or
 * the command under way, a second one leaves; Ctrl-D leaves.
 *
 * Memory: libedit's.  Work: a look at the cube 50 times a second at least.
 *
 *     host_shell_init(&shell, &place, host_terminal_sink(), false);
 *     host_terminal_run(&shell, &signal_number, &error);
 *     host_shell_close(&shell);
 */
#ifndef HOST_CONSOLE_TERMINAL_H
#define HOST_CONSOLE_TERMINAL_H

#include "shell.h"

/* Where its answers go; there is one terminal. */
const struct host_shell_sink *host_terminal_sink(void);

/* Until the person leaves, or a signal ends it: 0, and *ending is its number or
 * 0; or HOST_USAGE or HOST_INPUT, where there is no such cube.  One that does
 * not answer may do so later. */
int host_terminal_run(struct host_shell *shell, int *ending,
                      struct host_error *error);

#endif
