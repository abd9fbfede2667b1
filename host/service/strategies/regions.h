/* What strategies share whose jobs are bricks of the order: a region a node at
 * first, and after a loss ranges of what is left.
 *
 * Memory: none.  Work: a pass over the points of a range.
 *
 *     while (!work.lost[node] && host_regions_next(&work, node, &job))
 *         (void)host_ledger_open(work.ledger, node, job.first, job.last);
 */
#ifndef HOST_REGIONS_H
#define HOST_REGIONS_H

#include "strategy.h"

/* Node i has region i, as long as nothing is done and nobody lost; otherwise
 * nobody has a first job. */
bool host_regions_first(struct host_work *work, unsigned node,
                        struct incode_job *job);

/* The next range of bricks that nobody has. */
bool host_regions_next(struct host_work *work, unsigned node,
                       struct incode_job *job);

/* A brick of the node's own job. */
int host_regions_commit(struct host_work *work, unsigned node, uint32_t brick);

#endif
