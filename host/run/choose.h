/* Chooses what a run's options leave open: the number of nodes, the strategy,
 * and whether nodes may insert points.  `auto` chooses twice: before the points
 * are ordered, as if they filled a volume evenly, for the order is cut into
 * regions; and again when a sample of their bricks shows whether they do.
 *
 * Memory: 1 MB, while it works.  Work: a thousand bricks; if they fill no
 * volume evenly, and the triangulation does not fit a node, 2,500 insertions
 * (host/mesh/order.h). */
#ifndef HOST_CHOOSE_H
#define HOST_CHOOSE_H

#include "run.h"

/* The memory that a run's nodes need: 0, or HOST_USAGE if the options give
 * less; the error says what can be done. */
int host_memory_check(const struct host_run_options *options,
                      const struct host_strategy *strategy, unsigned nodes,
                      uint32_t bricks, const uint32_t cells[3],
                      struct host_error *error);

/* Bytes of a point that may be put aside. */
uint64_t host_memory_aside(const struct host_run_options *options);

/* Fills in the result's strategy, nodes and what else is as in the options. */
void host_choose(const struct host_run_options *options, uint64_t points,
                 struct host_run_result *result);

/* Chooses how nodes build, and lets `auto` choose again, by the order, which
 * has a region for each node.  True if the strategy is another one now.  If
 * that strategy works on one region, the regions are joined; then it gets one
 * node, unless the options give their number. */
bool host_choose_ordered(const struct host_run_options *options,
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
