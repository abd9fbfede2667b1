/* What nodes report as faults, and whether to believe them.  Part of service.h.
 *
 * If a node between two others restarts, messages on their way are lost, and
 * the messages after the gap look wrong to the node that gets them.  So a fault
 * counts only once every living node has answered a ping sent after the fault
 * arrived, and no node has reported a loss.  (A loss begins a new generation,
 * in which all nodes begin anew.)  A fault that no loss can explain counts at
 * once, but for a list that nodes share and that is too small for one of them:
 * that of a node which works alone may suffice.
 *
 * A fault that counts does not end the run as long as another node is left.
 * The first time all nodes go on, each working alone.  If a node then reports
 * a fault, that node is excluded (audit.h).
 *
 * Memory: none of its own.  Work: one pass over the nodes a fault.
 *
 *     if (message.type == NODE_FAULT)
 *         status = host_faults_take(&service, &message, &error);
 *     host_faults_pinged(&service, 3, ping.sent);
 *     status = host_faults_answered(&service, 3, pong.pinged, &error);
 */
#ifndef HOST_FAULTS_H
#define HOST_FAULTS_H

#include "service.h"

/* A generation begins: what was said before counts no more. */
void host_faults_begin(struct host_service *service);

/* NODE_FAULT: HOST_CUBE, if it counts at once; else 0. */
int host_faults_take(struct host_service *service,
                     const struct cube_message *message,
                     struct host_error *error);

/* A ping has gone to a node: what it told as the count of messages sent. */
void host_faults_pinged(struct host_service *service, unsigned node,
                        uint32_t count);

/* A node has answered the ping of that count, and has missed nothing:
 * HOST_CUBE, if a fault counts now; else 0. */
int host_faults_answered(struct host_service *service, unsigned node,
                         uint32_t count, struct host_error *error);

#endif
