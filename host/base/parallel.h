/* Fork and join on a few threads.
 *
 * Memory: a thread's stack for each fork.  Work: 20 us a fork.
 *
 *     struct host_fork fork;
 *     host_fork_start(&fork, first_half, &job);
 *     second_half(&job);
 *     host_fork_join(&fork);
 */
#ifndef HOST_PARALLEL_H
#define HOST_PARALLEL_H

#include <pthread.h>
#include <stdbool.h>

struct host_fork {
    pthread_t thread;
    bool running;
    void (*function)(void *);
    void *argument;
};

/* Processors that this process may use, 1 to 16. */
unsigned host_threads(void);

/* No more than so many from now on; 1: everything runs on the calling thread.
 */
void host_threads_limit(unsigned most);

/* Runs function(argument) on a thread of its own, which takes no signals, or at
 * once on this one where no thread can be had. */
void host_fork_start(struct host_fork *fork, void (*function)(void *),
                     void *argument);
void host_fork_join(struct host_fork *fork);

/* Calls function(context, part) for every part of [0, parts), each on a thread
 * of its own but the last, and returns when all are done; parts <= 16. */
void host_fork_all(unsigned parts, void (*function)(void *, unsigned),
                   void *context);

#endif
