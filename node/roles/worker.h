/* The worker's role: turns the calls of a triangulator into messages.  Page
 * requests go out in batches; stars are encoded into batches that leave as the
 * host gives credit, commits among them in order; lists that spill go to the
 * host and come back.
 *
 * Work: `work` closes at most NODE_STEPS stars, fewer if the time does not
 * suffice, and `send` sends what the link takes. */
#ifndef NODE_WORKER_H
#define NODE_WORKER_H

#include "roles.h"

extern const struct node_role node_worker_role;

#endif
