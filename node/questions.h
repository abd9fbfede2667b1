/* What a person asks of a node, by the host: who it is, how its links are, how
 * full its memory, what it last said; and what it is told to do but compute.
 * All of them are asked and answered in any role and in none, in the midst of a
 * run as well; a board's loader answers NODE_WHO, NODE_LINKS, NODE_LOG and
 * NODE_PROBE.  Both ends count these messages as all others (message.h).
 *
 * Memory: none.  Work: none.  Layouts as in message.h.
 *
 *     struct node_question_message question = {.tag = 7, .what = NODE_WHO};
 *     struct node_answer_head head = {question.tag, question.what};
 *     memcpy(bytes, &head, sizeof head);
 */
#ifndef NODE_QUESTIONS_H
#define NODE_QUESTIONS_H

#include "message.h"

enum node_question {
    NODE_WHO = 1, /* struct node_who */
    NODE_LINKS,   /* struct node_link_state, one a link */
    NODE_TOP,     /* struct node_top */
    NODE_MEMORY,  /* struct node_ready_message: its map; role 0: it has none */
    NODE_TOTALS,  /* struct node_finished_message, as a report */
    NODE_LOG,     /* text, lines ended by \n: what it has to say for itself, its
                     last fault and why it started last */
    NODE_PROBE, /* struct node_probe: how long the way to another node and back
                   takes; answered when that one has, or PROBE_US are over */
    NODE_QUESTIONS = NODE_PROBE
};

enum {
    NODE_BOARD_BYTES = 16,   /* of a board's name, padded with zeros */
    NODE_VERSION_BYTES = 24, /* of a version, likewise */
    NODE_SERIAL_BYTES = 8,   /* all zero: the board has none */
    NODE_DIGEST_BYTES = 32,  /* of an image; all zero: it runs none */
    NODE_PROBE_US = 2000000
};

struct node_question_message {
    uint32_t tag;  /* comes back with the answer */
    uint32_t what; /* enum node_question */
    uint32_t node; /* NODE_PROBE: that one; else 0 */
};

struct node_answer_head {
    uint32_t tag, what;
};

enum node_kind {
    NODE_KIND_PROCESS = 1, /* the node program over a system */
    NODE_KIND_PROGRAM,     /* the node program on a bare board */
    NODE_KIND_LOADER       /* a bare board's loader */
};

struct node_who {
    uint32_t protocol;               /* NODE_PROTOCOL, first in every version */
    uint32_t kind;                   /* enum node_kind */
    uint8_t board[NODE_BOARD_BYTES]; /* as --board names it */
    uint8_t version[NODE_VERSION_BYTES]; /* of what runs */
    uint8_t loader[NODE_VERSION_BYTES]; /* of the board's loader; zeros: none */
    uint8_t serial[NODE_SERIAL_BYTES];
    uint8_t digest[NODE_DIGEST_BYTES]; /* of the image that runs; a loader's: of
                                          the one that it would start */
    uint32_t number;                   /* of that image, as its signer counts */
    uint32_t boot;  /* number of this start; 0: the board counts none, or its
                       loader waits, as the flash takes no record any more */
    uint32_t epoch; /* of this start */
    uint32_t uptime_s;
    uint32_t role;   /* enum node_role_number; 0: none */
    uint32_t memory; /* bytes, fixed and arena */
};

struct node_link_state {
    uint8_t state;     /* enum link_state */
    uint8_t refusal;   /* enum link_refusal */
    uint8_t peer_port; /* who is there, where that is known */
    uint8_t dead;      /* given up for the run */
    uint16_t peer_node;
    uint16_t reserved; /* 0 */
    uint32_t rtt_us;   /* smoothed; 0: not measured */
    uint32_t frames_in, frames_out, retransmitted;
    uint32_t bad;  /* frames that came and were damaged */
    uint32_t lost; /* bytes that a driver had no room for; UINT32_MAX: it
                      does not know */
    uint64_t bytes_in, bytes_out; /* on the wire */
};

/* What moves while a node works. */
struct node_top {
    uint32_t role;
    uint32_t work;         /* as in struct node_pong_message */
    uint32_t memory, used; /* bytes in all, and in use, or ever in use */
    uint32_t pages, held;  /* that there is room for, and that are there */
    uint32_t faces, open;  /* that the front has room for, and open ones */
    uint64_t wall_us, busy_us;
    uint64_t bytes_in, bytes_out; /* on all wires */
    uint64_t built;               /* tetrahedra */
};

struct node_probe {
    uint32_t node;
    uint32_t rtt_us; /* UINT32_MAX: no answer in NODE_PROBE_US */
};

struct node_echo_message {
    uint32_t tag;
};

enum node_restart {
    NODE_RESTART_PLAIN = 1, /* begins anew, as after a reset */
    NODE_RESTART_STAY       /* and its loader, if it has one, does not start an
                               image before it is told to */
};

/* A process ends, for who started it to start it again. */
struct node_restart_message {
    uint32_t what; /* enum node_restart */
};

static_assert(sizeof(struct node_question_message) == 12, "question layout");
static_assert(sizeof(struct node_who) == 136, "who layout");
static_assert(sizeof(struct node_link_state) == 48, "link layout");
static_assert(sizeof(struct node_top) == 72, "top layout");
static_assert(sizeof(struct node_answer_head) +
                      CUBE_LINKS_MAX * sizeof(struct node_link_state) <=
                  CUBE_PAYLOAD_MAX,
              "links fit a message");

#endif
