/* The strategy after a fault: ranges of bricks, each done by one node alone
 * with pages from the host, so that a wrong brick names its node.  As long as
 * there are two nodes, a brick is not given to the node that committed it last.
 * audit.h chooses this strategy; the user cannot. */
#include "regions.h"

static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup) {
    (void)node;
    setup->holders = 0;
    setup->role = NODE_WORKER;
    if (work->ledger->owner_rule == INCODE_OWNER_LOWEST)
        setup->setup.build = INCODE_BUILD_FACES;
}

/* The part of the next range that this node may do. */
static bool next(struct host_work *work, unsigned node,
                 struct incode_job *job) {
    struct host_ledger *ledger = work->ledger;
    uint32_t first, last, end;
    if (!host_ledger_next(ledger, work->order, &first, &last))
        return false;
    end = first;
    while (end < last &&
           (work->living == 1 || host_ledger_by(ledger, end) != node))
        end++;
    ledger->cursor = end;
    if (end > first)
        *job = host_regions_job(work->order, first, end);
    return end > first;
}

const struct host_strategy host_redo = {
    .name = "redo",
    .title = "Bricks done again",
    .help = "each range of bricks by one node alone",
    .regions = host_regions_one,
    .set_up = set_up,
    .first = next,
    .next = next,
    .commit = host_regions_commit,
    .lose = host_regions_lose,
};
