/* A worker of the spatial decomposition over Linda: the regions are tuples,
 * which workers take when they like.  One node, the manager of the setup, puts
 * those that the host sends it, starts the other workers by eval at the first,
 * and tells the host who has taken which; the host then gives that node the
 * job, and all else goes as for any worker (worker.h). */
#ifndef NODE_LINDA_WORKER_H
#define NODE_LINDA_WORKER_H

#include "roles.h"

extern const struct node_role node_linda_worker_role;

#endif
