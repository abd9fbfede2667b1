/* What a run's options leave open: how many nodes, by which strategy, and
 * whether they may insert points.  `auto` is settled twice: before the points
 * are ordered, as if they filled a volume evenly, for the order is cut into
 * regions; and once more when their bricks tell whether they do.
 *
 * Memory: 1 MB, while it works.  Work: a look at a thousand bricks; where they
 * do not, and the triangulation does not fit a node, 2,500 insertions
 * (host/mesh/order.h). */
#ifndef HOST_SETTLE_H
#define HOST_SETTLE_H

#include "run.h"

/* The memory that a run's nodes need, and what is said where they have less.
 */

/* 0, or HOST_USAGE: the options give less, and what can be done. */
int host_memory_check(const struct host_run_options *options,
                      const struct host_strategy *strategy, unsigned nodes,
                      uint32_t bricks, const uint32_t cells[3],
                      struct host_error *error);

/* Fills in the result's strategy, nodes and what else is as in the options. */
void host_settle(const struct host_run_options *options, uint64_t points,
                 struct host_run_result *result);

/* Settles the way to build, and `auto` again, by the order, which has a region
 * for each node; true where it has another strategy now.  The regions are
 * joined if that wants one alone; and then it gets one node alone, if nobody
 * has said how many. */
bool host_settle_ordered(const struct host_run_options *options,
                         struct host_order *order,
                         struct host_run_result *result);

/* `incode run --cube FILE`: a run on nodes that are wired as a cube file says.
 */

/* Reads options->cube and makes these options those of its cube, on whose
 * nodes host_run will be.  0, HOST_USAGE for options that do not fit that
 * cube, or what host_cube_file_read says.  Once a program. */
int host_run_on_cube(struct host_run_options *options,
                     struct host_error *error);

#endif
