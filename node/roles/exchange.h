/* The role in the strategy `exchange`: a worker whose front shares one active
 * face list with those of all other nodes (incode/front/exchange.h).  It learns
 * which node owns which bricks, waits until all nodes are ready (waves.h),
 * sends other nodes the tetrahedra that they need, and takes theirs at once.
 *
 * Work: `work` closes at most NODE_STEPS stars, fewer if the time does not
 * suffice; a message toggles the faces of its tetrahedra. */
#ifndef NODE_EXCHANGE_H
#define NODE_EXCHANGE_H

#include "roles.h"

extern const struct node_role node_exchange_role;

#endif
