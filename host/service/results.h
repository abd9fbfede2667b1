/* What a node says of its job: tetrahedra on their way into the list, bricks
 * committed, faces that it spills.  Part of service.h.
 *
 * Nothing of it is believed: every vertex must be that of a point, the four
 * different, the brick that owns the tetrahedron one of the node's job and not
 * committed; so the three of a face.  A node that says anything else is named,
 * and its job is lost with it (host_idle_leave); what it had committed stays.
 *
 * What a node can make the host keep is bounded.  Where the results of a job
 * pass 16 a point, or the faces that wait for a node 16 a point of its job,
 * they are looked through: repeats and wrong ones are refused, and otherwise
 * the bound is doubled, as a hub or two skew lines have so many.
 *
 * Memory: none of its own; a copy of a job's results or a node's faces while
 * they are looked through.  Work: about 10 ns a tetrahedron.
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

/* The node is named, and does its job no more: it has a new start, or, where it
 * had one, is excluded.  0, or HOST_UNVERIFIED where no other node is left. */
int host_results_refuse(struct host_service *service, unsigned node,
                        const char *why, struct host_error *error);

#endif
