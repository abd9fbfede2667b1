/* The tetrahedron builder's role in the strategies `master-slaves` and
 * `hybrid`: answers the lists of its manager, by messages from node to node
 * (lists.h).  It has no job and no results.
 *
 * Work: `work` takes NODE_STEPS steps, fewer if the time does not suffice, and
 * `send` sends what the link takes. */
#ifndef NODE_BUILDER_H
#define NODE_BUILDER_H

#include "roles.h"

extern const struct node_role node_builder_role;

#endif
