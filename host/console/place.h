/* The console's cube where its options say it is: the wires, lines that reset
 * boards, and runs beside it. */
#ifndef HOST_CONSOLE_PLACE_H
#define HOST_CONSOLE_PLACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "host/base/error.h"
#include "host/cube/lines.h"
#include "host/cube/site.h"
#include "shell.h"

/* `incode run` as a child of the console, with its own group, so that Ctrl-C at
 * the console's line is not its. */

struct host_child_run {
    pid_t pid; /* 0: none runs */
    int said;  /* what it says comes there; -1: it has the terminal */
    size_t used;
    char line[1024];
};

enum { HOST_CONSOLE_PATH = 4200 };

struct host_console_place {
    struct host_site_options options;
    struct host_site site;
    struct host_child_run run;
    struct host_shell_place place;
    char wire[HOST_WIRE_NAME]; /* the host's, once it was open */
    char folder[64];           /* of the files below; "": there are none */
    char cube[HOST_CONSOLE_PATH], stats[HOST_CONSOLE_PATH];
};

void host_console_place_init(struct host_console_place *place,
                             const struct host_site_options *options);

/* Removes what was written for runs. */
void host_console_place_end(struct host_console_place *place);

#endif
