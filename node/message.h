/* What the host and the nodes say to each other: message types and their
 * layouts.  All numbers little-endian, structs without padding, so that a node
 * copies them as they are (a machine of another byte order refuses to start).
 *
 * Memory: none.  Work: none.  Every message fits CUBE_PAYLOAD_MAX bytes.
 *
 *     struct node_job_message job;
 *     if (message.type == NODE_JOB && message.size == sizeof job)
 *         memcpy(&job, message.data, sizeof job);
 */
#ifndef NODE_MESSAGE_H
#define NODE_MESSAGE_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#include "incode/triangulator.h"
#include "transport/cube.h"

enum {
    NODE_PROTOCOL = 4,         /* both ends must agree */
    NODE_PAGES_A_REQUEST = 64, /* page numbers in one NODE_PAGE_REQUEST */
    NODE_FAULT_TEXT_MAX = 200,
    NODE_FACES_A_MESSAGE = 128 /* faces in one NODE_SPILL or NODE_UNSPILL */
};

enum node_message_type {
    /* From the host. */
    NODE_SETUP = 1, /* struct node_setup_message */
    NODE_JOB,       /* struct node_job_message */
    NODE_PAGE,      /* uint32 page, then its bytes; also from a holder */
    NODE_CREDIT,    /* uint32: NODE_RESULT messages allowed since the setup */
    NODE_UNSPILL,   /* struct node_spill_header, then faces */
    NODE_REPORT,    /* nothing: asks for NODE_FINISHED, without a job */
    NODE_STOP,      /* nothing, to all: the run is over */
    NODE_PING,      /* struct node_ping_message: asks for NODE_PONG */
    /* To the host. */
    NODE_READY = 32,   /* struct node_ready_message */
    NODE_PAGE_REQUEST, /* uint32 page numbers; also to a holder */
    NODE_RESULT,       /* struct node_result_header, then records: result.h */
    NODE_SPILL,        /* struct node_spill_header, then faces */
    NODE_UNSPILL_REQUEST, /* struct node_spill_header */
    NODE_FINISHED,        /* struct node_finished_message */
    NODE_FAULT,           /* text without a final 0 */
    NODE_PONG             /* struct node_pong_message */
};

/* What a node does in a generation of the wiring: a row of roles/roles.c. */
enum node_role_number {
    NODE_WORKER = 1, /* triangulates the jobs that it is given */
    NODE_HOLDER = 2  /* keeps pages for node 0 */
};

/* Counted messages are all that go between the host and one node, NODE_STOP
 * apart; both sides count them anew in each generation of the cube's wiring.
 * They arrive in order, so any that is missing has been lost for good. */
struct node_ping_message {
    uint32_t sent; /* counted messages to this node before this one */
};

struct node_pong_message {
    uint32_t start;    /* the epoch of this start of the node */
    uint32_t pinged;   /* `sent` of the ping that is answered */
    uint32_t received; /* from the host before that ping */
    uint32_t sent;     /* to the host before this one */
    uint32_t links;    /* bit d: link d has been up since this start */
};

struct node_setup_message {
    uint32_t protocol;
    uint16_t nodes;
    uint16_t holders; /* nodes 1 .. holders keep pages for node 0; or 0 */
    uint32_t credits; /* NODE_RESULT messages allowed at first */
    uint8_t role;     /* enum node_role_number: of the node it is sent to */
    uint8_t reserved[3];
    struct incode_setup setup;
};

struct node_job_message {
    uint32_t epoch; /* results of another epoch are not counted */
    uint32_t reserved;
    struct incode_job job;
};

/* `sent`, here and below: counted messages to the receiver before this one.
 * Where it has had fewer, some were lost, and this one does not count: what
 * follows from a part alone would be wrong. */
struct node_result_header {
    uint32_t epoch;
    uint32_t sent;
};

struct node_spill_header {
    uint32_t epoch;
    uint32_t brick; /* of NODE_UNSPILL and its request */
    uint32_t count; /* faces that follow */
    uint32_t last;  /* NODE_UNSPILL: no more of this brick */
    uint32_t sent;  /* NODE_UNSPILL and its request */
};

/* The memory map of a node, bytes: what its board holds outside the arena,
 * then the tables that fill the arena. */
struct node_map {
    uint32_t memory, fixed, arena;
    uint32_t cube, node, outbox;
    uint32_t control, frames, frame_count, afl, afl_faces, bricks,
        brick_entries, gather, tasks;
    uint32_t window; /* frames a link and direction */
};

struct node_ready_message {
    uint32_t protocol;
    uint32_t role;
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
    uint64_t pages_held, pages_forwarded; /* as a holder of pages */
    uint64_t retransmitted;               /* frames on all links */
    uint64_t memory_high_water;
    struct incode_statistics statistics;
};

/* The layouts are the same on every processor. */
static_assert(sizeof(struct incode_face) == 12, "face layout");
static_assert(sizeof(struct incode_job) == 56, "job layout");
static_assert(sizeof(struct node_job_message) == 64, "job layout");
static_assert(sizeof(struct node_spill_header) == 20, "spill layout");
static_assert(sizeof(struct node_setup_message) ==
                  16 + sizeof(struct incode_setup),
              "setup layout");
static_assert(offsetof(struct node_finished_message, wall_us) == 16,
              "statistics layout");
static_assert(sizeof(struct node_finished_message) <= CUBE_PAYLOAD_MAX,
              "statistics fit a message");
static_assert(4 + INCODE_PAGE_BYTES <= CUBE_PAYLOAD_MAX,
              "a page fits a message");
static_assert(sizeof(struct node_spill_header) +
                      NODE_FACES_A_MESSAGE * sizeof(struct incode_face) <=
                  CUBE_PAYLOAD_MAX,
              "a spill fits a message");

#endif
