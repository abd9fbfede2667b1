/* The table of strategies, from which options, help, messages, statistics and
 * the simulator have them, and the choice of `auto` among them. */
#ifndef HOST_STRATEGIES_H
#define HOST_STRATEGIES_H

#include "node/node.h"
#include "strategy.h"

/* A row a strategy: host_NAME of a file of this room, in the order in which
 * they are listed. */
#define HOST_STRATEGIES(ROW)                                                   \
    ROW(sequential)                                                            \
    ROW(spatial)                                                               \
    ROW(exchange)                                                              \
    ROW(master_slaves)                                                         \
    ROW(hybrid)                                                                \
    ROW(linda)                                                                 \
    ROW(linda_spatial)

#define HOST_STRATEGY_DECLARE(name)                                            \
    extern const struct host_strategy host_##name;
HOST_STRATEGIES(HOST_STRATEGY_DECLARE)
/* In no row: the strategy that the service goes on with after a fault. */
HOST_STRATEGY_DECLARE(redo)

/* Row i of the table; NULL past the last. */
const struct host_strategy *host_strategy_row(unsigned i);

/* The Linda programs among them: row i of those, and its name in --linda; NULL
 * past the last. */
const struct host_strategy *host_strategy_linda(unsigned i);
const char *host_linda_name(unsigned i);

/* NULL where there is none of that name. */
const struct host_strategy *host_strategy_named(const char *name);

/* How points are cut into regions where `asked` is wished for: by what will be
 * owned, not by points, where the lowest vertex owns. */
enum host_partition
host_strategy_partition(const struct host_strategy *strategy,
                        enum host_partition asked);

/* 0, or HOST_USAGE with the error where it cannot be run so. */
int host_strategy_check(const struct host_strategy *strategy, unsigned nodes,
                        const struct host_sharing *sharing,
                        enum incode_face_rule rule, enum incode_build build,
                        struct host_error *error);

/* Time that a strategy is expected to take, in that of one node alone with a
 * fast wire: that of the busiest node, of the processors that the nodes share,
 * with the host or without, or of the host's wire, whichever is longest;
 * INFINITY where it cannot be run so. */
double host_strategy_time(const struct host_strategy *strategy,
                          const struct host_task *task);

/* The one that takes least; of equals the first in the table. */
const struct host_strategy *host_strategy_auto(const struct host_task *task);

/* Why, in a line: what each is expected to take. */
enum { HOST_WHY_BYTES = 240 };
void host_strategy_why(const struct host_task *task, char text[HOST_WHY_BYTES]);

/* Bytes of arena with which any node of a cube does, whatever its role: `given`
 * is the setup but for what the strategy fills in, and identity that of the
 * node with the most links; memory as in node_arena_needed.  Losses do not
 * change that. */
size_t host_strategy_arena(const struct host_strategy *strategy, unsigned nodes,
                           const struct node_identity *identity, size_t memory,
                           const struct host_sharing *sharing,
                           const struct node_setup_message *given);

/* What a user may ask for: the names of the rows, and "auto" behind them, with
 * a few words on each; NULL past the last. */
const char *host_strategy_name(unsigned i);
const char *host_strategy_help(unsigned i);

#endif
