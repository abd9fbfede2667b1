/* A region a node, all at once: the paper's spatial decomposition.  After a
 * loss what is left is given to whoever is free, in ranges of bricks. */
#include "regions.h"
#include "strategies.h"

/* Ranges a node after a loss: they differ in work, and whoever is free takes
 * the next; but each has a border, which is worked on from both sides. */
enum { PIECES = 2 };

static double cost(const struct host_task *task)
{
    return 1.0 / task->nodes;
}

static unsigned regions(unsigned nodes)
{
    return nodes;
}

static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup)
{
    (void)work, (void)node;
    setup->holders = 0;
    setup->role = NODE_WORKER;
}

static void lose(struct host_work *work)
{
    uint32_t pieces = work->living > 1 ? PIECES * work->living : 1;
    (void)host_ledger_abandon(work->ledger, pieces, work->order, work->tets);
}

const struct host_strategy host_spatial = {
    .name = "spatial",
    .title = "Spatial decomposition",
    .help = "a region a node",
    .cost = cost,
    .regions = regions,
    .set_up = set_up,
    .first = host_regions_first,
    .next = host_regions_next,
    .commit = host_regions_commit,
    .lose = lose,
};
