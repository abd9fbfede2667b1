/* What a person sees of an image's way to boards: a row a node on a terminal
 * that has room for them, or some nodes a row; where there is none, a line
 * whenever a node comes to something new.
 *
 * Memory: struct host_flash_show.  Work: a pass over the nodes, ten times a
 * second at most.
 *
 *     host_flash_show_begin(&show, &spread, quiet);
 *     host_flash_show_draw(&show);
 *     host_progress_end();
 */
#ifndef HOST_FLASH_SHOW_H
#define HOST_FLASH_SHOW_H

#include "host/base/progress.h"
#include "spread.h"

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
