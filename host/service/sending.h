/* What the host sends: to each node in turn what is due to it, pings, the
 * setup, jobs, credit, what the strategy has, spilled faces, pages.  Part of
 * service.h.
 *
 * Memory: none of its own.  Work: constant a message, a pass over the nodes
 * where nothing is due.
 *
 *     host_sending_begin(&service);
 *     host_sending_deal(&service);
 *     bool idle = host_sending_serve(&service, &error) == 0;
 *     return idle ? 0 : error.code;
 */
#ifndef HOST_SENDING_H
#define HOST_SENDING_H

#include "service.h"

/* A generation begins, all nodes are as after their start: nothing is out,
 * nothing asked for, and each has to have its setup. */
void host_sending_begin(struct host_service *service);

/* Every node has its setup: the first jobs. */
void host_sending_deal(struct host_service *service);

/* Serves the nodes in turn, while the wire takes it; returns how many messages
 * went.  The error is that of a spill's file. */
unsigned host_sending_serve(struct host_service *service,
                            struct host_error *error);

/* Whether a node has asked for pages and not got them yet. */
bool host_sending_pages_wait(const struct host_service *service);

/* `write` and `write_to_all` of struct host_work. */
bool host_sending_write(void *service, unsigned node, uint8_t type,
                        const void *data, size_t size);
bool host_sending_write_to_all(void *service, uint8_t type, const void *data,
                               size_t size);

#endif
