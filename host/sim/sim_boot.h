/* How a node of a simulated cube starts: told who it is, or, as on a bare
 * board, asking its neighbours.
 *
 * Memory: the node's.  Work: that of node_start, or of a look at its wires.
 *
 *     host_sim_boot(world, node);
 *     while (world->node[node].learning)
 *         host_sim_learn(world, node);
 */
#ifndef HOST_SIM_BOOT_H
#define HOST_SIM_BOOT_H

#include "sim_world.h"

/* What its memory holds before is chance. */
void host_sim_boot(struct host_world *world, unsigned node);

/* Asks, if it is time, and listens: one that has been told starts as who it
 * is. */
void host_sim_learn(struct host_world *world, unsigned node);

#endif
