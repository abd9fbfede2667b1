/* The data of a link, for its files only.  A link has three parts: the session
 * (the handshake), the send window (link_send.c) and the receive window; the
 * first and the last are in link_receive.c.  The parts do not call each other:
 * link.c joins them by their return values.  All parts may read every field.
 * link.c and these parts write:
 *
 * - session: candidate, peer ..., session_in and out, intruder, told_...,
 *   kept_us, heard_us, hello_now, hello_us, up, closed, bye_due;
 * - send: send, out, stalled, sent_us, bye_us; datagrams.due, when it goes, and
 *   bye_due likewise; as every frame reports what came: receive.reported,
 *   unreported and ack_now;
 * - receive: receive, in, datagrams.in ..., asked, heard;
 * - each: its statistics.
 *
 * Memory and work: see link.h. */
#ifndef TRANSPORT_LINK_INTERNAL_H
#define TRANSPORT_LINK_INTERNAL_H

#include "check.h"
#include "frame.h"
#include "link.h"

enum {
    LINK_HELLO_SIZE = 24,
    LINK_SACK_SIZE = 8,
    LINK_CANDIDATE_HELLOS = 20 /* then an unconfirmed peer is forgotten */
};

enum link_kind { LINK_HELLO = 1, LINK_DATA, LINK_ACK, LINK_BYE, LINK_STATE };

/* LINK_MORE: the message continues in the next frame.  LINK_ASK: requests an
 * answer at once. */
enum link_flag { LINK_MORE = 1, LINK_ASK = 2 };

enum link_slot_state { LINK_WAITING, LINK_SENT, LINK_LOST, LINK_ARRIVED };

struct link_send_slot {
    uint32_t sent_us; /* when last, modulo 2^32 */
    uint32_t order;   /* of that transmission among all */
    uint16_t size;
    uint8_t state; /* enum link_slot_state */
    uint8_t flags; /* LINK_MORE */
    bool again;    /* transmitted more than once */
};

struct link_receive_slot {
    uint16_t size;
    bool full, more;
};

/* A peer that greeted, but has not shown yet that it knows this epoch. */
struct link_candidate {
    uint32_t epoch; /* 0: none */
    uint32_t session_in;
    uint16_t window;
    uint8_t credit; /* stays when its session has begun */
    uint8_t hellos_left;
};

/* Slots [first, first + in flight) of the send window were sent, those up to
 * `end` wait.  Sequence numbers count modulo 2^16, slots modulo window. */
struct link_sender {
    uint8_t *payload;
    struct link_send_slot *slots;
    uint16_t first, next, end; /* sequence numbers */
    uint16_t head;             /* slot of `first` */
    uint16_t limit;            /* first sequence number without credit */
    uint16_t lost;             /* slots to be sent again */
    uint16_t arrived;          /* slots acknowledged out of order */
    uint32_t order;            /* of the next transmission */
    uint64_t timer_us;         /* start of the retransmission timer */
    uint8_t backoff;
    bool inside; /* the last new frame sent has more of its message behind */
    uint32_t variation_us;
};

/* From slot `head`: `complete` slots of whole messages, up to `ready` in order,
 * then room, in which `early` ones came out of order. */
struct link_receiver {
    uint8_t *payload;
    struct link_receive_slot *slots;
    uint16_t head, complete, ready, early;
    uint16_t next;       /* sequence number expected in order */
    uint16_t reported;   /* next + credit as last sent */
    uint16_t unreported; /* frames since */
    uint16_t held;       /* slots of the message being read */
    uint64_t unreported_us;
    bool ack_now;
};

struct link_bytes_in {
    uint8_t *bytes;
    size_t begin, scanned, end;
    bool skipping; /* to the next zero */
    bool pending;  /* whole frames may be left */
};

struct link_bytes_out {
    uint8_t *bytes;
    size_t begin, end;
};

struct link_datagrams {
    const uint8_t *out; /* the caller's */
    uint16_t out_size, in_size, in_sequence;
    bool due, asks, heard, asked;
    uint8_t in[LINK_DATAGRAM_MAX];
};

struct link {
    struct link_config config;
    struct link_statistics statistics;
    struct link_peer peer;
    struct link_candidate candidate;
    struct link_sender send;
    struct link_receiver receive;
    struct link_bytes_in in;
    struct link_bytes_out out;
    struct link_datagrams datagrams;
    size_t buffer_bytes; /* of in and out, each */
    uint16_t fragments_max;
    uint16_t peer_window;
    uint32_t peer_epoch; /* of the session; 0: none yet */
    uint32_t session_in, session_out;
    uint32_t intruder; /* epoch to be answered that the link is in use; 0 */
    uint64_t kept_us;  /* when the present session was heard last */
    uint32_t told_by;  /* the start of the peer that said that it is in use, */
    uint64_t told_us;  /* and when */
    uint64_t now_us, heard_us, sent_us, hello_us, bye_us, deadline_us;
    bool pipe_up, up, hello_now, stalled, tending;
    bool closing, closed, bye_due;
};

/* In config.c: the config with its defaults; the number of frames of a message
 * of that size. */
struct link_config link_complete(const struct link_config *config);
unsigned link_fragments(const struct link_config *config, size_t size);

/* Of one encoded frame, of any kind. */
static inline size_t link_frame_bytes(const struct link_config *config) {
    return FRAME_ENCODED(config->frame_payload > LINK_DATAGRAM_MAX
                             ? config->frame_payload
                             : LINK_DATAGRAM_MAX);
}

static inline bool link_refuses(const struct link *link) {
    return link->peer.refusal != LINK_FITS;
}

/* Whether the peer has said farewell, and its answer has left, for which it
 * waits: this end's own farewell may not have gone before. */
static inline bool link_has_parted(const struct link *link) {
    return link->closed && !link->bye_due && link->out.end == 0;
}

/* Slots of the send window that hold frames. */
static inline unsigned link_used(const struct link *link) {
    return (uint16_t)(link->send.end - link->send.first);
}

/* Free slots of the receive window: what the peer may send. */
static inline unsigned link_credit(const struct link *link) {
    LINK_ASSERT(link->receive.ready <= link->config.window);
    return (unsigned)link->config.window - link->receive.ready;
}

/* Of a slot that is counted on past the last, less than a window. */
static inline unsigned link_wrapped(const struct link *link, unsigned slot) {
    unsigned window = link->config.window;
    return slot >= window ? slot - window : slot;
}

/* The slot of frame `offset` after the first of the send window. */
static inline unsigned link_sent_slot(const struct link *link,
                                      unsigned offset) {
    return link_wrapped(link, link->send.head + offset);
}

/* The slot of frame `offset` after those that came in order, within credit. */
static inline unsigned link_slot_of(const struct link *link, unsigned offset) {
    return link_wrapped(link, (unsigned)link->receive.head +
                                  link->receive.ready + offset);
}

/* The receive window of a link: finds frames in the bytes of the pipe, decodes
 * them into their slots, and returns what they contain.  The caller, link.c,
 * applies that to the handshake and the send window. */

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

/* The send window of a link: chooses the next frame, applies acknowledgements,
 * and runs the retransmission timer.  It calls neither the handshake nor the
 * receive window.  It reads the credit and acknowledgement that each frame
 * reports, and records that they were reported. */

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

/* The pipe broke: frames that were on their way are lost. */
void link_send_resume(struct link *link);

/* Retransmission, as long as it is now. */
uint32_t link_timeout_us(const struct link *link);

/* Whether frames of data, or an acknowledgement alone, may go now. */
bool link_may_send(const struct link *link);
bool link_ack_due(const struct link *link);

/* When the timer expires, the oldest frame counts as lost.  A sender without
 * credit sends a probe, because the frame with the credit may have been lost.
 */
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

/* The handshake of a link: identifies the peer, and decides whether a frame
 * belongs to the present session, to another, or begins a new one.  It returns
 * to link.c what follows for the two windows, and changes neither. */

/* How a frame, or a HELLO, relates to the session. */
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
