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
 * Memory: none of its own.  Work: constant a check; at the end of a search a
 * pass over nodes and links for each hop from the gate.
 *
 *     searching = host_missing_check(service, now_us, patience_us);
 */
#ifndef HOST_MISSING_H
#define HOST_MISSING_H

#include "service.h"

/* patience_us: for nodes to come.  True: what the wiring has as dead is only
 * absent so far. */
bool host_missing_check(struct host_service *service, uint64_t now_us,
                        uint64_t patience_us);

#endif
