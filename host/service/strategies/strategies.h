/* The table of strategies, from which options, help, messages, statistics and
 * the simulator have them, and the choice of `auto` among them.
 *
 * Memory: the table.  Work: a pass over it.
 *
 *     strategy = host_strategy_named("spatial");
 *     for (unsigned i = 0; host_strategy_name(i) != NULL; i++)
 *         printf("%s: %s\n", host_strategy_name(i), host_strategy_help(i));
 */
#ifndef HOST_STRATEGIES_H
#define HOST_STRATEGIES_H

#include "node/node.h"
#include "strategy.h"

/* A row a strategy: host_NAME of a file of this room, in the order in which
 * they are listed. */
#define HOST_STRATEGIES(ROW)                                                   \
    ROW(sequential)                                                            \
    ROW(spatial)

#define HOST_STRATEGY_DECLARE(name)                                            \
    extern const struct host_strategy host_##name;
HOST_STRATEGIES(HOST_STRATEGY_DECLARE)

/* Row i of the table; NULL past the last. */
const struct host_strategy *host_strategy_row(unsigned i);

/* NULL where there is none of that name. */
const struct host_strategy *host_strategy_named(const char *name);

/* The one that costs least; of equals the first in the table. */
const struct host_strategy *host_strategy_auto(const struct host_task *task);

/* Bytes of arena with which any node of a cube does, whatever its role: `given`
 * is the setup but for what the strategy fills in, and identity that of the
 * node with the most links; memory as in node_arena_needed. */
size_t host_strategy_arena(const struct host_strategy *strategy, unsigned nodes,
                           const struct node_identity *identity, size_t memory,
                           const struct node_setup_message *given);

/* What a user may ask for: the names of the rows, and "auto" behind them, with
 * a few words on each; NULL past the last. */
const char *host_strategy_name(unsigned i);
const char *host_strategy_help(unsigned i);

/* Names that other versions know, with a comma before and after each. */
extern const char host_strategies_elsewhere[];

#endif
