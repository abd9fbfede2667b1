/* Nodes that have not come yet.  Part of service.h.
 *
 * Until the first job is given out the host waits for all nodes.  After a
 * second and a half, and whenever something changes, the user is told which
 * node that is, the nearest that is missing, why, and how to start it; and that
 * all are there, when they are.  A node is there if it has answered, or if a
 * neighbour's wire to it has been up: what lies behind a missing node may be
 * silent and there.  When none has come for the length of the patience, the run
 * ends.  Time in which the host did not come to look does not count, nor does
 * time in which a node of this machine waited for a processor: so a busy
 * machine ends no run, and a program that is no node is found at the same time
 * as on a quiet one.
 *
 * Memory: none of its own.  Work: a pass over the nodes a check.
 *
 *     if (host_bring_up_check(&service, now_us, elapsed_us, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BRING_UP_H
#define HOST_BRING_UP_H

#include "service.h"

/* How long nodes are waited for: as the user wants, or as long as the machine
 * needs to start them. */
uint64_t host_bring_up_patience(const struct host_service *service);

/* HOST_CUBE where none has come for so long. */
int host_bring_up_check(struct host_service *service, uint64_t now_us,
                        uint64_t elapsed_us, struct host_error *error);

/* All have come: tells who was told that they had not. */
void host_bring_up_done(struct host_service *service);

#endif
