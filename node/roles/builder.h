/* The tetrahedron builder's role in the strategies `master-slaves` and
 * `hybrid`: answers the lists of its manager, by messages from node to node
 * (lists.h).  It has no job and no results.
 *
 * Memory: its state, two places for each list that it may have (it waits in the
 * one, and is worked on in the other), page frames with the rest.  Work: `work`
 * takes NODE_STEPS steps, fewer where the time does not suffice, and `send`
 * sends what the link takes.
 *
 *     const struct node_role *role = &node_builder_role;
 *     role->message(arena, &message, now_us);
 *     moved = role->work(arena, &pace) + role->send(arena);
 */
#ifndef NODE_BUILDER_H
#define NODE_BUILDER_H

#include "roles.h"

extern const struct node_role node_builder_role;

#endif
