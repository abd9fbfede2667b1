/* Who a node is, where nobody tells its board: its number and its cube's
 * dimension from the greetings of its neighbours, its epoch from what its board
 * has that never comes again.  A board calls this before node_start.
 *
 * Work: a call reads what the links have brought, LEARN_BYTES each at most,
 * and never waits. */
#ifndef NODE_IDENTITY_H
#define NODE_IDENTITY_H

#include "board.h"
#include "transport/gossip.h"

/* Sets the epoch of this start: drawn at random where the source has random
 * bytes, else its number of this start, which never comes again either (after
 * 2^32 - 1 starts it does).  False: it has neither. */
bool node_identity_epoch(struct node_identity *identity,
                         struct secure_source *source);

/* Begins to listen on the board's links, as many as it says. */
void node_identity_listen(struct learner *learner,
                          const struct node_board *board, unsigned links);

/* The same of a board whose pipes 0 .. ports - 1 are sockets of dimensions 0 ..
 * ports - 1, of which its cube may have fewer; with `host` pipe `ports` is that
 * of a host, if there is one: where the identity that it hears is node 0's or
 * has host_port, the board puts it at pipes[dimension] then. */
void node_identity_listen_ports(struct learner *learner,
                                const struct node_board *board, unsigned ports,
                                bool host);

/* Asks the neighbours who the node is, if it is time: for a board with serial
 * wires, after whose reset they are up and do not greet.  Between two calls of
 * node_identity_hear. */
void node_identity_ask(struct learner *learner, uint64_t now_us);

/* True: a neighbour has said who the node is, and identity has it. */
bool node_identity_hear(struct learner *learner,
                        struct node_identity *identity);

/* After that, for a board that has nothing for node_identity_epoch: the epoch
 * behind the largest that the neighbours knew of this node, 1 behind 2^32 - 1.
 * False: none knew one, and it is 1. */
bool node_identity_epoch_behind(const struct learner *learner,
                                struct node_identity *identity);

/* NULL, or why a greeting that came told nothing. */
const char *node_identity_doubt(const struct learner *learner);

#endif
