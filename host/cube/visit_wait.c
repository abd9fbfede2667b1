/* What waits until a visit knows something, round by round. */
#include <string.h>

#include "host/service/onlookers.h"
#include "visit_wiring.h"

enum {
    SETTLED_US = 2000000, /* of a generation, in which who can be reached
                             has answered */
    NOBODY_US = 4000000,  /* at the host's wire */
    WIRES_US = 3000000    /* in which wires of a node come up */
};

/* Rounds until `done`, at most so long. */
static int until(struct host_visit *v, uint64_t wait_us,
                 bool (*done)(const struct host_visit *v,
                              const struct host_node_set *set),
                 const struct host_node_set *set, struct host_error *error) {
    uint64_t begun_us = v->machine->now_us(v->machine->context);
    v->now_us = begun_us;
    while (!done(v, set) && v->now_us - begun_us < wait_us) {
        if (host_visit_round(v, wait_us - (v->now_us - begun_us), error) != 0) {
            return error->code;
        }
    }
    return 0;
}

static bool all_there(const struct host_visit *v,
                      const struct host_node_set *set) {
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        if (host_node_set_has(set, i) && !v->node[i].there) {
            return false;
        }
    }
    return true;
}

int host_visit_wait(struct host_visit *visit, const struct host_node_set *set,
                    uint64_t wait_us, struct host_error *error) {
    bool was;
    int status;
    do { /* a round fails within 9 s where the other host stays */
        was = visit->in_use;
        status = until(visit, wait_us, all_there, set, error);
    } while (status == 0 && (was || visit->in_use) && !all_there(visit, set));
    return status;
}

/* A wire that was found dead may be one on the way round which others come. */
static bool all_settled(const struct host_visit *v,
                        const struct host_node_set *set) {
    bool late = v->now_us - v->began_us >= SETTLED_US;
    enum link_state wire = cube_link_state(v->cube, host_visit_wire(v));
    if (wire != LINK_UP && !v->in_use &&
        v->now_us - v->opened_us >= NOBODY_US) {
        return true;
    }
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        bool known = v->node[i].there && v->node[i].pong_us != 0;
        if (host_node_set_has(set, i) && !known &&
            (!late || cube_reaches(v->cube, (uint16_t)i))) {
            return false;
        }
    }
    return true;
}

int host_visit_settle(struct host_visit *visit, const struct host_node_set *set,
                      uint64_t wait_us, struct host_error *error) {
    return until(visit, wait_us, all_settled, set, error);
}

static bool wires_settled(const struct host_visit *v,
                          const struct host_node_set *set) {
    (void)set;
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        const struct host_visit_node *node = &v->node[i];
        if (node->there && node->heard && node->pong_us == 0) {
            return false; /* it has not said */
        }
    }
    return host_visit_faults_are_old(v, WIRES_US) ||
           host_visit_faults(v, NULL, NULL) == 0;
}

int host_visit_settle_wires(struct host_visit *visit, uint64_t wait_us,
                            struct host_error *error) {
    return until(visit, wait_us, wires_settled, NULL, error);
}

static bool all_answered(const struct host_visit *v,
                         const struct host_node_set *set) {
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        if (host_node_set_has(set, i) && !v->node[i].answered &&
            cube_reaches(v->cube, (uint16_t)i)) {
            return false;
        }
    }
    return true;
}

int host_visit_ask(struct host_visit *visit, const struct host_node_set *set,
                   enum node_question what, unsigned target, uint64_t wait_us,
                   struct host_error *error) {
    struct host_visit *v = visit;
    v->tag =
        v->tag + 1 == HOST_ONLOOKERS_TAG ? HOST_VISIT_WHO_TAG + 1 : v->tag + 1;
    v->what = what;
    v->target = target;
    v->wanted = *set;
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        struct host_visit_node *node = &v->node[i];
        node->answered = false;
        node->size = 0;
        node->question_due = host_node_set_has(set, i);
    }
    int status = until(v, wait_us, all_answered, set, error);
    memset(&v->wanted, 0, sizeof v->wanted);
    for (unsigned i = 0; i < v->machine->nodes; i++) {
        v->node[i].question_due = false;
    }
    return status;
}
