/* Suspect nodes and wires: a notice when one falls silent, before the cause is
 * clear, and another when it is back.  Part of service.h.
 *
 * A node that reads nothing from its links holds up messages of other nodes, so
 * a node that the host does not hear need not be the cause.  Therefore every
 * node reports, unasked, the links on which nothing has come for a second.  A
 * node is suspect if it does not answer pings and every neighbour that is
 * itself up reports it silent.  If some neighbour still hears it, the suspect
 * is the wire, not the node.
 *
 * If there are more nodes than processors, or the machine is busy, a sound node
 * may be silent for seconds.  So a node becomes suspect only after twice the
 * longest silence of late after which that node, or a neighbour of it, answered
 * again.  A silence does not count if a node was suspect during it, or if the
 * node reports a silent neighbour after it: a node that stands still also holds
 * up messages for others.
 *
 * Memory: none of its own.  Work: a pass over the nodes a check, and over links
 * where some are silent.
 *
 *     host_doubts_check(&service, elapsed_us);
 *     host_doubts_heard(&service, node, false);
 */
#ifndef HOST_DOUBTS_H
#define HOST_DOUBTS_H

#include "service.h"

void host_doubts_check(struct host_service *service, uint64_t elapsed_us);

/* The node has answered; anew: it is another start than before. */
void host_doubts_heard(struct host_service *service, unsigned node, bool anew);

#endif
