/* A worker of the spatial decomposition over Linda: the regions are tuples,
 * which workers take when they like.  One node, the manager of the setup, puts
 * those that the host sends it, starts the other workers by eval at the first,
 * and tells the host who has taken which; the host then gives that node the
 * job, and all else goes as for any worker (worker.h).
 *
 * Memory: that of a share of the tuple space (share.h), then as a worker's.
 * Work: as a worker's.
 *
 *     const struct node_role *role = &node_linda_worker_role;
 *     if (role->start(arena, bytes, &setup, &counted, &fault))
 *         moved = role->work(arena, &pace) + role->send(arena);
 */
#ifndef NODE_LINDA_WORKER_H
#define NODE_LINDA_WORKER_H

#include "roles.h"

extern const struct node_role node_linda_worker_role;

#endif
