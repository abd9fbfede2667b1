/* What a board is sent for what it is and has, and how that is told. */
#ifndef HOST_ANSWER_H
#define HOST_ANSWER_H

#include "board.h"
#include "host/nodes/cube_file.h"

/* Once all facts are there: reply, program, unit, result.  0, or board->error.
 */
int host_answer(struct host_deploy_board *board,
                const struct host_deploy_job *job);

/* What its result is, once it is done. */
void host_answer_done(struct host_deploy_board *board, const char *state);

/* What starts a node on a board: a unit of systemd, or where none runs a few
 * lines for a shell.  Both hold what `incode cube FILE` prints, with the
 * board's own paths.
 *
 * Memory: the text, up to 64 KiB. */

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
