/* Numbers drawn from a state of one's own: as transport/drivers/sim.h draws,
 * the same on every machine.
 *
 * Memory: the state.  Work: a few operations a draw, and one a doubling.
 *
 *     uint64_t state = sim_seed(17, 2);
 *     unsigned node = (unsigned)host_sim_draw(&state, 0, 7);
 *     uint64_t us = host_sim_draw_log(&state, 1000, 1000000);
 */
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
    while (lo << doublings < hi) {
        doublings++;
    }
    uint64_t top = lo << host_sim_draw(state, 0, doublings);
    return host_sim_draw(state, lo, top < hi ? top : hi);
}

#endif
