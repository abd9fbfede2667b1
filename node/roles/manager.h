/* The face manager's role in the strategies `master-slaves` and `hybrid`: lends
 * the faces of its jobs to builders by messages from node to node (lists.h),
 * and sends the results to the host.
 *
 * Work: `work` takes NODE_STEPS steps, fewer if the time does not suffice, and
 * `send` sends what the link takes. */
#ifndef NODE_MANAGER_H
#define NODE_MANAGER_H

#include "roles.h"

extern const struct node_role node_manager_role;

#endif
