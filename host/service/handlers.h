/* What the host does with each message of a node.  Part of service.h.
 *
 * Memory: none of its own.  Work: about 6 ns a tetrahedron, constant for the
 * rest.
 *
 *     while (status == 0 && cube_read(cube, &message)) {
 *         status = host_handle(&service, &message, &error);
 *         cube_release(cube);
 *     }
 */
#ifndef HOST_HANDLERS_H
#define HOST_HANDLERS_H

#include "service.h"

int host_handle(struct host_service *service,
                const struct cube_message *message, struct host_error *error);

#endif
