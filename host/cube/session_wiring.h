/* The wires of a cube that is visited: those that are dead are gone round, and
 * used again when they are alive.  Part of session.h.
 *
 * What is known: nodes that give up a link, or never saw it up for three
 * seconds, say so by the cube's wiring; nodes that have no limit for that (bare
 * boards) say with their pongs which of their links are silent, and which have
 * been up.  Where that differs from what the generation was begun with, another
 * is begun, soon after the last news: all at once where there are many. */
#ifndef HOST_SESSION_WIRING_H
#define HOST_SESSION_WIRING_H

#include "session.h"

enum {
    HOST_SESSION_ABSENT_S = 3,
    HOST_SESSION_WHO_TAG = 0 /* of questions that the session asks itself */
};

/* A generation has begun: asks all nodes anew. */
void host_session_wiring_begin(struct host_session *session);

/* Begins another where one is due. */
void host_session_wiring_look(struct host_session *session);

/* Begins another with what is dead now. */
void host_session_wiring_renew(struct host_session *session);

/* The host's wire that is in use. */
unsigned host_session_wire(const struct host_session *session);

#endif
