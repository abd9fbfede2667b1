/* What starts a node on a board: a unit of systemd, or where none runs a few
 * lines for a shell.  Both hold what `incode cube FILE` prints, with the
 * board's own paths.
 *
 * Memory: the text, up to 64 KiB.  Work: one pass over the node's options.
 *
 *     const struct host_unit unit = {.file = &file, .node = 3,
 *                                    .folder = "/opt/incode/node-3",
 *                                    .manager = "system", .user = "pi"};
 *     char *text = host_unit_text(&unit);
 *     free(text);
 */
#ifndef HOST_UNIT_H
#define HOST_UNIT_H

#include "host/nodes/cube_file.h"

struct host_unit {
    const struct host_cube_file *file;
    unsigned node;
    const char *folder;  /* the node's own on its board, from the root */
    const char *manager; /* "system" or "user" of systemd, or "none" */
    const char *user;    /* who runs it */
};

/* To be freed; NULL: no memory. */
char *host_unit_text(const struct host_unit *unit);

#endif
