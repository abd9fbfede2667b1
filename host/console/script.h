/* The console without a person: lines of a file, of a pipe or of an option, and
 * answers on standard output.
 *
 * Memory: HOST_SCRIPT_LINE bytes.  Work: reads when there is something to read,
 * and tends the cube meanwhile.
 *
 *     host_shell_init(&shell, &place, host_script_sink(), true);
 *     host_script_read(&shell, "standard input", STDIN_FILENO, &error);
 *     return shell.first;
 */
#ifndef HOST_CONSOLE_SCRIPT_H
#define HOST_CONSOLE_SCRIPT_H

#include "shell.h"

enum { HOST_SCRIPT_LINE = 65536 };

const struct host_shell_sink *host_script_sink(void);

/* Does the lines until the end, `exit` or a signal.  0, or HOST_INPUT: it
 * cannot be read. */
int host_script_read(struct host_shell *shell, const char *name, int file,
                     struct host_error *error);

/* The signal that ends it, for who has cleared away; 0: none came. */
int host_script_ending(void);

#endif
