/* Nodes that have not come yet.  Part of service.h.
 *
 * Before the first job is given out, the host waits until all nodes are up.  A
 * node is up if it has answered, or if a neighbour's wire to it has been up: a
 * node behind a missing one may be silent and up.  After a second and a half,
 * and whenever something changes, a notice names the nearest missing node, the
 * reason, and how to start it.  Another notice says when all nodes are up.
 *
 * The run ends when no further node has come up for the length of the patience.
 * Time in which the host did not poll does not count.  Nor does time in which a
 * node's process on this machine waited for a processor.  So a busy machine
 * ends no run, and a program that is no node is found as soon as on a quiet
 * machine.
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
