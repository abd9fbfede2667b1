/* The receive window of a link: finds frames among the bytes of the pipe,
 * decodes them to where they stay, and says what has happened.  What follows
 * for the handshake and the send window is link.c's.
 *
 * Memory: none but struct link.  Work: linear in the bytes, and a look at each
 * slot that becomes ready.
 *
 *     while (link_find_frame(link, &frame) == LINK_FOUND) {
 *         happened = link_take_frame(link, &frame);
 *     }
 */
#ifndef TRANSPORT_LINK_RECEIVE_H
#define TRANSPORT_LINK_RECEIVE_H

#include "link_internal.h"

enum link_search {
    LINK_NO_FRAME,  /* no whole one is left among the bytes at hand */
    LINK_BAD_FRAME, /* passed over, and counted */
    LINK_FOUND      /* its header is sound, its payload not decoded yet */
};

/* What a frame that was taken has brought for others. */
enum link_event {
    LINK_NOTHING,      /* no frame for them, or a bad one, which is counted */
    LINK_GREETED,      /* a greeting, in payload */
    LINK_ACKNOWLEDGED, /* an acknowledgement in its header, and in sack */
    LINK_FAREWELL,     /* the same, and the peer leaves */
    LINK_TOO_LONG      /* the same, of a message longer than agreed */
};

struct link_frame {
    struct frame_reader reader;
    struct frame_header header;
    uint64_t sack;
    uint8_t payload[LINK_DATAGRAM_MAX];
};

enum link_fill {
    LINK_FILL_SOME, /* all bytes that were there */
    LINK_FILL_MORE, /* all that there was room for; there may be more */
    LINK_FILL_CLOSED
};

enum link_search link_find_frame(struct link *link, struct link_frame *frame);
enum link_event link_take_frame(struct link *link, struct link_frame *frame);

/* Reads from the pipe once. */
enum link_fill link_fill(struct link *link);

/* The pipe is closed: bytes that are no whole frame yet stay so. */
void link_forget_bytes(struct link *link);

/* For a new session: whole messages of the old one stay to be read, the rest
 * goes; the first frame is to have that number. */
void link_receive_reset(struct link *link, uint16_t first);

#endif
