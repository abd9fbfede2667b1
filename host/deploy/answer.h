/* What a board is sent for what it is and has, and how that is told.
 *
 * Memory: the reply and the unit's text, on the heap.  Work: a digest of each.
 *
 *     if (host_answer(&board, &job) != 0)
 *         return board.error.code;
 */
#ifndef HOST_ANSWER_H
#define HOST_ANSWER_H

#include "board.h"

/* Once all facts are there: reply, program, unit, result.  0, or board->error.
 */
int host_answer(struct host_deploy_board *board,
                const struct host_deploy_job *job);

/* What its result is, once it is done. */
void host_answer_done(struct host_deploy_board *board, const char *state);

#endif
