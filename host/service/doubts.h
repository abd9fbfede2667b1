/* Nodes and wires that the user is told of before it is clear what they have:
 * a line when one is silent, and one when it is back.  Part of service.h.
 *
 * A node that takes nothing off its links holds up others, and who is silent at
 * the host may be anywhere behind.  So nodes say, unasked, by which of their
 * links nothing has come for a second.  A node is doubted that does not answer
 * and is silent to a neighbour who is heard, or to the host, and to none is
 * not; where others hear it, it is the wire that is.
 *
 * Where there are more nodes than processors, or the machine is busy, all of
 * them may be silent for seconds, and answer.  So a node is doubted only when
 * it has been silent for twice as long as it, or any of its neighbours,
 * was of late before it answered.  Silences in which a node was doubted, or
 * after which a node says that a neighbour is silent, do not count: one that
 * stands still holds up what is for others.
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
