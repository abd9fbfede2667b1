/* Generations of the cube's wiring: after a loss a new one begins without what
 * was given up, in which all nodes begin again with what is not committed.
 * Part of service.h.
 *
 * Memory: none of its own.  Work: a pass over the nodes, and what the strategy
 * does at a loss.
 *
 *     if (service.loss)
 *         return host_generation_renew(&service, now_us, &error);
 */
#ifndef HOST_GENERATIONS_H
#define HOST_GENERATIONS_H

#include "service.h"

/* The node by which the host speaks in a wiring: as before, or the other one
 * that has a wire to the host. */
uint16_t host_generation_gateway(const struct host_service *service,
                                 const struct cube_wiring *next);

/* After a loss.  HOST_CUBE where the cube cannot go on: without its gateway,
 * or after too many losses in a row without a brick between them. */
int host_generation_renew(struct host_service *service, uint64_t now_us,
                          struct host_error *error);

/* The wiring's generation is another than service->generation. */
int host_generation_begin(struct host_service *service, uint64_t now_us,
                          struct host_error *error);

#endif
