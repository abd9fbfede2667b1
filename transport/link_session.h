/* The handshake of a link: who is at the other end, and whether what comes is
 * of this session, another, or a new one.  It tells link.c what follows for the
 * two windows, and touches neither.
 *
 * Memory: none but struct link.  Work: constant, a CRC of 12 bytes at most.
 *
 *     if (link_accept_session(link, header.session) == LINK_BEGUN) {
 *         link_receive_reset(link, (uint16_t)link->peer_epoch);
 *     }
 */
#ifndef TRANSPORT_LINK_SESSION_H
#define TRANSPORT_LINK_SESSION_H

#include "link_internal.h"

/* What a frame, or a greeting, is to the session. */
enum link_session {
    LINK_FOREIGN,  /* of another one, or of none */
    LINK_PRESENT,  /* of this one */
    LINK_RESUMED,  /* of this one, which was down until now */
    LINK_BEGUN,    /* of the first, which begins with it; the peer's credit is
                      candidate.credit */
    LINK_RESTARTED /* the same, and the peer was another start before: what was
                      on its way to that one is lost */
};

/* By the session of a frame whose header is sound: it proves that its sender
 * knows both epochs. */
enum link_session link_accept_session(struct link *link, uint32_t session);

/* A greeting; LINK_FOREIGN: it settles nothing yet.  Otherwise the peer waits
 * for an acknowledgement. */
enum link_session link_on_hello(struct link *link,
                                const struct frame_header *header,
                                const uint8_t hello[LINK_HELLO_SIZE]);

/* Has a greeting sent soon, but no more often than greetings go. */
void link_greet(struct link *link);

bool link_hello_due(const struct link *link);

/* The greeting that goes now. */
void link_make_hello(struct link *link, uint8_t hello[LINK_HELLO_SIZE]);

/* The peer sent a message longer than agreed. */
void link_refuse_sizes(struct link *link);

/* A farewell: it is answered where that is asked for. */
void link_on_bye(struct link *link, const struct frame_header *header);

#endif
