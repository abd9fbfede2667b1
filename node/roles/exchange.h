/* The role in the strategy `exchange`: a worker whose front shares one active
 * face list with those of all other nodes (incode/front/exchange.h).  It is
 * told whose bricks are whose, waits until all are ready (waves.h), tells
 * others the tetrahedra that they need, and takes theirs at once.
 *
 * Work: `work` closes at most NODE_STEPS stars, fewer where the time does not
 * suffice; a message toggles the faces of its tetrahedra. */
#ifndef NODE_EXCHANGE_H
#define NODE_EXCHANGE_H

#include "roles.h"

extern const struct node_role node_exchange_role;

#endif
