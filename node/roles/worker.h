/* The worker's role: turns the ports of a triangulator into messages.  Page
 * requests go out in batches; stars are encoded into batches that leave as the
 * host gives credit, commits among them in order; lists that spill go to the
 * host and come back.
 *
 * Memory: one arena, divided by node_worker_start: two outboxes, then the
 * triangulator.  Work: node_worker_work closes at most NODE_STEPS stars, and
 * node_worker_send sends what the link takes.
 *
 *     node_worker_start(&worker, arena, bytes, &counted, &setup, &why);
 *     node_worker_job(&worker, &job, now_us);
 *     moved = node_worker_work(&worker) + node_worker_send(&worker, now_us);
 */
#ifndef NODE_WORKER_H
#define NODE_WORKER_H

#include "node/counted.h"
#include "node/outbox.h"
#include "node/result.h"

enum {
    NODE_STEPS = 32,          /* triangulator's steps between looks at links */
    NODE_WANTED_MAX = 64,     /* pages asked for and not yet sent for */
    NODE_IN_FLIGHT_MAX = 256, /* pages sent for and not yet there */
    NODE_RESULT_SLOTS_MIN = 4,
    NODE_RESULT_SLOTS_MAX = 32,
    NODE_SPILL_SLOTS_MIN = 9,
    NODE_SPILL_SLOTS_MAX = 16
};

struct node_worker {
    struct node_counted *counted;
    struct incode_triangulator *triangulator;
    struct node_setup_message setup;
    uint32_t epoch;    /* of the job */
    bool working;      /* a job is open */
    bool drained;      /* the triangulator is done, results still leave */
    uint64_t start_us; /* of the job */
    uint64_t wall_us;  /* of the jobs before */
    uint32_t wanted[NODE_WANTED_MAX];
    uint32_t wanted_count, in_flight;
    struct node_outbox results; /* leave under credit */
    uint32_t credit, sent;      /* results allowed, results sent */
    struct node_result_writer writer;
    bool open;                 /* writer fills a slot of results */
    struct node_outbox spills; /* leave as the link takes them */
    uint32_t spill_count;      /* faces in the open message of spills */
    uint32_t outbox_bytes;
    uint64_t bytes_in, bytes_out;
    const char *fault; /* NULL, or why this node cannot go on */
};

/* Bytes of both outboxes in a node of so much memory, at most. */
size_t node_worker_outbox_bytes(size_t memory);

/* 0, or -1 where the memory does not suffice: *why says so. */
int node_worker_start(struct node_worker *worker, void *arena, size_t bytes,
                      struct node_counted *counted,
                      const struct node_setup_message *setup, const char **why);

void node_worker_job(struct node_worker *worker,
                     const struct node_job_message *job, uint64_t now_us);

/* A message of type NODE_PAGE, NODE_CREDIT or NODE_UNSPILL. */
void node_worker_message(struct node_worker *worker,
                         const struct cube_message *message);

/* Works on the job; returns the number of steps that did something. */
unsigned node_worker_work(struct node_worker *worker);

/* Sends what may leave; returns the number of messages. */
unsigned node_worker_send(struct node_worker *worker);

/* Slots in use: messages that wait to leave, pages that are on their way. */
uint32_t node_worker_held(const struct node_worker *worker);

/* Whether every result has left and the statistics are due. */
bool node_worker_done(const struct node_worker *worker);

void node_worker_end(struct node_worker *worker, uint64_t now_us);

/* Fills in what the worker knows of the statistics of all its jobs. */
void node_worker_totals(const struct node_worker *worker,
                        struct node_finished_message *totals, uint64_t now_us);

#endif
