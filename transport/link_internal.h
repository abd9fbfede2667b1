/* What the parts of a link share: link.c (memory, messages, timers), session.c
 * (handshake), link_send.c and link_receive.c (the two windows).  Not for
 * others.
 *
 * Memory and work: see link.h.
 *
 *     link_note_heard(link, &header, sack);
 */
#ifndef TRANSPORT_LINK_INTERNAL_H
#define TRANSPORT_LINK_INTERNAL_H

#include "frame.h"
#include "link.h"

enum {
    LINK_VERSION = 1,
    LINK_HELLO_SIZE = 24,
    LINK_SACK_SIZE = 8,
    LINK_CANDIDATE_HELLOS = 20 /* then an unconfirmed peer is forgotten */
};

enum link_kind { LINK_HELLO = 1, LINK_DATA, LINK_ACK, LINK_BYE, LINK_STATE };

/* LINK_MORE: the message goes on in the next frame.  LINK_ASK: please answer
 * at once. */
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
    uint8_t credit;
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
    uint16_t out_size, in_size;
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
    uint32_t intruder; /* epoch that is to be told of the present one; 0 */
    uint64_t kept_us;  /* when the present session was heard last */
    uint32_t told_by;  /* the start of the peer that said that it is in use, */
    uint64_t told_us;  /* and when */
    uint64_t now_us, heard_us, sent_us, hello_us, bye_us, deadline_us;
    bool pipe_up, up, hello_now, stalled;
    bool closing, closed, bye_due;
};

/* Of one encoded frame, of any kind. */
static inline size_t link_frame_bytes(const struct link_config *config)
{
    return FRAME_ENCODED(config->frame_payload > LINK_DATAGRAM_MAX
                             ? config->frame_payload
                             : LINK_DATAGRAM_MAX);
}

/* session.c */
void link_greet(struct link *link);
void link_on_hello(struct link *link, const struct frame_header *header,
                   const uint8_t *hello);
bool link_accept_session(struct link *link, uint32_t session);
void link_pack_hello(const struct link *link, uint8_t *hello);
void link_pipe_lost(struct link *link);
bool link_hello_due(const struct link *link);
bool link_refuses(const struct link *link);

/* link_send.c */
void link_on_acknowledge(struct link *link, const struct frame_header *header,
                         uint64_t sack);
void link_send_reset(struct link *link, uint8_t credit);
void link_send_resume(struct link *link);
uint32_t link_timeout_us(const struct link *link);
bool link_may_send(const struct link *link);
bool link_ack_due(const struct link *link);

/* link_receive.c */
void link_receive_reset(struct link *link, uint16_t first);
unsigned link_credit(const struct link *link);
uint64_t link_sack(const struct link *link);

#endif
