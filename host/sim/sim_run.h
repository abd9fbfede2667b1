/* A simulated run at work, as sim.c and sim_faults.c share it. */
#ifndef HOST_SIM_RUN_H
#define HOST_SIM_RUN_H

#include "host/base/parallel.h"
#include "host/base/scratch.h"
#include "host/mesh/points.h"
#include "host/service/service.h"
#include "second_host.h"
#include "sim.h"

enum { HOST_SIM_LASTING_MAX = 32 }; /* faults that are to be taken back */

struct host_sim_run {
    const struct host_sim_plan *plan;
    struct host_sim_outcome *outcome;
    struct host_world world;
    struct host_service service;
    struct host_second_host second;
    struct host_points points;
    struct host_order order;
    struct host_tetrahedra tets;
    struct host_liar liar;
    struct host_call call; /* of a small host, with what it puts aside */
    struct host_scratch scratch;
    uint64_t random;
    /* By the world's clock: no more faults; the next event; a second host. */
    uint64_t calm_us, event_us, second_us;
    uint64_t idler_us, teller_us; /* one comes, or goes */
    bool telling;
    unsigned events; /* left */
    bool open, crash_due, broken;
    uint64_t frames;                    /* seen by `decide` */
    uint64_t before[SIM_CHANCES];       /* strikes before work was open, */
    uint64_t happened[HOST_SIM_FAULTS]; /* and events since */
    struct host_sim_event lasting[HOST_SIM_LASTING_MAX];
    unsigned lasting_count;
};

#endif
