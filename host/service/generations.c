#include "generations.h"

#include "failure_detector.h"
#include "missing_links.h"
#include "sending.h"
#include "transport/wiring.h"

enum {
    FRUITLESS_MAX = 64,
    /* Generations of other hosts that are answered: one is normal where a host
     * was here before, a few come of nodes that were cut off meanwhile. */
    OUTDONE_MAX = 4
};

/* Whether the host can speak by that node: by a wire, and on to another. */
static bool speaks(const struct host_service *s, const struct cube_wiring *w,
                   uint16_t gateway) {
    unsigned dimension = s->machine->dimension;
    bool on = dimension == 0;
    for (unsigned d = 0; d < dimension; d++) {
        on = on || !wiring_is_dead(w, w->dead_count, gateway, d, dimension);
    }
    return on &&
           !wiring_is_dead(w, w->dead_count, gateway, dimension, dimension);
}

uint16_t host_generation_gateway(const struct host_service *service,
                                 const struct cube_wiring *next) {
    const struct host_service *s = service;
    uint16_t other = next->gateway != 0 ? 0 : s->machine->spare_node;
    return !speaks(s, next, next->gateway) && speaks(s, next, other)
               ? other
               : next->gateway;
}

/* The gateway must be there, and what was given up must not be on the way.
 * What is dead only since is looked at later. */
static int check_renewed(const struct host_service *s,
                         struct host_error *error) {
    const struct cube_wiring *w = cube_wiring(s->cube);
    unsigned dimension = s->machine->dimension;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        bool dead = wiring_is_dead(w, w->settled, i, dimension, dimension);
        if (i == w->gateway ? dead : s->node[i].given_up && !dead) {
            return host_detector_doubt(s, i, error) != 0
                       ? error->code
                       : host_fail(
                             error, HOST_CUBE,
                             "node %u link %u: lost, and the cube cannot go "
                             "on without it; look after that node and its "
                             "wires, and run again",
                             i, host_detector_link(s, i));
        }
    }
    return 0;
}

/* Nodes that come back to another host's generation, whatever is answered,
 * would have the run begin for ever. */
static int check_outdone(const struct host_service *s,
                         struct host_error *error) {
    unsigned gateway = cube_wiring(s->cube)->gateway;
    return cube_statistics(s->cube)->outdone <= OUTDONE_MAX
               ? 0
               : host_fail(error, HOST_CUBE,
                           "node %u link %u: tells of a generation of another "
                           "host, and goes back to it when it is told a new "
                           "one; restart the nodes, and run again",
                           gateway, host_detector_link(s, gateway));
}

int host_generation_begin(struct host_service *service, uint64_t now_us,
                          struct host_error *error) {
    struct host_service *s = service;
    host_detector_begin(s, now_us);
    host_onlooking_again(&s->onlooking);
    if (check_outdone(s, error) != 0 || check_renewed(s, error) != 0) {
        return error->code;
    }
    s->late = false;
    if (s->started) {
        s->audit.lost_work = true;
        s->strategy->lose(&s->work);
        host_spill_clear(&s->spill);
        host_sending_begin(s);
    }
    return 0;
}

/* Boards that reset themselves would have the run begin for ever. */
static int check_progress(struct host_service *s, struct host_error *error) {
    s->fruitless =
        s->ledger.committed == s->committed_before ? s->fruitless + 1 : 0;
    s->committed_before = s->ledger.committed;
    return s->fruitless <= FRUITLESS_MAX
               ? 0
               : host_fail(error, HOST_CUBE,
                           "node %u link %u: %u losses in a row, and nothing "
                           "done between them; look after that node and its "
                           "wires, and run again",
                           s->blamed, host_detector_link(s, s->blamed),
                           s->fruitless);
}

int host_generation_renew(struct host_service *service, uint64_t now_us,
                          struct host_error *error) {
    struct host_service *s = service;
    struct cube_wiring next = *cube_wiring(s->cube);
    unsigned dimension = s->machine->dimension;
    s->loss = false;
    if (s->started && s->ledger.committed == s->ledger.bricks) {
        /* All bricks are here: if the result is right, this loss costs nothing.
         */
        s->audit.lost_work = true;
        s->late = true;
        s->over = s->reporting;
        return 0;
    }
    if (check_progress(s, error) != 0) {
        return error->code;
    }
    if (s->searching || !host_missing_links_spare(s)) {
        /* That a wire is absent shows later, and who is cut off is waited
         * for. */
        next.dead_count = next.settled;
    }
    if (!s->searching) {
        next.absent_s = s->started ? s->machine->absent_s : next.absent_s;
    }
    if (s->wire_lost) {
        struct cube_dead dead = {next.gateway, (uint8_t)dimension};
        (void)wiring_add_dead(&next, dead, dimension);
        s->wire_lost = false;
        s->wire_down_us = now_us;
    }
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct cube_dead dead = {(uint16_t)i, CUBE_WHOLE_NODE};
        if (s->node[i].given_up) {
            (void)wiring_add_dead(&next, dead, dimension);
        }
    }
    next.gateway = host_generation_gateway(s, &next);
    cube_renew(s->cube, &next);
    s->generations++;
    return host_generation_begin(s, now_us, error);
}
