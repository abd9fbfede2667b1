/* The paper's Linda program: a face manager and the tetrahedron builders that
 * it starts, which share a tuple space (figures 8 and 9); see README.md. */
#include <math.h>

#include "builders.h"
#include "regions.h"
#include "strategies.h"

/* As the authors found best on their workstations. */
enum { FACES_PER_JOB = 30, JOBS_PER_WORKER = 3 };

/* As master-slaves, with more messages for each list. */
static struct host_cost cost(const struct host_task *task) {
    unsigned faces = task->sharing.faces_per_job;
    struct host_cost lists =
        host_regions_lists_cost(1, faces != 0 ? faces : FACES_PER_JOB);
    return (struct host_cost){2 * lists.busiest, 2 * lists.total};
}

static int check(unsigned nodes, const struct host_sharing *sharing,
                 enum incode_face_rule rule, struct host_error *error) {
    if (nodes < 2) {
        return host_fail(error, HOST_USAGE,
                         "--strategy linda: needs a face manager and a "
                         "builder; give --nodes 2 or more");
    }
    return host_builders_check("linda", nodes, sharing, rule, error);
}

/* All that have a share of the tuple space are told who else has one. */
static void set_up(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup) {
    const struct host_sharing *sharing = &work->sharing;
    const struct host_builders group =
        host_builders_of_all(work, FACES_PER_JOB);
    struct node_setup_message own = *setup;
    host_builders_set_up(work, &group, node, &own);
    if (own.role == NODE_WORKER || own.role == NODE_HOLDER) {
        *setup = own;
        return;
    }
    bool builds = own.role == NODE_BUILDER;
    unsigned manager = builds ? own.manager : node;
    host_builders_set_up(work, &group, manager, setup);
    setup->role = builds ? NODE_LINDA_BUILDER : NODE_LINDA_MANAGER;
    setup->manager = (uint16_t)manager;
    if (sharing->jobs_per_worker == 0)
        setup->jobs_per_worker = JOBS_PER_WORKER;
}

const struct host_strategy host_linda = {
    .name = "linda",
    .title = "Linda",
    .help = "master-slaves over a tuple space",
    .linda = "master-slaves",
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
