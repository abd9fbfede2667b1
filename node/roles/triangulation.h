/* The common part of all roles with a triangulator: its job, its pages, its
 * results, and its time. */
#ifndef NODE_TRIANGULATION_H
#define NODE_TRIANGULATION_H

#include <stdbool.h>

#include "node/common.h"
#include "node/message.h"
#include "outlet.h"
#include "requests.h"

/* The jobs of a role, one at a time: the ranges of bricks that the host gives
 * it, and how long they took. */

struct node_jobs {
    struct node_fault *fault;
    uint32_t bricks;   /* of all jobs, as in the setup */
    uint32_t epoch;    /* of the job */
    bool working;      /* a job is open */
    uint64_t start_us; /* of the job */
    uint64_t wall_us;  /* of the jobs before */
};

/* No job. */
void node_jobs_init(struct node_jobs *jobs, uint32_t bricks,
                    struct node_fault *fault);

/* NODE_JOB: true with *job, which is open from now on.  False: it is unsound,
 * or another job is open, which is a fault. */
bool node_jobs_take(struct node_jobs *jobs, const struct cube_message *message,
                    uint64_t now_us, struct incode_job *job);

/* The open job is over. */
void node_jobs_end(struct node_jobs *jobs, uint64_t now_us);

/* Time of all jobs so far. */
uint64_t node_jobs_wall_us(const struct node_jobs *jobs, uint64_t now_us);

enum { NODE_TRIANGULATION_TABLES = 5 };

/* As a role's memory map names its tables. */
#define NODE_TRIANGULATION_NAMES                                               \
    {"results and spilled faces on their way out", NULL},                      \
        {"triangulator, its local points and tasks", NULL},                    \
        {"active face list", "faces"}, {"open bricks", "entries"}, {           \
        "page frames", "pages of 1568 bytes"                                   \
    }

struct node_triangulation {
    struct node_fault *fault;
    struct incode_triangulator *triangulator;
    struct node_jobs jobs;
    bool exchanges; /* it spills for what others send, room or not */
    bool drained;   /* the triangulator is done, results still leave */
    bool worked;    /* in the last step, which ended then */
    uint64_t now_us;
    bool holds; /* messages, since then, for others to join them */
    uint64_t held_us;
    struct node_requests requests;
    struct node_outlet outlet;
    size_t before; /* bytes of the arena before the triangulator's */
    uint64_t bytes_in;
};

/* Bytes of arena that suffice beside the role's own. */
size_t node_triangulation_min(size_t memory,
                              const struct node_setup_message *setup);

/* Begins in the arena, of which the first `own` bytes are the role's.  peers,
 * lending: of an exchange, or share = NULL, and NULL.  All arguments must
 * outlive it.  False: it does not fit, which is a fault. */
bool node_triangulation_start(struct node_triangulation *t, void *arena,
                              size_t bytes, size_t own,
                              const struct node_setup_message *setup,
                              const struct incode_front_peers *peers,
                              struct node_lending *lending,
                              struct node_counted *counted,
                              struct node_fault *fault);

/* Takes a message from the host or a holder; false: its type is another. */
bool node_triangulation_message(struct node_triangulation *t,
                                const struct cube_message *message,
                                uint64_t now_us);

/* For roles that have other work too. _step: a step of at most so many units;
 * false: there is nothing to do; context: the struct. _close: after some steps,
 * sends what the last one has left. */
bool node_triangulation_step(void *context, uint32_t units, uint32_t *spent);
void node_triangulation_close(struct node_triangulation *t);

/* As those of a role (roles.h); map: its first free table and those after it.
 */
unsigned node_triangulation_send(struct node_triangulation *t);
uint32_t node_triangulation_done(const struct node_triangulation *t);
void node_triangulation_end(struct node_triangulation *t, uint64_t now_us);
uint32_t node_triangulation_held(const struct node_triangulation *t);
void node_triangulation_totals(const struct node_triangulation *t,
                               struct node_finished_message *totals,
                               uint64_t now_us);
void node_triangulation_map(const struct node_triangulation *t,
                            struct node_map *map, unsigned table);

#endif
