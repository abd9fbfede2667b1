#include "missing.h"

#include <stdio.h>
#include <string.h>

#include "../transport/wiring.h"

enum {
    WAIT_US_MAX = 10000000,  /* for one more node; at most half the patience */
    SEARCH_US_MAX = 4000000, /* and two fifths */
    AGAIN_US = 10000000,
    ABSENT_S = 3 /* not up for so long, in a search */
};

/* Follows live links from the gate; true: they lead to all nodes. */
static bool holds_together(const struct host_service *s,
                           const struct cube_wiring *w)
{
    static bool reached[HOST_NODES_MAX];
    unsigned dimension = s->machine->dimension, count = 1, before = 0;
    memset(reached, 0, sizeof reached);
    reached[w->gate] = true;
    while (count > before) {
        before = count;
        for (unsigned i = 0; i < s->machine->nodes; i++) {
            for (unsigned d = 0; reached[i] && d < dimension; d++) {
                unsigned other = i ^ 1u << d;
                if (!reached[other] &&
                    !wiring_is_dead(w, w->dead_count, i, d, dimension)) {
                    reached[other] = true;
                    count++;
                }
            }
        }
    }
    return count == s->machine->nodes &&
           !wiring_is_dead(w, w->dead_count, w->gate, dimension, dimension);
}

/* Errors and what is as good as one go there, whatever else is quiet. */
static void tell(const struct host_service *s, const struct cube_wiring *w)
{
    for (unsigned i = w->settled; i < w->dead_count; i++) {
        const struct cube_dead *d = &w->dead[i];
        char other[16] = "the host";
        if (d->dimension < s->machine->dimension) {
            snprintf(other, sizeof other, "node %u",
                     (unsigned)d->node ^ 1u << d->dimension);
        }
        fprintf(stderr,
                "incode: node %u link %u: the wire to %s does not come up; "
                "the run goes on without it, look after that wire\n",
                d->node, d->dimension, other);
    }
}

static void search(struct host_service *s, uint64_t now_us)
{
    struct cube_wiring next = *cube_wiring(s->cube);
    next.generation++;
    next.dead_count = next.settled;
    next.absent_s = ABSENT_S;
    s->searching = true;
    s->search_us = now_us;
    cube_renew(s->cube, &next);
}

/* missing: the dead that were found are. */
static void end_search(struct host_service *s, bool missing)
{
    struct cube_wiring next = *cube_wiring(s->cube);
    next.generation++;
    next.absent_s = missing ? s->machine->absent_s : 0;
    if (missing) {
        tell(s, &next);
        next.gate = host_service_gate(s, &next);
        s->generations++;
    } else {
        next.dead_count = next.settled;
    }
    s->searching = false;
    cube_renew(s->cube, &next);
}

bool host_missing_check(struct host_service *service, uint64_t now_us,
                        uint64_t patience_us)
{
    struct host_service *s = service;
    struct cube_wiring found = *cube_wiring(s->cube);
    uint64_t wait_us = patience_us / 2, search_us = patience_us * 2 / 5;
    wait_us = wait_us < WAIT_US_MAX ? wait_us : WAIT_US_MAX;
    search_us = search_us < SEARCH_US_MAX ? search_us : SEARCH_US_MAX;
    if (s->started || s->machine->absent_s == 0) {
        return false;
    }
    if (!s->searching) {
        if (s->here < s->living && now_us - s->news_us >= wait_us) {
            search(s, now_us);
        }
        return s->searching;
    }
    found.gate = host_service_gate(s, &found);
    if (s->here == s->living) {
        end_search(s, false); /* all have come, or the wires are not needed */
    } else if (now_us - s->search_us < search_us) {
        return true;
    } else if (found.dead_count < CUBE_DEAD_MAX && holds_together(s, &found)) {
        end_search(s, true);
    } else if (now_us - s->search_us >= AGAIN_US) {
        search(s, now_us);
    }
    return true;
}
