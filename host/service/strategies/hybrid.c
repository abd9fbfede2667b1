/* Spatial decomposition among clusters of nodes, master-slaves inside each: the
 * paper's hybrid, which it only estimated.  After a loss clusters go on with
 * the nodes that they have left; see README.md. */
#include <math.h>

#include "builders.h"
#include "regions.h"
#include "strategies.h"

enum { CLUSTER = 4 };

static struct host_cost cost(const struct host_task *task) {
    unsigned faces = task->sharing.faces_per_job;
    unsigned cluster =
        task->sharing.cluster != 0 ? task->sharing.cluster : CLUSTER;
    cluster = cluster < task->nodes ? cluster : task->nodes;
    return host_regions_lists_cost(task->nodes / cluster,
                                   faces != 0 ? faces : cluster);
}

static unsigned cluster_of(unsigned nodes, const struct host_sharing *sharing) {
    unsigned cluster = sharing->cluster != 0 ? sharing->cluster : CLUSTER;
    return cluster < nodes ? cluster : nodes;
}

static int check(unsigned nodes, const struct host_sharing *sharing,
                 enum incode_face_rule rule, struct host_error *error) {
    unsigned cluster = sharing->cluster;
    if (nodes < 2) {
        return host_fail(error, HOST_USAGE,
                         "--strategy hybrid: needs a face manager and a "
                         "builder; give --nodes 2 or more");
    }
    if (cluster != 0 &&
        (cluster < 2 || cluster > nodes || (cluster & (cluster - 1)) != 0)) {
        return host_fail(error, HOST_USAGE,
                         "--cluster %u: %u nodes make no such clusters; give "
                         "%s%u%s",
                         cluster, nodes,
                         nodes > 2 ? "a power of two, 2 to " : "", nodes,
                         nodes > 2 ? "" : ", or more --nodes");
    }
    return host_builders_check("hybrid", cluster_of(nodes, sharing), sharing,
                               rule, error);
}

static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup) {
    unsigned cluster = cluster_of(work->nodes, &work->sharing);
    unsigned builders = work->sharing.builders, lowest = node - node % cluster;
    const struct host_builders group = {lowest, lowest + cluster, 0,
                                        builders != 0 ? builders : cluster - 1,
                                        cluster};
    host_builders_set_up(work, &group, node, setup);
}

/* Whether it is the first one that is left of its cluster: the face manager, or
 * a worker where there is no other. */
static bool is_taker(const struct host_work *work, unsigned node) {
    unsigned cluster = cluster_of(work->nodes, &work->sharing);
    return node == host_first_left(work, node - node % cluster);
}

/* The regions of its cluster, for the first node of it. */
static bool first(struct host_work *work, unsigned node,
                  struct incode_job *job) {
    unsigned cluster = cluster_of(work->nodes, &work->sharing);
    struct incode_job more = {0};
    if (node % cluster != 0 || !host_regions_first(work, node, job))
        return false;
    for (unsigned i = node + 1; i < node + cluster; i++) {
        if (!host_regions_first(work, i, &more))
            return false;
        for (int k = 0; k < 3; k++) {
            job->lo[k] = more.lo[k] < job->lo[k] ? more.lo[k] : job->lo[k];
            job->hi[k] = more.hi[k] > job->hi[k] ? more.hi[k] : job->hi[k];
        }
        job->last = more.last;
    }
    return true;
}

/* A builder has no jobs. */
static bool next(struct host_work *work, unsigned node,
                 struct incode_job *job) {
    return is_taker(work, node) && host_regions_next(work, node, job);
}

static void lose(struct host_work *work) {
    unsigned takers = 0;
    for (unsigned i = 0; i < work->nodes; i++)
        takers += !work->lost[i] && is_taker(work, i);
    host_regions_lose_among(work, takers);
}

const struct host_strategy host_hybrid = {
    .name = "hybrid",
    .title = "Hybrid",
    .help = "a region a cluster of nodes, master-slaves in each",
    .owner_rule = INCODE_OWNER_LOWEST,
    .meshes = true,
    .by_faces = true,
    .sharing =
        HOST_SHARING_CLUSTER | HOST_SHARING_BUILDERS | HOST_SHARING_LISTS,
    .check = check,
    .cost = cost,
    .regions = host_regions_each,
    .set_up = set_up,
    .first = first,
    .next = next,
    .commit = host_regions_commit,
    .lose = lose,
};
