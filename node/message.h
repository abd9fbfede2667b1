/* The messages between the host and the nodes, and between nodes: types and
 * layouts.  All numbers little-endian, structs without padding, so that a node
 * copies them as they are (a machine of another byte order refuses to start).
 *
 * Every message fits CUBE_PAYLOAD_MAX bytes. */
#ifndef NODE_MESSAGE_H
#define NODE_MESSAGE_H

#include <assert.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "incode/front/exchange.h"
#include "incode/paper/list.h"
#include "incode/triangulator.h"
#include "transport/cube.h"

enum {
    NODE_PROTOCOL = 12,             /* both ends must agree */
    NODE_PAGES_A_REQUEST = 64,      /* page numbers in one NODE_PAGE_REQUEST */
    NODE_PAGES_IN_FLIGHT_MAX = 256, /* requested and not arrived, */
    NODE_PAGES_LENT_MAX = 8,        /* and of another node of an exchange */
    NODE_FAULT_TEXT_MAX = 200,      /* bytes */
    NODE_FACES_A_MESSAGE = 128, /* faces in one NODE_SPILL or NODE_UNSPILL */
    NODE_REGIONS_A_MESSAGE = 256,
    NODE_BUILDERS_MAX = 1023, /* of a face manager */
    NODE_OUT_MAX = 6,         /* regions put and not known to be taken */
    NODE_TABLES_MAX = 8       /* of a role, in its memory map */
};

enum node_message_type {
    /* From the host. */
    NODE_SETUP = 1,   /* struct node_setup_message */
    NODE_JOB,         /* struct node_job_message */
    NODE_PAGE,        /* struct node_page_head, then the page's bytes; also from
                         a node */
    NODE_CREDIT,      /* uint32: NODE_RESULT messages allowed since the setup */
    NODE_UNSPILL,     /* struct node_spill_header, then faces */
    NODE_REPORT,      /* nothing: asks for NODE_FINISHED, without a job */
    NODE_STOP,        /* nothing, to all: the run is over */
    NODE_PING,        /* struct node_ping_message: asks for NODE_PONG */
    NODE_REGIONS,     /* struct node_regions_message, then first bricks */
    NODE_OUT,         /* struct incode_job: to be put into the tuple space */
    NODE_PAGE_TO_ALL, /* as NODE_PAGE, to all, without a request */
    NODE_QUESTION,    /* struct node_question_message, below */
    NODE_RESTART,     /* struct node_restart_message */
    /* From the host to a board's loader: loader/image.h.  The node program
     * ignores them. */
    NODE_IMAGE_BEGIN,
    NODE_IMAGE_BLOCK,
    NODE_IMAGE_ASK,
    NODE_IMAGE_DO,
    /* To the host. */
    NODE_READY = 32,   /* struct node_ready_message */
    NODE_PAGE_REQUEST, /* uint32 page numbers; also to a node */
    NODE_RESULT,       /* struct node_result_header, then records: result.h */
    NODE_SPILL,        /* struct node_spill_header, then faces */
    NODE_UNSPILL_REQUEST, /* struct node_spill_header */
    NODE_FINISHED,        /* struct node_finished_message */
    NODE_FAULT,           /* text without a final 0 */
    NODE_PONG,            /* struct node_pong_message */
    NODE_TAKEN,           /* struct node_taken_message */
    NODE_PAGE_PASSED,     /* uint32 node, then the pages that it requested from
                             the sender, which has evicted them */
    NODE_ANSWER,          /* struct node_answer_head, then the answer */
    NODE_IMAGE_STATE,     /* of a loader: loader/image.h */
    NODE_WRONG_PAGE,      /* struct node_wrong_page_message */
    /* From a face manager to a builder, and back: incode/paper/list.h. */
    NODE_LIST = 64, /* struct incode_list, as much as is in use */
    NODE_ANSWERS,   /* struct incode_answers, likewise */
    /* From a node to another: transport/TUPLES.md. */
    NODE_TUPLES = 72,
    /* Between nodes of an exchange. */
    NODE_SHARE = 80,  /* struct node_shared, one after another */
    NODE_WAVE,        /* struct node_wave_message */
    NODE_WAVE_ANSWER, /* struct node_wave_answer_message */
    NODE_LOAN_ASK,    /* nothing: the sender has no work */
    NODE_LOAN,        /* struct incode_loan, as much as is in use */
    NODE_LOAN_FOUND,  /* struct node_found_message, likewise */
    /* From a node to another, in whatever role, and back at once: a trace. */
    NODE_ECHO = 96, /* struct node_echo_message */
    NODE_ECHOED
};

/* What a node does in a generation of the wiring: a row of roles/roles.c. */
enum node_role_number {
    NODE_WORKER = 1,        /* triangulates the jobs that it is given */
    NODE_HOLDER = 2,        /* keeps pages for others */
    NODE_MANAGER = 3,       /* lends the faces of its jobs to builders */
    NODE_BUILDER = 4,       /* finds apexes for a manager */
    NODE_LINDA_MANAGER = 5, /* as those two, over a tuple space of which */
    NODE_LINDA_BUILDER = 6, /* each carries a share */
    NODE_EXCHANGE = 7,      /* triangulates with all others: exchange.h */
    NODE_LINDA_WORKER = 8,  /* a worker that takes its job from that space */
    NODE_ROLES = NODE_LINDA_WORKER /* the last */
};

/* No page: see struct node_pong_message. */
#define NODE_AWAITS_OTHERS (INCODE_NONE - 1)

/* Counted messages are all messages between the host and one node except
 * NODE_STOP.  Both sides count them from 0 in each generation of the cube's
 * wiring.  They arrive in order, so a missing message is lost. */
struct node_ping_message {
    uint32_t sent; /* counted messages to this node before this one */
};

struct node_pong_message {
    uint32_t start;    /* the epoch of this start of the node */
    uint32_t pinged;   /* `sent` of the ping that is answered */
    uint32_t received; /* from the host before that ping */
    uint32_t sent;     /* to the host before this one */
    uint32_t links;    /* bit d: link d has been up since this start */
    uint32_t silent;   /* bit d: link d has been up, and silent for a second; a
                          change is reported by a pong without a ping */
    uint32_t refused;  /* bit d: the peer on link d does not know the key */
    uint32_t work;     /* steps and messages of its role since this start: a
                          change is progress, of whatever size */
    uint32_t awaited;  /* the page that it waits for: its keeper blocks the
                          node; or NODE_AWAITS_OTHERS: it has no work until
                          other nodes make progress; or INCODE_NONE */
    uint32_t owing;    /* the node that blocks this one: it has not sent its
                          answers, or the page; CUBE_HOST: none */
};

/* Begins a node's role; sent to each node once in a generation.  There are no
 * defaults: the host fills in every field; reserved ones are 0.  A node reports
 * a field that is out of its limits as a fault. */
struct node_setup_message {
    /* NODE_PROTOCOL, that of the node as well.  The first field in every
     * version. */
    uint32_t protocol;

    /* Nodes of the cube: 2^dimension, as the node's board has it. */
    uint16_t nodes;

    /* The number of nodes that keep pages: nodes 1 .. holders, in turn
     * (node_keeper); less than `nodes`.  0: the host sends all pages.  A node
     * with the role holder is one of them; a worker is not. */
    uint16_t holders;

    /* NODE_RESULT messages that the node may send before the first NODE_CREDIT,
     * as the host has room for them: 8 + 128 / nodes.  With 0 it waits. */
    uint32_t credits;

    /* What this node does: enum node_role_number. */
    uint8_t role;

    uint8_t reserved[3];

    /* The points and how to search them: incode/triangulator.h. */
    struct incode_setup setup;

    /* The following fields are for a face manager or a builder, and otherwise
     * 0.  Of a builder: its manager, another node. */
    uint16_t manager;

    /* Of a manager: faces a list, 1 to INCODE_LIST_MAX (incode/paper/list.h).
     */
    uint16_t faces_per_job;

    /* Lists that a builder may have at a time, 1 to INCODE_LISTS_MAX
     * (incode/paper/builder.h). */
    uint16_t jobs_per_worker;

    uint16_t reserved2; /* 0 */

    /* Of a manager: its builders, node i in bit i % 8 of byte i / 8; one or
     * more, and not itself. */
    uint8_t builders[(NODE_BUILDERS_MAX + 1) / 8];

    /* Of the tags of all pages of the run: page_check.h. */
    uint64_t page_key;
};

static inline bool node_is_builder(const struct node_setup_message *setup,
                                   unsigned node) {
    return (setup->builders[node / 8] >> node % 8 & 1) != 0;
}

static inline void node_add_builder(struct node_setup_message *setup,
                                    unsigned node) {
    setup->builders[node / 8] |= (uint8_t)(1u << node % 8);
}

/* tag: of what follows, by the host (page_check.h); its low word first. */
struct node_page_head {
    uint32_t page;
    uint32_t tag[2];
};

/* Of data only as many bytes as the page has are sent. */
struct node_page_message {
    struct node_page_head head;
    uint8_t data[INCODE_PAGE_BYTES];
};

/* Reports a page from `sender` that is not as the host made it, or that the
 * sender should not have sent.  page: its number as it arrived, or INCODE_NONE.
 * The node has not used the page, and requests it from the host if it still
 * needs it.  sender CUBE_HOST: the page was altered on the way from the host.
 */
struct node_wrong_page_message {
    uint32_t page;
    uint32_t sender;
};

/* A range of bricks, for a worker or a face manager that has no other. */
struct node_job_message {
    /* Number of this job, at least 1 and of no other job of the run.  Results
     * of another epoch are dropped. */
    uint32_t epoch;

    uint32_t reserved; /* 0 */

    /* Bricks [first, last), first <= last <= bricks of the setup, and the box
     * of their points in the points' unit; an empty one is done at once. */
    struct incode_job job;
};

/* `sent`, here and below: counted messages to the receiver before this one.  If
 * the receiver has counted fewer, some were lost, and it drops this one,
 * because a part of the results alone would be wrong. */
struct node_result_header {
    uint32_t epoch;
    uint32_t sent;
};

/* A node has taken a region out of the tuple space: bricks [first, last). */
struct node_taken {
    uint32_t node, first, last;
};

struct node_taken_message {
    struct node_result_header header; /* of epoch 0 */
    struct node_taken taken;
};

struct node_spill_header {
    uint32_t epoch;
    uint32_t brick; /* of NODE_UNSPILL and its request */
    uint32_t count; /* faces that follow */
    uint32_t last;  /* NODE_UNSPILL: no more of this brick */
    uint32_t sent;  /* NODE_UNSPILL and its request */
};

/* To all nodes.  The first bricks of `count` regions follow, from region
 * `first` on: one for each node, and at the end the brick after the last
 * region.  Then all pages from `to_all` on are sent to all nodes, the last one
 * first. */
struct node_regions_message {
    uint32_t first, count;
    uint32_t to_all;
};

/* A tetrahedron of positive orientation that another node has built, for an
 * owner of one of its vertices; v[3] = INCODE_NONE: a facet of the hull. */
struct node_shared {
    uint32_t v[4];
};

enum node_wave_command {
    NODE_WAVE_READY = 1, /* answered by nodes that are ready to receive */
    NODE_WAVE_COUNT,     /* answered by nodes that are quiet */
    NODE_WAVE_SEED       /* the same, and tries first tetrahedra before */
};

struct node_wave_message {
    uint32_t number; /* 1 and up, one after another */
    uint32_t command;
};

/* Sums over a node and those below it. */
struct node_wave_answer_message {
    uint32_t number;
    uint32_t reserved;       /* 0 */
    uint64_t sent, received; /* struct node_shared */
    uint64_t left;           /* bricks that are not committed */
};

/* The tetrahedra found on a loan. again: the borrower asks for another loan. */
struct node_found_message {
    uint32_t again;
    struct incode_found found;
};

static inline size_t
node_found_bytes(const struct node_found_message *message) {
    return offsetof(struct node_found_message, found) +
           incode_found_bytes(&message->found);
}

/* The memory map of a node, in bytes: all of it, what its board holds outside
 * the arena, and what fills the arena.  `tables` are the role's: their names
 * are in struct node_role. */
struct node_map {
    uint32_t memory; /* fixed and arena */
    uint32_t fixed;  /* .data, .bss, stack and what else the board has */
    uint32_t arena;  /* cube, node and the role's tables fit it */
    uint32_t cube;   /* windows of the links */
    uint32_t node;   /* the node program's own state */
    uint32_t window; /* frames a link and direction */
    uint32_t pages;  /* that the role has room for */
    uint32_t reserved;
    struct {
        uint32_t bytes, count; /* count: of what the table holds, or 0 */
    } tables[NODE_TABLES_MAX];
};

struct node_ready_message {
    uint32_t protocol; /* NODE_PROTOCOL of the node; first in every version */
    uint32_t role;     /* as in the setup */
    struct node_map map;
};

/* Of all jobs and roles since the start of the node. */
struct node_finished_message {
    uint32_t epoch; /* of the job that is done; 0: it is a report alone */
    uint32_t start; /* the epoch of this start of the node */
    uint32_t sent;
    uint32_t links;   /* as in struct node_pong_message */
    uint64_t wall_us; /* from each job's arrival to its last result */
    uint64_t busy_us; /* processor time of the node */
    uint64_t bytes_in, bytes_out; /* payload of messages, at this node */
    uint64_t pages_held;          /* for other nodes: sent from its frames, */
    uint64_t pages_forwarded;     /* requested from, or left to, the host */
    uint64_t retransmitted;       /* frames on all links */
    uint64_t memory_high_water;   /* bytes ever in use, `fixed` included */
    uint32_t stack_bytes;         /* struct node_gauges of the board; 0 where */
    uint32_t stack_high_water;    /* it has none */
    uint32_t overruns;
    uint32_t look_us_max; /* longest between two polls of the links, while the
                             node was not idle */
    struct incode_statistics statistics;
};

/* The layouts are the same on every processor. */
static_assert(sizeof(struct incode_face) == 12, "face layout");
static_assert(sizeof(struct incode_job) == 56, "job layout");
static_assert(sizeof(struct node_pong_message) == 40, "pong layout");
static_assert(sizeof(struct node_job_message) == 64, "job layout");
static_assert(sizeof(struct node_shared) == 16, "share layout");
static_assert(CUBE_PAYLOAD_MAX / sizeof(struct node_shared) <= INCODE_TAKEN_MAX,
              "a message of tetrahedra may come at a time");
static_assert(sizeof(struct node_wave_answer_message) == 32, "wave layout");
static_assert(sizeof(struct node_spill_header) == 20, "spill layout");
static_assert(sizeof(struct node_setup_message) == 240, "setup layout");
static_assert(offsetof(struct node_setup_message, setup) == 16, "setup layout");
static_assert(sizeof(struct node_map) == 32 + 8 * NODE_TABLES_MAX,
              "map layout");
static_assert(sizeof(struct node_ready_message) == 8 + sizeof(struct node_map),
              "ready layout");
static_assert(sizeof(struct node_ready_message) <= CUBE_PAYLOAD_MAX,
              "a memory map fits a message");
static_assert(offsetof(struct node_finished_message, wall_us) == 16,
              "statistics layout");
static_assert(offsetof(struct node_finished_message, stack_bytes) == 80,
              "statistics layout");
static_assert(offsetof(struct node_finished_message, statistics) == 96,
              "statistics layout");
static_assert(sizeof(struct node_finished_message) <= CUBE_PAYLOAD_MAX,
              "statistics fit a message");
static_assert(sizeof(struct incode_answers) <= CUBE_PAYLOAD_MAX,
              "answers fit a message");
static_assert(sizeof(struct node_found_message) <= CUBE_PAYLOAD_MAX &&
                  sizeof(struct incode_loan) <= CUBE_PAYLOAD_MAX,
              "a loan fits a message");
static_assert(sizeof(struct node_page_head) == 12, "page layout");
static_assert(sizeof(struct node_page_message) <= CUBE_PAYLOAD_MAX,
              "a page fits a message");
static_assert(sizeof(struct node_spill_header) +
                      NODE_FACES_A_MESSAGE * sizeof(struct incode_face) <=
                  CUBE_PAYLOAD_MAX,
              "a spill fits a message");

/* Questions of a person to a node, through the host: its identity, links,
 * memory and log; and orders other than jobs.  A node answers them in any role
 * or none, also during a run.  A board's loader answers NODE_WHO, NODE_LINKS,
 * NODE_LOG and NODE_PROBE.  Both ends count these messages like all others. */

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
    uint8_t peer_port; /* of the peer, if it is known */
    uint8_t dead;      /* given up for the run */
    uint16_t peer_node;
    uint16_t reserved; /* 0 */
    uint32_t rtt_us;   /* smoothed; 0: not measured */
    uint32_t frames_in, frames_out, retransmitted;
    uint32_t bad;  /* frames that came and were damaged */
    uint32_t lost; /* bytes that a driver dropped for lack of room;
                      UINT32_MAX: unknown */
    uint64_t bytes_in, bytes_out; /* on the wire */
};

/* Values that change while a node works. */
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
                               image before an order */
};

/* A process ends, and the program that started it starts it again. */
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
