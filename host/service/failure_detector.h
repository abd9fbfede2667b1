/* Whether all nodes are there, and have missed nothing.  Part of service.h.
 *
 * Each node is pinged in turn.  Its pong names its start and how many messages
 * it has had and sent; another start than before, or a count that does not
 * match, is a loss.  So is a node that the machine had to start again, a dead
 * link that the cube has found and that no node needs, and a node that does not
 * answer for the length of the service's patience, in the last part of which it
 * is pinged alone, in the next generation: the machine ends it, if it can start
 * it again, and it is given up otherwise.  One that answers and does nothing:
 * idle_nodes.h.  What the user is told meanwhile: doubts.h.
 *
 * Memory: none of its own.  Work: constant a message; one pass over the nodes
 * at each check, every 20 ms.
 *
 *     host_detector_begin(&service, now_us);
 *     if (message.type == NODE_PONG)
 *         status = host_detector_pong(&service, &message, &error);
 *     status = host_detector_check(&service, now_us, &error);
 */
#ifndef HOST_FAILURE_DETECTOR_H
#define HOST_FAILURE_DETECTOR_H

#include "service.h"

/* A generation begins: who is living by the wiring, and all are pinged. */
void host_detector_begin(struct host_service *service, uint64_t now_us);

/* The run is over, for those too whose statistics have not come. */
void host_detector_end(struct host_service *service);

/* By which of its wires the host speaks now. */
unsigned host_detector_wire(const struct host_service *service);

/* The link by which a node is reached first. */
unsigned host_detector_link(const struct host_service *service, unsigned node);

/* Sends the ping that is due to a node; false: no room. */
bool host_detector_ping(struct host_service *service, uint16_t to);

/* NODE_PONG. */
int host_detector_pong(struct host_service *service,
                       const struct cube_message *message,
                       struct host_error *error);

/* HOST_CUBE, if the machine knows why a node is not heard; else 0. */
int host_detector_doubt(const struct host_service *service, unsigned node,
                        struct host_error *error);

/* Sets service->loss where a new generation is due.  HOST_CUBE where the cube
 * cannot go on. */
int host_detector_check(struct host_service *service, uint64_t now_us,
                        struct host_error *error);

#endif
