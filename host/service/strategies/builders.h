/* What strategies share that have face managers and tetrahedron builders: which
 * of some nodes is which, and what a user may say of it. */
#ifndef HOST_BUILDERS_H
#define HOST_BUILDERS_H

#include "strategy.h"

/* Of nodes first .. last - 1 that are not lost, the first is the manager, the
 * next ones, as many as `holders`, keep pages, those after them, as many as
 * `builders`, build, and what is left stands idle. */
struct host_builders {
    unsigned first, last, holders, builders;
    unsigned faces_per_job; /* where the user has not said: within limits */
};

/* All nodes as one group: those who neither manage nor build keep pages, as
 * long as nobody is lost. */
struct host_builders host_builders_of_all(const struct host_work *work,
                                          unsigned faces_per_job);

/* Its role, and what goes with it, `holders` included: that of a worker where
 * it is idle, or where there is nobody else. */
void host_builders_set_up(const struct host_work *work,
                          const struct host_builders *group, unsigned node,
                          struct node_setup_message *setup);

/* What both strategies refuse, for groups of so many nodes; name: theirs. */
int host_builders_check(const char *name, unsigned group,
                        const struct host_sharing *sharing,
                        enum incode_face_rule rule, struct host_error *error);

#endif
