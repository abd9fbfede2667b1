/* Nodes that answer and do nothing.  Part of service.h.
 *
 * What a node owes - that it is ready, the results of its job, its statistics -
 * it has to work for: its pongs count the steps that it does, and whatever else
 * it sends is progress as well.  One that owes something, is owed nothing by
 * the host, and shows no progress for the length of the service's patience is
 * idle; if it waits for a page or for answers of another node, that one is, or
 * who that one waits for, unless it goes on: then nobody is.  The machine ends
 * it, if it can start it again; if it cannot, or has done so before, the node
 * is left aside for the rest of the run, which goes on without its work, but by
 * its links.
 *
 * Memory: none of its own.  Work: constant a message, a pass over the nodes a
 * check.
 *
 *     host_idle_progress(&service, node);
 *     host_idle_check(&service, elapsed_us);
 */
#ifndef HOST_IDLE_NODES_H
#define HOST_IDLE_NODES_H

#include "service.h"

/* The node has done something, or has something to do from now on. */
void host_idle_progress(struct host_service *service, unsigned node);

/* Sets service->loss where a node is left aside. */
void host_idle_check(struct host_service *service, uint64_t elapsed_us);

/* A node is not to be trusted with work, as `why` says: ends it for a new
 * start, or leaves it aside.  False: it had its new start already. */
bool host_idle_leave(struct host_service *service, unsigned node,
                     const char *why);

#endif
