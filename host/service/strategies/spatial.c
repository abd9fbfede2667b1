/* A region a node, all at once: the paper's spatial decomposition.  After a
 * loss what is left is given to whoever is free, in ranges of bricks; see
 * README.md. */
#include "regions.h"
#include "strategies.h"

static struct host_cost cost(const struct host_task *task) {
    return host_regions_cost(task, 2.2);
}

static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup) {
    (void)work, (void)node;
    setup->holders = 0;
    setup->role = NODE_WORKER;
}

const struct host_strategy host_spatial = {
    .name = "spatial",
    .title = "Spatial decomposition",
    .help = "a region a node",
    .cost = cost,
    .regions = host_regions_each,
    .set_up = set_up,
    .first = host_regions_first,
    .next = host_regions_next,
    .commit = host_regions_commit,
    .lose = host_regions_lose,
};
