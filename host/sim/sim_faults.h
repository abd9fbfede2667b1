/* The kinds of faults that a simulated cube meets, a row each: how a seed draws
 * it, what it does, how its strikes are counted.  A new kind is a name here and
 * a row in host_sim_kinds, from which plans are drawn and sums are printed.
 *
 * Memory: the table.  Work: a step a fault.
 *
 *     for (int k = 0; k < HOST_SIM_FAULTS; k++)
 *         puts(host_sim_kinds[k].name);
 */
#ifndef HOST_SIM_FAULTS_H
#define HOST_SIM_FAULTS_H

#include <stdbool.h>
#include <stdint.h>

#include "transport/drivers/sim.h"

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
    HOST_SIM_SLOW_NODE, /* nodes work long between two looks at their links */
    HOST_SIM_BARE,      /* serial wires, which never close, between boards
                           that ask who they are whenever they start */
    HOST_SIM_LIAR,      /* a node alters messages of its own: liar.h */
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

#endif
