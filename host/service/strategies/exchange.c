/* A region a node, and one active face list that all share: EXCHANGE.md.  After
 * a loss what is left is completed as in `spatial`, in ranges of bricks, by
 * workers that hear nothing of each other. */
#include <string.h>

#include "regions.h"
#include "strategies.h"

enum {
    PIECES = 2, /* a node, after a loss */
    NODES_MAX = 1 << CUBE_DIMENSION_MAX
};

/* How many first bricks each node has been sent. */
struct exchange {
    uint16_t told[NODES_MAX];
};

static struct host_cost cost(const struct host_task *task)
{
    /* Less is built again than in `spatial`, but each tetrahedron at a border
     * is told to others. */
    struct host_cost cost = host_regions_cost(task, 0.5);
    return (struct host_cost){1.08 * cost.busiest, 1.08 * cost.total};
}

static unsigned regions(unsigned nodes)
{
    return nodes;
}

/* In this generation: nobody is lost, and nothing is done that the others would
 * have to know. */
static bool exchanges(const struct host_work *work)
{
    return work->living == work->nodes &&
           (work->ledger == NULL || work->ledger->committed == 0);
}

static int check(unsigned nodes, const struct host_sharing *sharing,
                 enum incode_face_rule rule, struct host_error *error)
{
    (void)nodes, (void)sharing;
    return rule == INCODE_FACE_OWN
               ? 0
               : host_fail(error, HOST_USAGE,
                           "--face-rule paper: pursues faces that are partly "
                           "in a region, and --strategy exchange gives each "
                           "to one node; leave it out");
}

static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup)
{
    (void)node;
    setup->holders = 0;
    setup->role = exchanges(work) ? NODE_EXCHANGE : NODE_WORKER;
    setup->setup.build = INCODE_BUILD_FACES;
}

static bool send(struct host_work *work, unsigned node)
{
    struct exchange *state = work->state;
    struct {
        struct node_regions_message head;
        uint32_t first[NODE_REGIONS_A_MESSAGE];
    } message;
    uint32_t count = work->nodes + 1u - state->told[node];
    if (count == 0 || !exchanges(work)) {
        return false;
    }
    if (count > NODE_REGIONS_A_MESSAGE) {
        count = NODE_REGIONS_A_MESSAGE;
    }
    message.head.first = state->told[node];
    message.head.count = count;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t region = message.head.first + i;
        message.first[i] = region < work->nodes
                               ? work->order->region[region].first
                               : work->order->bricks;
    }
    if (!work->write(work->context, node, NODE_REGIONS, &message,
                     sizeof message.head + count * sizeof message.first[0])) {
        return false;
    }
    state->told[node] = (uint16_t)(state->told[node] + count);
    return true;
}

static void lose(struct host_work *work)
{
    uint32_t pieces = work->living > 1 ? PIECES * work->living : 1;
    (void)host_ledger_abandon(work->ledger, pieces, work->order, work->tets);
    memset(work->state, 0, sizeof(struct exchange));
}

const struct host_strategy host_exchange = {
    .name = "exchange",
    .title = "Face exchange",
    .help = "a region a node, faces cross borders",
    .state_bytes = sizeof(struct exchange),
    .owner_rule = INCODE_OWNER_LOWEST,
    .meshes = true,
    .by_faces = true,
    .helps = true,
    .check = check,
    .cost = cost,
    .regions = regions,
    .set_up = set_up,
    .first = host_regions_first,
    .next = host_regions_next,
    .commit = host_regions_commit,
    .lose = lose,
    .send = send,
};
