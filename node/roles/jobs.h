/* The jobs of a role, one at a time: the ranges of bricks that the host gives
 * it, and how long they took.
 *
 * Memory: the struct.  Work: constant a call.
 *
 *     if (node_jobs_take(&jobs, &message, now_us, &job))
 *         incode_front_start(&front, &job);
 *     node_jobs_end(&jobs, now_us);   // all of it has left
 */
#ifndef NODE_JOBS_H
#define NODE_JOBS_H

#include <stdbool.h>

#include "node/fault.h"
#include "node/message.h"

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

/* NODE_JOB: true with *job, which is open from now on; false: it is not sound,
 * or not the time for it, which is a fault. */
bool node_jobs_take(struct node_jobs *jobs, const struct cube_message *message,
                    uint64_t now_us, struct incode_job *job);

/* The open job is over. */
void node_jobs_end(struct node_jobs *jobs, uint64_t now_us);

/* Time of all jobs so far. */
uint64_t node_jobs_wall_us(const struct node_jobs *jobs, uint64_t now_us);

#endif
