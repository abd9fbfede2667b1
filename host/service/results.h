/* The results of a node's job: tetrahedra for the list, bricks committed, faces
 * spilled.  Part of service.h.
 *
 * Nothing is taken unchecked.  All vertices of a tetrahedron, or of a face,
 * must be points, and different.  The brick that owns the tetrahedron must
 * belong to the node's job, and must not be committed.  A node that sends
 * anything else is named, and loses its job (host_idle_leave); its committed
 * bricks stay.
 *
 * What a node can make the host keep is bounded.  If a job has more than 16
 * tetrahedra a point, or a node has more than 16 spilled faces a point of its
 * job, these are judged.  If some are wrong or come twice, the node is refused;
 * else the bound is doubled, as a hub or two skew lines have so many.
 *
 * Memory: none of its own; a copy of a job's results or a node's faces while
 * they are judged.  Work: about 10 ns a tetrahedron.
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

/* Of a job that is current: `count` faces, and marks of vertices of the job
 * that were reached (incode/front/job.h), into the store.  0, or an error. */
int host_results_spill(struct host_service *service, unsigned node,
                       const struct incode_face *faces, uint32_t count,
                       struct host_error *error);

/* Names the node and takes its job away.  The node is started again; if it had
 * its new start already, or the host cannot start it, it is excluded.  0, or
 * HOST_UNVERIFIED if no other node is left. */
int host_results_refuse(struct host_service *service, unsigned node,
                        const char *why, struct host_error *error);

#endif
