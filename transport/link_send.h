/* The send window of a link: which frame goes next, what acknowledgements say
 * of those that went, and the timer that sends again.  It calls neither the
 * handshake nor what receives; of the receive window it reads what each frame
 * reports, and notes that it was reported.
 *
 * Memory: none but struct link.  Work: a look at each slot of the window.
 *
 *     while (link_staging_room(link) && link_stage_frame(link)) {
 *     }
 *     if (link_flush(link) == LINK_FLUSH_CLOSED) {
 *         link_forget_staged(link);
 *     }
 */
#ifndef TRANSPORT_LINK_SEND_H
#define TRANSPORT_LINK_SEND_H

#include "link_internal.h"

enum link_flush {
    LINK_FLUSH_DONE,    /* the pipe has taken all that was staged */
    LINK_FLUSH_STALLED, /* it takes no more for the present */
    LINK_FLUSH_CLOSED   /* it is gone */
};

/* What a frame's header acknowledges; bit i of sack: frame acknowledge + 1 + i
 * has arrived too. */
void link_on_acknowledge(struct link *link, const struct frame_header *header,
                         uint64_t sack);

/* For a new peer, which knows nothing of what was sent to the old one and has
 * that much credit. */
void link_send_reset(struct link *link, uint8_t credit);

/* What was on its way when the pipe broke is not coming. */
void link_send_resume(struct link *link);

/* Retransmission, as long as it is now. */
uint32_t link_timeout_us(const struct link *link);

/* Whether frames of data, or an acknowledgement alone, may go now. */
bool link_may_send(const struct link *link);
bool link_ack_due(const struct link *link);

/* The oldest frame goes again when nothing was heard of it for long; a sender
 * without credits asks, as the frame that brought them may be lost. */
void link_run_timer(struct link *link);

/* Whether one more frame of any kind can be staged. */
bool link_staging_room(const struct link *link);

/* Stages a greeting; or the most urgent of all other frames, false: there is
 * nothing to say. */
void link_stage_hello(struct link *link, const uint8_t hello[LINK_HELLO_SIZE]);
bool link_stage_frame(struct link *link);

/* The pipe is closed: what is staged does not go. */
void link_forget_staged(struct link *link);

/* Gives the pipe what is staged. */
enum link_flush link_flush(struct link *link);

#endif
