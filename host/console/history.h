/* The lines that a person has typed, kept from one console to the next in
 * $XDG_STATE_HOME/incode/history, or ~/.local/state/incode/history, which its
 * owner alone can read.  Several consoles add to it at once.
 *
 * Memory: HOST_HISTORY_LINES lines.  Work: a line is appended at once, so that
 * none is lost with the program.
 *
 *     History *history = host_history_open();
 *     host_history_add(history, "ping 0-3");
 *     host_history_close(history);
 */
#ifndef HOST_CONSOLE_HISTORY_H
#define HOST_CONSOLE_HISTORY_H

#include <histedit.h>

enum { HOST_HISTORY_LINES = 1000 };

/* NULL: no memory.  Without a file, which is no error, it lasts as long as the
 * program. */
History *host_history_open(void);

/* A line without its line feed, unless it is empty or the same as before. */
void host_history_add(History *history, const char *line);
void host_history_close(History *history);

#endif
