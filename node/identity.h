/* The identity of a node whose board was not told it: its number and its cube's
 * dimension from HELLOs of its neighbours, its epoch from a source of its board
 * that never repeats.  A board calls this before node_start.
 *
 * Work: a call reads what the links have brought, LEARN_BYTES each at most, and
 * never waits. */
#ifndef NODE_IDENTITY_H
#define NODE_IDENTITY_H

#include "board.h"
#include "transport/gossip.h"

/* Sets the epoch of this start: drawn at random if the source has random bytes,
 * otherwise the number of this start, which does not repeat before 2^32 - 1
 * starts.  False: the source has neither. */
bool node_identity_epoch(struct node_identity *identity,
                         struct secure_source *source);

/* Begins to listen on the board's first `links` links. */
void node_identity_listen(struct learner *learner,
                          const struct node_board *board, unsigned links);

/* The same for a board whose pipes 0 .. ports - 1 are sockets of dimensions 0
 * .. ports - 1; its cube may have fewer dimensions.  With `host`, pipe `ports`
 * may lead to a host.  If the identity that it learns is node 0's or has
 * host_port, the board then moves this pipe to pipes[dimension]. */
void node_identity_listen_ports(struct learner *learner,
                                const struct node_board *board, unsigned ports,
                                bool host);

/* Asks the neighbours for the node's number, if it is time.  For a board with
 * serial wires: after its reset the neighbours are up and send no HELLO.
 * Called between two calls of node_identity_hear. */
void node_identity_ask(struct learner *learner, uint64_t now_us);

/* True: a neighbour has sent the node's number, and identity is filled in. */
bool node_identity_hear(struct learner *learner,
                        struct node_identity *identity);

/* After that, for a board without a source for node_identity_epoch: the epoch
 * after the largest that the neighbours knew of this node; 1 follows 2^32 - 1.
 * False: they knew none, and the epoch is 1. */
bool node_identity_epoch_behind(const struct learner *learner,
                                struct node_identity *identity);

/* NULL, or why a HELLO that arrived was of no use. */
const char *node_identity_doubt(const struct learner *learner);

#endif
