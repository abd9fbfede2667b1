#include "jobs.h"

#include <string.h>

void node_jobs_init(struct node_jobs *jobs, uint32_t bricks,
                    struct node_fault *fault) {
    memset(jobs, 0, sizeof *jobs);
    jobs->bricks = bricks;
    jobs->fault = fault;
}

/* Its bricks are the setup's, its box is one of numbers, if it has points. */
static bool job_is_sound(const struct node_jobs *jobs,
                         const struct node_job_message *job) {
    const struct incode_job *j = &job->job;
    if (j->first > j->last || j->last > jobs->bricks) {
        node_fault_set(jobs->fault, "invalid job: bricks #..#", j->first,
                       j->last);
        return false;
    }
    if (job->epoch == 0) {
        node_fault_set(jobs->fault, "invalid job: epoch 0", 0, 0);
        return false;
    }
    if (job->reserved != 0) {
        node_fault_set(jobs->fault, "invalid job: what is reserved is #",
                       job->reserved, 0);
        return false;
    }
    for (int d = 0; d < 3 && j->first < j->last; d++) {
        if (!__builtin_isfinite(j->lo[d]) || !__builtin_isfinite(j->hi[d]) ||
            j->lo[d] > j->hi[d]) {
            node_fault_set(jobs->fault,
                           "invalid job: the box of bricks #..# is empty or "
                           "infinite",
                           j->first, j->last);
            return false;
        }
    }
    return true;
}

bool node_jobs_take(struct node_jobs *jobs, const struct cube_message *message,
                    uint64_t now_us, struct incode_job *job) {
    struct node_job_message given;
    if (message->size != sizeof given) {
        node_fault_set(jobs->fault, "job in # bytes, expected #", message->size,
                       sizeof given);
        return false;
    }
    memcpy(&given, message->data, sizeof given);
    if (jobs->working) {
        node_fault_set(jobs->fault, "job # before job # is done", given.epoch,
                       jobs->epoch);
        return false;
    }
    if (!job_is_sound(jobs, &given)) {
        return false;
    }
    jobs->epoch = given.epoch;
    jobs->working = true;
    jobs->start_us = now_us;
    *job = given.job;
    return true;
}

void node_jobs_end(struct node_jobs *jobs, uint64_t now_us) {
    jobs->wall_us += now_us - jobs->start_us;
    jobs->working = false;
}

uint64_t node_jobs_wall_us(const struct node_jobs *jobs, uint64_t now_us) {
    return jobs->wall_us + (jobs->working ? now_us - jobs->start_us : 0);
}
