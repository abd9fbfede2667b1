/* Numbers drawn from a state of one's own: as transport/drivers/sim.h draws,
 * the same on every machine. */
#ifndef HOST_SIM_DRAW_H
#define HOST_SIM_DRAW_H

#include "transport/drivers/sim.h"

/* Uniform from lo to hi, both included. */
static inline uint64_t host_sim_draw(uint64_t *state, uint64_t lo,
                                     uint64_t hi) {
    return lo + (sim_draw(state) >> 16) % (hi - lo + 1);
}

/* The same over orders of magnitude; lo is not 0. */
static inline uint64_t host_sim_draw_log(uint64_t *state, uint64_t lo,
                                         uint64_t hi) {
    unsigned doublings = 0;
    while (lo << doublings < hi)
        doublings++;
    uint64_t top = lo << host_sim_draw(state, 0, doublings);
    return host_sim_draw(state, lo, top < hi ? top : hi);
}

#endif
