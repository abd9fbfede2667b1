/* The wires of a cube that is visited: those that are dead are gone round, and
 * used again when they are alive.  Part of visit.h.
 *
 * What is known: nodes that give up a link, or never saw it up for three
 * seconds, say so by the cube's wiring; nodes that have no limit for that (bare
 * boards) say with their pongs which of their links are silent, and which have
 * been up.  Where that differs from what the generation was begun with, another
 * is begun, soon after the last news: all at once where there are many. */
#ifndef HOST_VISIT_WIRING_H
#define HOST_VISIT_WIRING_H

#include "visit.h"

enum {
    HOST_VISIT_ABSENT_S = 3,
    HOST_VISIT_WHO_TAG = 0 /* of questions that the visit asks itself */
};

/* A generation has begun: asks all nodes anew. */
void host_visit_wiring_begin(struct host_visit *visit);

/* Begins another where one is due. */
void host_visit_wiring_look(struct host_visit *visit);

/* Begins another with what is dead now. */
void host_visit_wiring_renew(struct host_visit *visit);

/* The host's wire that is in use. */
unsigned host_visit_wire(const struct host_visit *visit);

#endif
