/* A worker of the spatial decomposition over Linda: the regions are tuples,
 * which workers take.  One node, the manager of the setup, puts the regions
 * that the host sends it, starts the other workers by eval at the first region,
 * and reports to the host which node has taken which region.  The host then
 * gives that node the job, and the rest is as for any worker (worker.h). */
#ifndef NODE_LINDA_WORKER_H
#define NODE_LINDA_WORKER_H

#include "roles.h"

extern const struct node_role node_linda_worker_role;

#endif
