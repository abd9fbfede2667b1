/* The paper's spatial decomposition over Linda: regions as tuples.  The first
 * node that is not lost, the keeper, is sent a few at a time to put into the
 * space; whoever has taken one is given it as its job; see README.md. */
#include <string.h>

#include "regions.h"
#include "strategies.h"

enum { NODES_MAX = NODE_BUILDERS_MAX + 1 };

struct state {
    bool dealt;         /* all nodes have their setup */
    bool waits;         /* `next` is to be put */
    unsigned region;    /* of the order, the next that is */
    unsigned out_count; /* put, and nobody is known to have taken them */
    struct incode_job next, out[NODE_OUT_MAX];
    struct {
        bool due; /* it has taken that job, and has not got it */
        struct incode_job job;
    } node[NODES_MAX];
};

static struct host_cost cost(const struct host_task *task) {
    struct host_cost cost = host_regions_cost(task, 2.2);
    return (struct host_cost){1.1 * cost.busiest, 1.1 * cost.total};
}

/* One by itself needs no space. */
static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup) {
    (void)node;
    setup->holders = 0;
    setup->role = NODE_WORKER;
    if (work->living == 1)
        return;
    setup->role = NODE_LINDA_WORKER;
    setup->manager = (uint16_t)host_first_left(work, 0);
    setup->faces_per_job = setup->jobs_per_worker = 1;
    for (unsigned i = setup->manager + 1u; i < work->nodes; i++)
        if (!host_is_lost(work, i))
            node_add_builder(setup, i);
}

static bool first(struct host_work *work, unsigned node,
                  struct incode_job *job) {
    struct state *s = work->state;
    s->dealt = true;
    return work->nodes == 1 && host_regions_first(work, node, job);
}

static bool next(struct host_work *work, unsigned node,
                 struct incode_job *job) {
    struct state *s = work->state;
    if (work->living == 1)
        return host_regions_next(work, node, job);
    bool due = s->node[node].due;
    if (due) {
        *job = s->node[node].job;
        s->node[node].due = false;
    }
    return due;
}

/* A region of the order, as long as nothing is done; then what is left. */
static bool find_next(struct host_work *work, struct state *s) {
    if (!s->waits) {
        s->waits = host_regions_first(work, s->region, &s->next) ||
                   host_regions_next(work, 0, &s->next);
        s->region++;
    }
    return s->waits;
}

static bool send(struct host_work *work, unsigned node) {
    struct state *s = work->state;
    if (!s->dealt || work->living == 1 || node != host_first_left(work, 0) ||
        s->out_count == NODE_OUT_MAX || !find_next(work, s) ||
        !work->write(work->context, node, NODE_OUT, &s->next, sizeof s->next))
        return false;
    s->out[s->out_count++] = s->next;
    s->waits = false;
    return true;
}

static int take(struct host_work *work, const struct cube_message *message,
                struct host_error *error) {
    struct state *s = work->state;
    struct node_taken_message m;
    if (message->type != NODE_TAKEN)
        return -1;
    unsigned i = 0;
    if (message->size == sizeof m) {
        memcpy(&m, message->data, sizeof m);
        while (i < s->out_count && (s->out[i].first != m.taken.first ||
                                    s->out[i].last != m.taken.last))
            i++;
    }
    if (message->size != sizeof m ||
        message->source != host_first_left(work, 0) ||
        m.taken.node >= work->nodes || host_is_lost(work, m.taken.node) ||
        s->node[m.taken.node].due || i == s->out_count) {
        return host_fail(error, HOST_CUBE,
                         "node %u: a region was taken that nobody put",
                         message->source);
    }
    s->node[m.taken.node].due = true;
    s->node[m.taken.node].job = s->out[i];
    s->out[i] = s->out[--s->out_count];
    return 0;
}

static bool owes(const struct host_work *work, unsigned node) {
    const struct state *s = work->state;
    return s->out_count > 0 && node == host_first_left(work, 0);
}

static void lose(struct host_work *work) {
    struct state *s = work->state;
    memset(s, 0, sizeof *s);
    host_regions_lose(work);
}

const struct host_strategy host_linda_spatial = {
    .name = "linda-spatial",
    .title = "Linda, spatial decomposition",
    .help = "a region a node, taken from a tuple space",
    .linda = "spatial",
    .state_bytes = sizeof(struct state),
    .meshes = true,
    .cost = cost,
    .regions = host_regions_each,
    .set_up = set_up,
    .first = first,
    .next = next,
    .commit = host_regions_commit,
    .lose = lose,
    .send = send,
    .take = take,
    .owes = owes,
};
