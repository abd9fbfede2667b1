/* Faults for which something else stands at a node's place (stand_in.h): how a
 * plan draws them, and when they come and go. */
#ifndef HOST_SIM_STAND_INS_H
#define HOST_SIM_STAND_INS_H

#include "sim_run.h"

/* For the table of kinds. */
void host_sim_draw_idler(struct host_sim_plan *plan);
void host_sim_draw_teller(struct host_sim_plan *plan);

/* Before the cube comes up: what is there from the start. */
void host_sim_stand_ins_prepare(struct host_sim_run *run);

/* The work is open: what comes now, comes in its time. */
void host_sim_stand_ins_begin(struct host_sim_run *run);

/* The work is done: nothing comes any more. */
void host_sim_stand_ins_finish(struct host_sim_run *run);

/* When the next comes or goes, and what happens then. */
uint64_t host_sim_stand_ins_us(const struct host_sim_run *run);
void host_sim_stand_ins_strike(struct host_sim_run *run);

#endif
