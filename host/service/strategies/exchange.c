/* A region a node, and one active face list that all share: README.md.  After
 * a loss what is left is completed as in `spatial`, in ranges of bricks, by
 * workers that hear nothing of each other. */
#include <string.h>

#include "host/base/parallel.h"
#include "node/page_check.h"
#include "regions.h"
#include "strategies.h"

enum { PIECES = 2 /* a node, after a loss */ };

struct exchange {
    bool dealt;    /* all nodes have their role */
    uint32_t told; /* first bricks that all nodes have been sent */
    /* Pages [to_all, next) are still to be sent to all. */
    uint32_t to_all, next;
};

static struct host_cost cost(const struct host_task *task) {
    /* Less is built again than in `spatial`, but each tetrahedron at a border
     * is told to others. */
    struct host_cost cost = host_regions_cost(task, 0.5);
    return (struct host_cost){1.08 * cost.busiest, 1.08 * cost.total};
}

/* In this generation: nobody is lost, nothing is done that the others would
 * have to know, and each message has its e-cube way, or one that is held back
 * could hold up the way to the host. */
static bool exchanges(const struct host_work *work) {
    return work->living == work->nodes && !work->goes_round &&
           (work->ledger == NULL || work->ledger->committed == 0);
}

static int check(unsigned nodes, const struct host_sharing *sharing,
                 enum incode_face_rule rule, struct host_error *error) {
    (void)nodes, (void)sharing;
    return rule == INCODE_FACE_OWN
               ? 0
               : host_fail(error, HOST_USAGE,
                           "--face-rule paper: pursues faces that are partly "
                           "in a region, and --strategy exchange gives each "
                           "to one node; leave it out");
}

static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup) {
    (void)node;
    setup->holders = 0;
    setup->role = exchanges(work) ? NODE_EXCHANGE : NODE_WORKER;
    setup->setup.build = INCODE_BUILD_FACES;
}

/* From which page on all nodes are sent all: the first one where each holds
 * them all, or that of a level of boxes where those from there on take up no
 * more than half of its room. */
static uint32_t first_to_all(const struct host_work *work) {
    const struct incode_tree *tree = &work->order->tree;
    uint32_t level = 1;
    if (tree->pages <= work->frames)
        return 0;
    while (level < tree->levels &&
           tree->pages - tree->base[level] > work->frames / 2)
        level++;
    return level < tree->levels ? tree->base[level] : tree->pages;
}

static bool first(struct host_work *work, unsigned node,
                  struct incode_job *job) {
    struct exchange *state = work->state;
    if (exchanges(work) && !state->dealt) {
        state->dealt = true;
        state->to_all = first_to_all(work);
        state->next = work->order->tree.pages;
    }
    return host_regions_first(work, node, job);
}

static bool send_regions(struct host_work *work, struct exchange *state) {
    struct {
        struct node_regions_message head;
        uint32_t first[NODE_REGIONS_A_MESSAGE];
    } message;
    uint32_t count = work->nodes + 1u - state->told;
    if (count > NODE_REGIONS_A_MESSAGE)
        count = NODE_REGIONS_A_MESSAGE;
    message.head = (struct node_regions_message){
        .first = state->told, .count = count, .to_all = state->to_all};
    for (uint32_t i = 0; i < count; i++) {
        uint32_t region = message.head.first + i;
        message.first[i] = region < work->nodes
                               ? work->order->region[region].first
                               : work->order->bricks;
    }
    if (!work->write_to_all(work->context, NODE_REGIONS, &message,
                            sizeof message.head +
                                count * sizeof message.first[0]))
        return false;
    state->told += count;
    return true;
}

/* From the last page down: boxes before what is in them. */
static bool send_page(struct host_work *work, struct exchange *state) {
    struct node_page_message body;
    body.head.page = state->next - 1;
    host_call_trim(sizeof body);
    size_t size = host_page(work->order, body.head.page, body.data);
    if (!work->write_to_all(work->context, NODE_PAGE_TO_ALL, &body,
                            node_page_seal(&body, work->page_key, size)))
        return false;
    state->next--;
    return true;
}

/* What goes to all, in whosever turn. */
static bool send(struct host_work *work, unsigned node) {
    struct exchange *state = work->state;
    (void)node;
    if (!state->dealt)
        return false;
    if (state->told <= work->nodes)
        return send_regions(work, state);
    return state->next > state->to_all && send_page(work, state);
}

static void lose(struct host_work *work) {
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
    .pages_in_a_row = 16, /* a region, or a part: it can begin, and lend them */
    .check = check,
    .cost = cost,
    .regions = host_regions_each,
    .set_up = set_up,
    .first = first,
    .next = host_regions_next,
    .commit = host_regions_commit,
    .lose = lose,
    .send = send,
};
