/* The memory that a run's nodes need, and what is said where they have less.
 *
 * Memory: none.  Work: some hundred times that of a strategy's set_up for all
 * nodes.
 *
 *     fits = host_memory_fits(&options, strategy, 8, 1, no_cells);
 *     if (host_memory_check(&options, strategy, 8, bricks, cells, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_MEMORY_NEEDED_H
#define HOST_MEMORY_NEEDED_H

#include "run.h"

/* Whether every node does with the memory of the options.  bricks, cells: of
 * the order, where it is known; else 1 and none. */
bool host_memory_fits(const struct host_run_options *options,
                      const struct host_strategy *strategy, unsigned nodes,
                      uint32_t bricks, const uint32_t cells[3]);

/* 0, or HOST_USAGE: the options give less, and what can be done. */
int host_memory_check(const struct host_run_options *options,
                      const struct host_strategy *strategy, unsigned nodes,
                      uint32_t bricks, const uint32_t cells[3],
                      struct host_error *error);

#endif
