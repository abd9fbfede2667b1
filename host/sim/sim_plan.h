/* What a seed stands for: a set of points, a cube, its wires, and what goes
 * wrong with it all.  Everything is drawn from the seed and nothing else.
 *
 * Memory: the struct.  Work: none to speak of.
 *
 *     host_sim_plan_draw(&plan, seed, 0);
 *     host_sim_plan_print(stdout, &plan);
 *     host_sim_run(&plan, &outcome, &error);
 */
#ifndef HOST_SIM_PLAN_H
#define HOST_SIM_PLAN_H

#include <stdio.h>

#include "host/order/order.h"
#include "sim_world.h"

/* Kinds of faults: those of a line by chance, then what happens at a time. */
enum host_sim_fault {
    HOST_SIM_ONE_WAY = SIM_CHANCES, /* a line brings nothing any more */
    HOST_SIM_CUT,                   /* a wire is closed at both ends */
    HOST_SIM_PARTITION, /* all wires between two parts of the cube */
    HOST_SIM_PAUSE,     /* a node stands still */
    HOST_SIM_CRASH,     /* a node forgets all and starts again */
    HOST_SIM_SLOW_HOST,
    HOST_SIM_TINY, /* memories so small that pages are dropped or faces spilled
                    */
    HOST_SIM_DEAD_WIRE,    /* a wire between two nodes breaks for good */
    HOST_SIM_DEAD_NODE,    /* a node, but for node 0, never comes back */
    HOST_SIM_MISSING_WIRE, /* a wire between two nodes was never there */
    HOST_SIM_SECOND_HOST,  /* knocks at the cube while it is at work */
    HOST_SIM_FAULTS
};

extern const char *const host_sim_fault_names[HOST_SIM_FAULTS];

struct host_sim_plan {
    uint64_t seed;
    unsigned nodes_given; /* by the caller; 0: drawn */
    /* The work. */
    const char *kind; /* of points: gen.h */
    uint64_t points;
    bool sequential;
    enum host_partition partition;
    enum incode_index index;
    enum incode_face_rule face_rule;
    uint64_t shuffle_seed;
    /* The cube. */
    unsigned nodes, window, host_window;
    uint64_t memory_more; /* bytes a node beyond the least that works */
    struct sim_quality wire, host_wire;
    uint32_t gather_us, step_us, host_us;
    /* What goes wrong. */
    bool wanted[HOST_SIM_FAULTS];
    struct sim_faults weather; /* of the lines that have any */
    bool early;                /* before the cube is up, too */
    uint32_t gap_us;           /* between two events, more or less */
    uint32_t lasts_us_max;     /* each of them */
    unsigned events_max;
    /* A link that is silent so long is given up; 0: none is.  Patience with a
     * node that is silent; 0: the host's own. */
    uint32_t dead_us;
    uint64_t patience_us;
    uint64_t calm_us; /* after the work began: no more faults */
    unsigned missing; /* wires that were never there */
    uint8_t absent_s; /* as in struct host_machine */
    /* When a second host comes, after the work began, and when it goes by
     * itself. */
    uint64_t knock_us, knock_lasts_us;
    /* One fault alone, at frame `frame` of all that are sent: what becomes of
     * it, or a restart of the node that sends it.  0: none. */
    uint64_t frame;
    enum sim_fate fate;
    bool restart;
    unsigned restart_node; /* its own frames are counted */
};

/* nodes: 0 where the seed decides. */
void host_sim_plan_draw(struct host_sim_plan *plan, uint64_t seed,
                        unsigned nodes);

/* A line for people. */
void host_sim_plan_print(FILE *file, const struct host_sim_plan *plan);

#endif
