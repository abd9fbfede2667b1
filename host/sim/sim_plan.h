/* What a seed stands for: a set of points, a cube, its wires, and what goes
 * wrong with it all.  Everything is drawn from the seed and nothing else.
 *
 * Memory: the struct.  Work: none to speak of.
 *
 *     host_sim_plan_draw(&plan, 17, 0);
 *     host_sim_plan_print(stdout, &plan);
 */
#ifndef HOST_SIM_PLAN_H
#define HOST_SIM_PLAN_H

#include <stdio.h>

#include "host/mesh/order.h"
#include "host/service/strategies/strategy.h"
#include "incode/triangulator.h"
#include "liar.h"
#include "sim_faults.h"

struct host_sim_plan {
    uint64_t seed;
    unsigned nodes_given; /* by the caller; 0: drawn */
    /* The work. */
    const char *kind; /* of points: gen.h */
    uint64_t points;
    const struct host_strategy *strategy;
    struct host_sharing sharing;
    enum host_partition partition;
    enum incode_index index;
    enum incode_face_rule face_rule;
    enum incode_build build;
    uint64_t shuffle_seed;
    /* The cube. */
    unsigned nodes, window, host_window;
    uint64_t memory_more; /* bytes a node beyond the least that works */
    struct sim_quality wire, host_wire;
    uint32_t gather_us, step_us, host_us;
    uint32_t look_us;     /* as in struct host_world_options */
    uint32_t serial_baud; /* that nodes and host are told of; 0: none */
    /* What goes wrong. */
    bool wanted[HOST_SIM_FAULTS];
    struct sim_faults weather; /* of the wires that have any */
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
    uint64_t second_us, second_lasts_us;
    /* When something else stands at a node's place, after the work began, and
     * for how long.  0: from the start. */
    struct host_sim_stand_in {
        unsigned node;
        uint64_t us, lasts_us;
    } idler, teller;
    bool idler_ready;   /* it answers its setup, too */
    uint32_t foreign;   /* generation of which the teller tells, */
    bool foreign_jumps; /* counted from the present one */
    struct host_sim_liar {
        unsigned node;
        enum host_lie way;
        uint32_t one_in;
    } liar; /* as in struct host_liar */
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
