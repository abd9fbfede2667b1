/* A reliable link over any pipe of bytes: messages arrive once, whole and in
 * order, or the link reports that the peer has started again.  The pipe may
 * lose, change, insert and repeat bytes, stall and break.  PROTOCOL.md has
 * frame layout, handshake and timers.
 *
 * Memory: link_bytes() bytes that the caller gives: struct link, `window` slots
 * of `frame_payload` bytes each way, one message less one slot so that a
 * message of several frames lies in one piece, and two staging buffers of
 * `staging` encoded frames.  Work: link_poll handles at most window + 2 frames
 * each way, and calls the pipe at most 2 window + 5 times.
 *
 *     struct link *link = link_init(memory, bytes, &config);
 *     link_poll(link, now_us);
 *     while (link_read(link, &message))
 *         link_release(link);
 */
#ifndef TRANSPORT_LINK_H
#define TRANSPORT_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    LINK_VERSION = 2,            /* of the protocol on the wire */
    LINK_WINDOW_MAX = 64,        /* frames a direction */
    LINK_FRAME_PAYLOAD_MIN = 32, /* bytes */
    LINK_FRAME_PAYLOAD_MAX = 1616,
    LINK_MESSAGE_MAX = 1616,
    LINK_DATAGRAM_MAX = 96, /* bytes */
    LINK_PIPE_CLOSED = -1,
    LINK_AGAIN = -1
};

/* The pipe beneath a link.  Both functions return at once: the number of bytes
 * sent or received, 0 .. size (0: no room, or no byte, at present), or
 * LINK_PIPE_CLOSED while the other end is gone.  A pipe may work again after
 * LINK_PIPE_CLOSED.  The link then shakes hands and continues.  Sizes are below
 * 2^30. */
struct link_pipe {
    void *context;
    int (*send)(void *context, const uint8_t *bytes, size_t size);
    int (*receive)(void *context, uint8_t *bytes, size_t size);
};

/* An end of a link: which node, and which port of it. */
struct link_end {
    uint16_t node;
    uint8_t port;
};

enum link_state {
    LINK_DOWN,    /* the pipe is closed */
    LINK_OPENING, /* shaking hands */
    LINK_UP,
    LINK_SILENT,  /* up, but nothing has arrived for silence_us */
    LINK_CLOSING, /* link_close: waits for what is on its way */
    LINK_CLOSED,  /* both ends have closed, or the deadline is over */
    LINK_REFUSED  /* the peer does not fit: see link_peer */
};

enum link_refusal {
    LINK_FITS,
    LINK_WRONG_VERSION,
    LINK_WRONG_WIRE,     /* another node, or another of its ports */
    LINK_WRONG_GREETING, /* the layer above differs */
    LINK_WRONG_SIZES,    /* its window does not hold a message, or ours its */
    LINK_IN_USE          /* it keeps to another start of this end, or to another
                            peer; that may change */
};

/* The peer, as it describes itself. */
struct link_peer {
    uint32_t epoch; /* 0: unknown so far */
    uint16_t node;
    uint8_t port;
    uint8_t version, greeting;
    uint16_t window, frame_payload, message_max;
    enum link_refusal refusal;
    uint32_t in_use; /* HELLOs that reported LINK_IN_USE */
};

struct link_statistics {
    uint64_t bytes_sent, bytes_received;       /* on the pipe */
    uint64_t frames_sent, frames_received;     /* good ones, of every kind */
    uint64_t messages_sent, messages_received; /* queued; read */
    uint64_t payload_sent, payload_received;   /* bytes of those messages */
    uint64_t retransmitted;                    /* data frames sent again */
    uint64_t timeouts;    /* retransmission timer ran out */
    uint64_t acks_sent;   /* frames that carry nothing else */
    uint64_t probes_sent; /* requests for credit that may have been lost */
    uint64_t hellos_sent;
    uint64_t datagrams_sent;
    uint64_t bad_header;       /* frames with a false header check */
    uint64_t bad_crc;          /* with a false CRC-32 */
    uint64_t bad_code;         /* with a false length or COBS code */
    uint64_t resynchronised;   /* runs of bytes too long for a frame, skipped */
    uint64_t stale;            /* frames of another session */
    uint64_t duplicates;       /* data frames that were here already */
    uint64_t overruns;         /* data frames beyond the credits */
    uint64_t sessions;         /* peers accepted: 1 after the first handshake */
    uint64_t resumed;          /* handshakes that went on with a session */
    uint64_t messages_dropped; /* queued for a peer that restarted */
    uint64_t pipe_closed;      /* times the pipe broke */
    uint64_t starved;          /* polls with frames to send and no credit */
    uint64_t stalled;          /* polls in which the pipe did not take all */
    uint32_t send_high_water, receive_high_water; /* slots */
    uint32_t rtt_us, rtt_min_us, rtt_max_us;      /* smoothed; extremes */
    uint32_t timeout_us;                          /* retransmission timer */
};

/* link_bytes() is 0, and link_init gives NULL, where a limit is not kept.  A
 * field that has a default takes it where it is 0. */
struct link_config {
    /* The bytes beneath.  No default; both functions are given. */
    struct link_pipe pipe;

    /* This start of this end.  No default; 1 .. 2^32 - 1, never repeated. */
    uint32_t epoch;

    /* Node and port of this end; node and port that must be at the other end.
     * No limits. */
    uint16_t node;
    uint8_t port;
    uint8_t peer_port;
    uint16_t peer_node;

    /* A value of the layer above: the peer's must be equal, unless one of the
     * two is 0.  No limits. */
    uint8_t greeting;

    /* Keeps to the present peer until it has been silent for silence_us, and
     * answers another epoch that the link is in use. Default: no. */
    bool keeps_peer;

    /* Frames a direction that may be under way.  No default; 1 ..
     * LINK_WINDOW_MAX, and enough for a message of message_max. */
    uint16_t window;

    /* Bytes of the longest message.  Default: LINK_MESSAGE_MAX, the most. */
    uint16_t message_max;

    /* Bytes of a message in a frame.  Default: message_max; a multiple of 8,
     * LINK_FRAME_PAYLOAD_MIN .. LINK_FRAME_PAYLOAD_MAX. */
    uint16_t frame_payload;

    /* Frames encoded ahead of the pipe.  Default: half a window, 4 to 8, no
     * more than the window; up to LINK_WINDOW_MAX. */
    uint16_t staging;

    /* Microseconds after which a frame that was not acknowledged is sent again:
     * minimum and maximum.  Defaults: 100,000 and 1,000,000; a slow wire needs
     * more.  The minimum is at most the maximum.  If measured round trips are
     * longer, the timeout rises to 8 times the maximum. */
    uint32_t timeout_min_us;
    uint32_t timeout_max_us;

    /* Microseconds that an acknowledgement may wait for a data frame that
     * carries it.  Default: 5,000; no limit. */
    uint32_t ack_delay_us;

    /* Microseconds between HELLOs while the link is not up.  Default: 50,000;
     * no limit. */
    uint32_t hello_us;

    /* Microseconds after which an idle end sends a frame.  Default: 500,000; no
     * limit. */
    uint32_t keep_alive_us;

    /* Microseconds without a frame after which the peer counts as silent.
     * Default: 3,000,000; no limit. */
    uint32_t silence_us;
};

/* PROTOCOL.md's settings for a serial wire: all fields except pipe, epoch, the
 * ends, window and message_max. */
void link_for_serial(struct link_config *config, uint32_t baud);

struct link_message {
    const uint8_t *data;
    size_t size;
    uint16_t sequence; /* of its first frame in this session, modulo 2^16; of a
                          datagram, that of the next new frame behind it */
};

/* The first field that breaks its limit, and which, as in "epoch is 0"; NULL:
 * the config is sound. */
const char *link_config_fault(const struct link_config *config);

/* Bytes that link_init needs for this config; 0: the config is not sound. */
size_t link_bytes(const struct link_config *config);

struct link;

/* The link is at the start of its memory, which is aligned to 8 bytes and has
 * at least link_bytes() bytes.  NULL: it has fewer, or the config is not sound.
 */
struct link *link_init(void *memory, size_t bytes,
                       const struct link_config *config);

/* Moves bytes and frames.  Returns the number of frames handled, in and out.
 * _receive and _send are its two halves, for a caller with work between them.
 */
int link_poll(struct link *link, uint64_t now_us);
int link_poll_receive(struct link *link, uint64_t now_us);
int link_poll_send(struct link *link, uint64_t now_us);

/* As link_poll_receive, for a caller that has checked link_room and is about to
 * write: a BYE, which would take that room, is ignored.  It comes again. */
int link_tend_receive(struct link *link, uint64_t now_us);

/* Queues a message made of two parts: 0, or LINK_AGAIN while there is no room.
 * Messages may be queued before the peer is known. */
int link_write(struct link *link, const void *head, size_t head_size,
               const void *data, size_t size);

/* Messages of `size` bytes that link_write would take now. */
unsigned link_room(const struct link *link, size_t size);

/* The same behind one of `first` bytes, for which there is room. */
unsigned link_room_behind(const struct link *link, size_t first, size_t size);

/* The oldest message, valid until link_release; false: none. */
bool link_read(struct link *link, struct link_message *message);
void link_release(struct link *link);

/* Drops the messages of which nothing was sent yet; returns how many. */
unsigned link_forget_unsent(struct link *link);

/* Sends a state datagram soon, if the link is up: 1 .. LINK_DATAGRAM_MAX bytes
 * that go beside the messages, ahead of those not sent yet, and may be lost.  A
 * datagram describes a state, not an event, so the newest one replaces those
 * before it.  `bytes` must stay where they are, and may change until they are
 * sent.  With `ask` the peer is asked for its own datagram. */
void link_put_datagram(struct link *link, const void *bytes, size_t size,
                       bool ask);

/* The newest datagram that arrived since the last call, valid until link_poll;
 * false: none. */
bool link_take_datagram(struct link *link, struct link_message *datagram,
                        bool *ask);

/* Sends BYE once everything is acknowledged.  The state is LINK_CLOSED after
 * deadline_us, or when the peer has sent BYE and the answer to it has left. */
void link_close(struct link *link, uint64_t deadline_us);

/* True when the peer has acknowledged everything that was written. */
bool link_idle(const struct link *link);

enum link_state link_state(const struct link *link);
const struct link_statistics *link_statistics(const struct link *link);
const struct link_peer *link_peer(const struct link *link);

/* Whether these bytes contain a whole, sound HELLO of any version. */
bool link_greets(const uint8_t *bytes, size_t size);

/* Microseconds until link_poll must be called again even if no byte comes and
 * nothing is written; 0: at once. */
uint64_t link_next_due_us(const struct link *link, uint64_t now_us);

#endif
