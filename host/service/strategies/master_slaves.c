/* One face manager and its tetrahedron builders: the paper's master-slaves
 * approach.  The first node that is not lost has the list of faces, the others
 * find their apexes; see README.md. */
#include <math.h>

#include "builders.h"
#include "regions.h"
#include "strategies.h"

/* One list of faces for all: it cannot be faster than its manager, and each
 * face travels twice. */
static struct host_cost cost(const struct host_task *task) {
    unsigned faces = task->sharing.faces_per_job;
    return host_regions_lists_cost(1, faces != 0 ? faces : task->nodes);
}

static int check(unsigned nodes, const struct host_sharing *sharing,
                 enum incode_face_rule rule, struct host_error *error) {
    if (nodes < 2) {
        return host_fail(error, HOST_USAGE,
                         "--strategy master-slaves: needs a face manager and a "
                         "builder; give --nodes 2 or more");
    }
    return host_builders_check("master-slaves", nodes, sharing, rule, error);
}

static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup) {
    const struct host_builders group = host_builders_of_all(work, work->nodes);
    host_builders_set_up(work, &group, node, setup);
}

const struct host_strategy host_master_slaves = {
    .name = "master-slaves",
    .title = "Master-slaves",
    .help = "one node has the list of faces, others find their apexes",
    .owner_rule = INCODE_OWNER_LOWEST,
    .meshes = true,
    .by_faces = true,
    .sharing = HOST_SHARING_BUILDERS | HOST_SHARING_LISTS,
    .check = check,
    .cost = cost,
    .regions = host_regions_one,
    .set_up = set_up,
    .first = host_regions_first,
    .next = host_regions_next_alone,
    .commit = host_regions_commit,
    .lose = host_regions_lose_alone,
};
