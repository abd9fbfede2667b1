/* What the parts of spread.h share: judging a node by what it answers, and
 * sending what is due.
 *
 * Memory: struct host_spread.  Work: a pass over the nodes.
 *
 *     spread_judge(spread, 3);
 *     if (spread_orders(spread, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_SPREAD_INTERNAL_H
#define HOST_SPREAD_INTERNAL_H

#include "spread.h"

enum {
    SPREAD_AGAIN_US = 4000000 /* an order that had no effect is repeated */
};

static inline bool spread_wanted(const struct host_spread *spread, unsigned i) {
    return host_node_set_has(&spread->options.nodes, i);
}

static inline bool spread_ended(const struct host_spread_node *node) {
    return node->phase >= HOST_SPREAD_DONE;
}

/* Whether its loader is there, and has not come to its end. */
bool spread_in_loader(const struct host_spread *spread, unsigned i);

/* Whether it was told to start the program that it had, and has not yet. */
bool spread_goes_home(const struct host_spread *spread, unsigned i);

void spread_set(struct host_spread *spread, unsigned i,
                enum host_spread_phase phase);

/* By what the visit knows of it; by what its loader says. */
void spread_judge(struct host_spread *spread, unsigned i);
void spread_hear(struct host_spread *spread, unsigned i,
                 const struct loader_state_message *state);

/* Adds to what is said of a node that fell back its answer to NODE_LOG. */
void spread_explain(struct host_spread *spread, unsigned i);

/* A node that has got no further for too long. */
void spread_expire(struct host_spread *spread, unsigned i);

/* Restarts, beginnings, questions, verifications and starts that are due; the
 * blocks that there is room for. */
int spread_orders(struct host_spread *spread, struct host_error *error);
void spread_blocks(struct host_spread *spread);

#endif
