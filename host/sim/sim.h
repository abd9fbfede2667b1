/* `incode sim`: host, nodes and links as they are, in one process and one
 * thread, in virtual time, from one seed.  Faults strike, then they stop, and
 * the result must be that of the triangulator alone.  Where a node lies, and
 * all through, a run may give up instead, if it names that node. */
#ifndef HOST_SIM_H
#define HOST_SIM_H

#include "host/mesh/tetrahedra.h"
#include "sim_plan.h"

struct host_sim_outcome {
    uint64_t trace;  /* of all that went over the wires */
    uint64_t frames; /* sent on all wires */
    uint64_t steps, time_us, work_us;
    uint64_t struck[HOST_SIM_FAULTS]; /* while work was open */
    uint64_t node_frames[16];         /* sent by the first nodes */
    unsigned restarts;
    struct host_digest digest;
};

/* 0; HOST_UNVERIFIED for another result than the right one, HOST_CUBE where
 * the run did not end or a node failed, HOST_BROKEN for what was left behind.
 */
int host_sim_run(const struct host_sim_plan *plan,
                 struct host_sim_outcome *outcome, struct host_error *error);

enum { HOST_SIM_RANGES_MAX = 64 };

struct host_sim_options {
    /* Seeds first .. last, each with a line of its own. */
    struct {
        uint64_t first, last;
    } range[HOST_SIM_RANGES_MAX];
    unsigned ranges;
    unsigned nodes;       /* 0: the seeds decide */
    uint64_t seconds_max; /* of processor time: then no seed is begun; or 0 */
};

/* The command's arguments.  Wrong usage: HOST_USAGE, as in arguments.h. */
int host_sim_arguments(int argc, char **argv, struct host_sim_options *options,
                       struct host_error *error);

/* The command.  Each seed's line says which faults struck, a table at the end
 * how often each kind did, and in how many seeds.  A failure prints the command
 * that replays it. */
int host_sim_seeds(const struct host_sim_options *options,
                   struct host_error *error);

#endif
