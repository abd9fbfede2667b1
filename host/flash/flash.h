/* `incode flash IMAGE`: brings an image to the boards of a cube, and shows how
 * far each is: a row a node on a terminal, lines where there is none. */
#ifndef HOST_FLASH_H
#define HOST_FLASH_H

#include <stdio.h>

#include "host/base/error.h"
#include "spread.h"
#include "host/base/progress.h"

/* The whole command. */
int host_flash(int argc, char **argv, struct host_error *error);

/* Ctrl-C, or another signal that ends the program, while boards are given an
 * image: the transfer ends at its next step, and the user is told what the
 * boards do now, and how to go on.  Then the program ends as by the signal; a
 * second one ends it at once.
 *
 * Memory: 4 KB of stack for a line. */

/* argv: the command, argv[0] as "incode flash"; the same goes on. */
void host_flash_cut_tell(FILE *out, const struct host_spread *spread, int argc,
                         char *const *argv);

/* What a person sees of an image's way to boards: a row a node on a terminal
 * that has room for them, or some nodes a row; where there is none, a line
 * whenever a node comes to something new.
 *
 * Work: a pass over the nodes, ten times a second at most. */

struct host_flash_show {
    const struct host_spread *spread;
    bool quiet;
    unsigned rows, nodes_a_row; /* rows 0: no terminal */
    unsigned wanted;
    uint16_t node[CUBE_NODES_MAX]; /* who is wanted */
};

/* host_progress_end takes the rows away. */
void host_flash_show_begin(struct host_flash_show *show,
                           const struct host_spread *spread, bool quiet);
void host_flash_show_draw(const struct host_flash_show *show);

/* A node has changed: a line, where there are no rows. */
void host_flash_show_change(const struct host_flash_show *show, unsigned node);

/* Who is well, and with what; and what would be done with whom, which has been
 * looked at alone. */
void host_flash_show_result(const struct host_flash_show *show);
void host_flash_show_plan(const struct host_flash_show *show);

#endif
