/* What a bare board's console says, among the frames of a wire or alone: a
 * record is a zero, 0xFF, a text and a zero, which is no frame, so that the
 * link above passes over it.  A report of a fault is said on standard error,
 * and kept for who asks why a node is not heard.
 *
 * Memory: struct host_console.  Work: constant a byte.
 *
 *     host_console_init(&console, 3, "mps2-an500");
 *     host_console_hear(&console, bytes, size);
 *     machine.pipe = host_console_pipe(&console, machine.pipe); // or so
 *     why = host_console_fault(&console);
 */
#ifndef HOST_CONSOLE_H
#define HOST_CONSOLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "transport/link.h"

enum { HOST_CONSOLE_TEXT = 640 }; /* of a record, at most */

struct host_console {
    unsigned node;
    const char *board;
    enum { HOST_CONSOLE_OTHER, HOST_CONSOLE_ZERO, HOST_CONSOLE_RECORD } at;
    size_t used;
    char text[HOST_CONSOLE_TEXT + 1];
    char fault[HOST_CONSOLE_TEXT + 1]; /* what happened last; "" */
    unsigned faults;                   /* so far */
    struct link_pipe beneath;
};

void host_console_init(struct host_console *console, unsigned node,
                       const char *board);

void host_console_hear(struct host_console *console, const uint8_t *bytes,
                       size_t size);

/* A pipe as it is, but that what it brings is heard. */
struct link_pipe host_console_pipe(struct host_console *console,
                                   struct link_pipe beneath);

/* The last fault that the board reported, one printable line; NULL: none. */
const char *host_console_fault(const struct host_console *console);

#endif
