/* Fork and join on a few threads, and what one call of the library may use.
 *
 * Work: 20 us a fork. */
#ifndef HOST_PARALLEL_H
#define HOST_PARALLEL_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

enum { HOST_THREADS_MAX = 256 };

/* The limits of one call of the library, and how far it is.  All threads that
 * work for the call share it.  A thread without one works for the program,
 * which has no such limits. */
struct host_call {
    unsigned threads;        /* 1 to HOST_THREADS_MAX */
    uint64_t memory_max;     /* bytes; UINT64_MAX: no limit */
    _Atomic uint64_t memory; /* bytes that host_map has given and not got back
                              */
    struct host_scratch *scratch; /* scratch.h; NULL: arrays stay in memory */
    atomic_bool cancelled;        /* what works for the call is to end */
    _Atomic uint32_t bricks;      /* whose tetrahedra are made */
    _Atomic unsigned phases;      /* enum of the library: which are behind it */
};

/* The call that this thread works for, or NULL. */
struct host_call *host_call(void);

/* From now on this thread works for that call, or for none (NULL). */
void host_call_enter(struct host_call *call);

/* Whether this thread's call is cancelled: loops over many points poll it. */
bool host_call_cancelled(void);

/* Of a call that puts arrays aside: this thread has touched so many more bytes
 * of them.  Loops over arrays that grow with the input call it after each
 * block, a small part of the limit: 64 KiB, or HOST_CALL_AROUND for each place
 * where it reads in no order, as the kernel maps so much around it. */
void host_call_trim(size_t touched);

enum { HOST_CALL_AROUND = 1 << 16 };

/* Bytes of arrays that each thread of this thread's call may have resident at
 * once, beside what others need; SIZE_MAX: as many as there are. */
size_t host_call_share(void);

/* Processors that affinity and the quota of control groups leave to this
 * process, 1 to HOST_THREADS_MAX. */
unsigned host_processors(void);

/* Threads that may work at a time: the call's, or one a processor. */
unsigned host_threads(void);

struct host_fork {
    pthread_t thread;
    bool running;
    void (*function)(void *);
    void *argument;
    struct host_call *call;
};

/* Runs function(argument) on a thread of its own, which takes no signals, or at
 * once on this one where no thread can be had. */
void host_fork_start(struct host_fork *fork, void (*function)(void *),
                     void *argument);
/* The same where this thread has to go on meanwhile: also in a call of one
 * thread. */
void host_fork_beside(struct host_fork *fork, void (*function)(void *),
                      void *argument);
void host_fork_join(struct host_fork *fork);

/* Calls function(context, part) for every part of [0, parts), each on a thread
 * of its own but the last, and returns when all are done; parts <=
 * HOST_THREADS_MAX. */
void host_fork_all(unsigned parts, void (*function)(void *, unsigned),
                   void *context);

#endif
