/* Who a node is, where nobody tells its board: its number and its cube's
 * dimension from the greetings of its neighbours, its epoch from what its board
 * has that never comes again.  A board calls this before node_start.
 *
 * Memory: struct learner, the caller's.  Work: a call reads what the links have
 * brought, LEARN_BYTES each at most, and never waits.
 *
 *     if (!node_identity_epoch(&board.identity, &board.source))
 *         return -1; // the board has neither random bytes nor a counter
 *     node_identity_listen(&learner, &board, links);
 *     while (!node_identity_hear(&learner, &board.identity))
 *         board.idle(board.context, 50000);
 */
#ifndef NODE_IDENTITY_H
#define NODE_IDENTITY_H

#include "board.h"
#include "transport/learn.h"

/* Sets the epoch of this start: drawn at random where the source has random
 * bytes, else its number of this start, which never comes again either (after
 * 2^32 - 1 starts it does).  False: it has neither. */
bool node_identity_epoch(struct node_identity *identity,
                         struct secure_source *source);

/* Begins to listen on the board's links, as many as it says. */
void node_identity_listen(struct learner *learner,
                          const struct node_board *board, unsigned links);

/* True: a neighbour has said who the node is, and identity has it. */
bool node_identity_hear(struct learner *learner,
                        struct node_identity *identity);

/* NULL, or why a greeting that came told nothing. */
const char *node_identity_doubt(const struct learner *learner);

#endif
