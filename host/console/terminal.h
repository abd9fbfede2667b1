/* The console on a terminal: a line that can be edited, with history and
 * completion, while the cube beneath is tended.  Ctrl-C abandons the line or
 * the command under way, a second one leaves; Ctrl-D leaves.
 *
 * Work: a look at the cube 50 times a second at least. */
#ifndef HOST_CONSOLE_TERMINAL_H
#define HOST_CONSOLE_TERMINAL_H

#include <histedit.h>

#include "shell.h"

/* The lines that a person has typed, kept from one console to the next in
 * $XDG_STATE_HOME/incode/history, or ~/.local/state/incode/history, which its
 * owner alone can read.  Several consoles add to it at once.
 *
 * Memory: HOST_HISTORY_LINES lines. */

enum { HOST_HISTORY_LINES = 1000 };

/* Where its answers go; there is one terminal. */
const struct host_shell_sink *host_terminal_sink(void);

/* Until the person leaves, or a signal ends it: 0, and *ending is its number or
 * 0; or HOST_USAGE or HOST_INPUT, where there is no such cube.  One that does
 * not answer may do so later. */
int host_terminal_run(struct host_shell *shell, int *ending,
                      struct host_error *error);

#endif
