#include "builders.h"

#include "incode/paper/builder.h"

/* Two lists for each builder from the start, as in the paper. */
enum { JOBS_PER_WORKER = 2 };

/* How many of the group before this node are there. */
static unsigned place(const struct host_work *work,
                      const struct host_builders *group, unsigned node) {
    unsigned before = 0;
    for (unsigned i = group->first; i < node; i++)
        before += !host_is_lost(work, i);
    return before;
}

static void appoint(const struct host_work *work,
                    const struct host_builders *group, unsigned manager,
                    struct node_setup_message *setup) {
    unsigned left = group->builders, kept = group->holders;
    setup->role = NODE_MANAGER;
    for (unsigned i = manager + 1; i < group->last && left > 0; i++) {
        if (host_is_lost(work, i))
            continue;
        if (kept > 0) {
            kept--;
        } else {
            node_add_builder(setup, i);
            left--;
        }
    }
}

struct host_builders host_builders_of_all(const struct host_work *work,
                                          unsigned faces_per_job) {
    unsigned asked = work->sharing.builders, most = work->nodes - 1;
    unsigned builders = asked != 0 && asked < most ? asked : most;
    bool all = work->living == work->nodes;
    return (struct host_builders){0, work->nodes, all ? most - builders : 0,
                                  builders, faces_per_job};
}

void host_builders_set_up(const struct host_work *work,
                          const struct host_builders *group, unsigned node,
                          struct node_setup_message *setup) {
    const struct host_sharing *sharing = &work->sharing;
    unsigned faces = sharing->faces_per_job != 0 ? sharing->faces_per_job
                                                 : group->faces_per_job;
    unsigned lists = sharing->jobs_per_worker != 0 ? sharing->jobs_per_worker
                                                   : JOBS_PER_WORKER;
    unsigned there = place(work, group, group->last);
    unsigned at = place(work, group, node), manager;
    setup->holders = (uint16_t)group->holders;
    setup->role = NODE_WORKER;
    if (work->living == 1 || there < 2 ||
        at > group->holders + group->builders || host_is_lost(work, node))
        return;
    if (at > 0 && at <= group->holders) {
        setup->role = NODE_HOLDER;
        return;
    }
    manager = host_first_left(work, group->first);
    setup->jobs_per_worker = (uint16_t)lists;
    if (at > 0) {
        setup->role = NODE_BUILDER;
        setup->manager = (uint16_t)manager;
        return;
    }
    setup->faces_per_job =
        (uint16_t)(faces < INCODE_LIST_MAX ? faces : INCODE_LIST_MAX);
    appoint(work, group, manager, setup);
}

int host_builders_check(const char *name, unsigned group,
                        const struct host_sharing *sharing,
                        enum incode_face_rule rule, struct host_error *error) {
    if (rule != INCODE_FACE_OWN) {
        return host_fail(error, HOST_USAGE,
                         "--face-rule paper: asks for points, which a face "
                         "manager of --strategy %s has not; leave it out",
                         name);
    }
    if (sharing->builders >= group) {
        return host_fail(error, HOST_USAGE,
                         "--builders %u: %u nodes have %u beside their face "
                         "manager; give %s%u%s",
                         sharing->builders, group, group - 1,
                         group > 2 ? "1 to " : "", group - 1,
                         group > 2 ? "" : ", or more --nodes");
    }
    return 0;
}
