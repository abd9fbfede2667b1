/* Wires that are missing from the start: not put in, or broken before.  Part of
 * service.h.
 *
 * E-cube needs every wire on its paths, so that nodes behind a missing one do
 * not answer.  When for ten seconds no further node has, a generation begins in
 * which each end names its links that never came up.  Four seconds later, if
 * the cube holds together without them, they are dead: one line each says so,
 * and the run goes on round them.  Where it does not hold together a node is
 * still to come, and the search begins anew every ten seconds.
 *
 * A wire that no path needs hides nobody.  So each node says with its answers
 * and its statistics which links have been up.  A wire of which both ends say
 * that it never was, three seconds and more after all nodes have answered, is
 * named as well; nothing else changes, as nothing needs it.  Time in which a
 * node does not answer does not count, so that a slow start is no alarm.
 *
 * Memory: none of its own.  Work: constant a check, and a pass over nodes and
 * links until every wire has been up; at the end of a search such a pass for
 * each hop from the gateway.
 *
 *     host_missing_links_heard(&service, node, links);
 *     host_missing_links_look(&service, elapsed_us);
 *     if (host_missing_links_check(&service, now_us, patience_us))
 *         return 0; // they are searched: nobody is to be blamed yet
 */
#ifndef HOST_MISSING_LINKS_H
#define HOST_MISSING_LINKS_H

#include "service.h"

/* patience_us: for nodes to come.  True: what the wiring has as dead is only
 * absent so far. */
bool host_missing_links_check(struct host_service *service, uint64_t now_us,
                              uint64_t patience_us);

/* Whether all nodes can do without what has been found dead.  Where they
 * cannot, those who are cut off by it are waited for as any silent node is, and
 * are noted as such. */
bool host_missing_links_spare(struct host_service *service);

/* A node has said which of its links have been up. */
void host_missing_links_heard(struct host_service *service, unsigned node,
                              uint32_t links);

/* At each check: names the wires that never came up, when it is time. */
void host_missing_links_look(struct host_service *service, uint64_t elapsed_us);

/* After the run: whether there is a wire of which it is not known yet. */
bool host_missing_links_awaited(const struct host_service *service);

#endif
