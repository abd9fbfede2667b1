/* NODE_RESULT: tetrahedra on their way into the list, and bricks committed.
 * Part of service.h.
 *
 * Nothing of it is believed: every vertex must be that of a point, the four
 * different, the brick that owns the tetrahedron one of the node's job and not
 * committed.  A node that says anything else is named, and its job is lost with
 * it (host_idle_leave); what it had committed stays.
 *
 * Memory: none of its own.  Work: about 10 ns a tetrahedron.
 *
 *     if (message.type == NODE_RESULT)
 *         status = host_results_take(&service, &message, &error);
 */
#ifndef HOST_RESULTS_H
#define HOST_RESULTS_H

#include "service.h"

/* Of a job that is current; the results behind the header.  0, or an error. */
int host_results_take(struct host_service *service,
                      const struct cube_message *message,
                      struct host_error *error);

#endif
