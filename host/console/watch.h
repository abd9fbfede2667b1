/* A machine as it is, but that a person may cut its waits short, that what it
 * has to tell goes where the person reads, and that bytes which are no frame
 * can be shown.
 *
 * Memory: struct host_watch.  Work: a copy of the last bytes that came.
 *
 *     host_watch_init(&watch, &machine, &sink);
 *     machine = host_watch_machine(&watch);
 *     host_watch_noise(&watch, text, sizeof text); // "Hello\r\n"
 */
#ifndef HOST_CONSOLE_WATCH_H
#define HOST_CONSOLE_WATCH_H

#include "host/service/machine.h"

struct host_shell_sink;

enum { HOST_WATCH_BYTES = 48 };

struct host_watch {
    struct host_machine beneath;
    const struct host_shell_sink *sink;
    bool cut;          /* a wait was cut short */
    uint64_t received; /* bytes, in all */
    unsigned used;
    uint8_t last[HOST_WATCH_BYTES]; /* that came */
};

void host_watch_init(struct host_watch *watch,
                     const struct host_machine *machine,
                     const struct host_shell_sink *sink);

/* Stays valid as long as the watch stays where it is.  Where a person has
 * interrupted, its `check` fails with HOST_CUBE, and watch->cut is set. */
struct host_machine host_watch_machine(struct host_watch *watch);

/* The last bytes that came, as a person can read them. */
void host_watch_noise(const struct host_watch *watch, char *text, size_t size);

#endif
