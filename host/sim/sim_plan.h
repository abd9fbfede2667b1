/* What a seed stands for: a set of points, a cube, its wires, and what goes
 * wrong with it all.  Everything is drawn from the seed and nothing else. */
#ifndef HOST_SIM_PLAN_H
#define HOST_SIM_PLAN_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "transport/drivers/sim.h"
#include "host/mesh/order.h"
#include "host/service/strategies/strategy.h"
#include "incode/triangulator.h"
#include "liar.h"

/* The kinds of faults that a simulated cube meets, a row each: how a seed draws
 * it, what it does, how its strikes are counted.  A new kind is a name here and
 * a row in host_sim_kinds, from which plans are drawn and sums are printed. */

struct host_sim_plan;
struct host_sim_run;

/* Those of a wire by chance, then what happens at a time. */
enum host_sim_fault {
    HOST_SIM_ONE_WAY = SIM_CHANCES, /* a wire brings nothing one way */
    HOST_SIM_CUT,                   /* a wire is closed at both ends */
    HOST_SIM_PARTITION,    /* all wires between two parts of the cube */
    HOST_SIM_PAUSE,        /* a node stands still */
    HOST_SIM_CRASH,        /* a node forgets all and starts again */
    HOST_SIM_SLOW_HOST,    /* its rounds take long, and some very long */
    HOST_SIM_TINY,         /* memories so small that pages are dropped or faces
                              spilled */
    HOST_SIM_DEAD_WIRE,    /* a wire between two nodes breaks for good */
    HOST_SIM_DEAD_NODE,    /* a node, but for node 0, never comes back */
    HOST_SIM_MISSING_WIRE, /* a wire between two nodes was never there */
    HOST_SIM_SECOND_HOST,  /* comes to the cube while it is at work */
    HOST_SIM_IDLER,        /* a node, but for node 0, answers and never works */
    HOST_SIM_FOREIGN,      /* a node tells others of another host's generation,
                              one far away or at an end of the numbers */
    HOST_SIM_SLOW_NODE,  /* nodes work long between two looks at their links */
    HOST_SIM_BARE,       /* serial wires, which never close, between boards
                            that ask who they are whenever they start */
    HOST_SIM_LIAR,       /* a node alters messages of its own: liar.h */
    HOST_SIM_SMALL_HOST, /* the host's memory, so that arrays are put aside:
                            host/base/scratch.h */
    HOST_SIM_FAULTS
};

/* What happens at a time, to one of these. */
struct host_sim_event {
    enum host_sim_fault kind;
    uint64_t lasts_us, until_us;
    unsigned node, link, wire, side;
};

struct host_sim_kind {
    const char *name;
    /* Wanted by one plan in so many; 0: by those that `draw`, or that of the
     * row before it, lets want it when all else is drawn. */
    unsigned one_in;
    void (*draw)(struct host_sim_plan *plan);
    /* At an event's time; false: it is not possible now. */
    bool (*happen)(struct host_sim_run *run,
                   const struct host_sim_event *event);
    /* When the event is over; NULL: it ends by itself. */
    void (*take_back)(struct host_sim_run *run,
                      const struct host_sim_event *event);
    /* Once, when the first event is due: for good. */
    void (*break_for_good)(struct host_sim_run *run);
    /* Strikes while work was open; NULL: the times that it happened then. */
    uint64_t (*count)(const struct host_sim_run *run, enum host_sim_fault kind);
};

extern const struct host_sim_kind host_sim_kinds[HOST_SIM_FAULTS];

/* Before the cube comes up: what is wrong with it from the start, and what
 * befalls its wires and ends at calm_us of the run. */
void host_sim_faults_prepare(struct host_sim_run *run);

/* The work is open: from now on faults happen at their times, and count. */
void host_sim_faults_begin(struct host_sim_run *run);

/* The work is done: what struck goes to the outcome, by kind. */
void host_sim_faults_finish(struct host_sim_run *run);

/* For struct host_world_options; the context is a struct host_sim_run. */
void host_sim_faults_strike(void *run);

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
    } liar;               /* as in struct host_liar */
    uint64_t host_memory; /* bytes of points and tetrahedra that the host may
                             have resident; 0: all */
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
