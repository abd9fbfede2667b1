/* What is left after nodes were found at fault: ranges of bricks, each done by
 * one node alone with pages from the host, so that a wrong brick names its
 * node.  No user chooses this strategy; audit.h does. */
#include "regions.h"

static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup)
{
    (void)node;
    setup->holders = 0;
    setup->role = NODE_WORKER;
    if (work->ledger->owner_rule == INCODE_OWNER_LOWEST) {
        setup->setup.build = INCODE_BUILD_FACES;
    }
}

const struct host_strategy host_redo = {
    .name = "redo",
    .title = "Bricks done again",
    .help = "each range of bricks by one node alone",
    .regions = host_regions_one,
    .set_up = set_up,
    .first = host_regions_next,
    .next = host_regions_next,
    .commit = host_regions_commit,
    .lose = host_regions_lose,
};
