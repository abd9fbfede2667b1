/* What strategies share whose jobs are bricks of the order: a region a node at
 * first, and after a loss ranges of what is left. */
#ifndef HOST_REGIONS_H
#define HOST_REGIONS_H

#include "strategy.h"

/* Processor time of all nodes where each has a region, if nothing is built
 * twice, and how much more the busiest has to do where a share `again` of what
 * lies at a border is. */
struct host_cost host_regions_cost(const struct host_task *task, double again);

/* The same where one of a group of nodes has the list of faces and lends so
 * many at a time to the others: a list costs as much as many faces do. */
struct host_cost host_regions_lists_cost(unsigned groups, unsigned faces);

/* So many regions are wanted: one a node, or one in all. */
unsigned host_regions_each(unsigned nodes);
unsigned host_regions_one(unsigned nodes);

/* Node i has region i, as long as nothing is done and nobody lost; otherwise
 * nobody has a first job. */
bool host_regions_first(struct host_work *work, unsigned node,
                        struct incode_job *job);

/* The job of bricks [first, last), with the box of their points. */
struct incode_job host_regions_job(const struct host_order *order,
                                   uint32_t first, uint32_t last);

/* The next range of bricks that nobody has. */
bool host_regions_next(struct host_work *work, unsigned node,
                       struct incode_job *job);

/* The same for the first node that is not lost, and none for others. */
bool host_regions_next_alone(struct host_work *work, unsigned node,
                             struct incode_job *job);

/* What a loss leaves is cut into ranges: some for each node, or for each of
 * those that take jobs, or as large as can be for one. */
void host_regions_lose(struct host_work *work);
void host_regions_lose_among(struct host_work *work, unsigned takers);
void host_regions_lose_alone(struct host_work *work);

/* A brick of the node's own job. */
int host_regions_commit(struct host_work *work, unsigned node, uint32_t brick);

#endif
