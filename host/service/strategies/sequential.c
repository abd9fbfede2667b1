/* One node computes, and the others keep pages for it: node 0, and after a loss
 * the first that is there, which then has pages from the host alone; see
 * README.md. */
#include "regions.h"
#include "strategies.h"

static struct host_cost cost(const struct host_task *task) {
    (void)task;
    return (struct host_cost){1.0, 1.0};
}

static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup) {
    bool all = work->living == work->nodes;
    setup->holders = (uint16_t)(all ? work->nodes - 1 : 0);
    setup->role = all && node > 0 ? NODE_HOLDER : NODE_WORKER;
}

const struct host_strategy host_sequential = {
    .name = "sequential",
    .title = "Sequential",
    .help = "one node computes, others hold pages",
    .nodes_default = 1,
    .cost = cost,
    .regions = host_regions_one,
    .set_up = set_up,
    .first = host_regions_first,
    .next = host_regions_next_alone,
    .commit = host_regions_commit,
    .lose = host_regions_lose_alone,
};
