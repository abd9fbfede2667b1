/* The holder's role in the strategy `sequential`: keeps pages for a worker, and
 * asks the host for those that it does not have.  Whose a page is, keepers.h
 * says; there it has the frame of its place, modulo their number.
 *
 * Memory: a queue with room for every page that one worker may have in flight,
 * then frames.  Since that room is there before it asks, and a frame before the
 * host is asked, the holder always reads what comes, and nothing deadlocks.
 * Work: one pass over the queue a call of `send`.
 *
 *     const struct node_role *role = &node_holder_role;
 *     role->message(arena, &message, now_us);
 *     moved = role->send(arena);
 */
#ifndef NODE_HOLDER_H
#define NODE_HOLDER_H

#include "roles.h"

extern const struct node_role node_holder_role;

#endif
