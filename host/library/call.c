#include "call.h"

#include <errno.h>
#include <fenv.h>
#include <signal.h>
#include <time.h>

#include "incode/predicates/predicates.h"

enum { PROGRESS_MS = 40 };

/* Between the calling thread and that which works. */
struct beside {
    struct library_call *call;
    pthread_mutex_t mutex;
    pthread_cond_t condition;
    bool finished;
};

static void run(struct library_call *call) {
    struct host_call *outer = host_call();
    host_call_enter(&call->host);
    call->status = call->work(call);
    host_call_enter(outer);
}

static void *run_beside(void *argument) {
    struct beside *b = argument;
    run(b->call);
    (void)pthread_mutex_lock(&b->mutex);
    b->finished = true;
    (void)pthread_cond_signal(&b->condition);
    (void)pthread_mutex_unlock(&b->mutex);
    return NULL;
}

static struct timespec after_ms(long ms) {
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    t.tv_nsec += ms * 1000000;
    t.tv_sec += t.tv_nsec / 1000000000;
    t.tv_nsec %= 1000000000;
    return t;
}

/* Calls `progress` until the work is finished. */
static void watch(struct beside *b, const struct incode_options *options) {
    struct library_call *call = b->call;
    (void)pthread_mutex_lock(&b->mutex);
    while (!b->finished) {
        struct timespec until = after_ms(PROGRESS_MS);
        (void)pthread_cond_timedwait(&b->condition, &b->mutex, &until);
        if (b->finished || call->host.cancelled)
            continue;
        (void)pthread_mutex_unlock(&b->mutex);
        if (!options->progress(options->context, call->done(call)))
            call->host.cancelled = true;
        (void)pthread_mutex_lock(&b->mutex);
    }
    (void)pthread_mutex_unlock(&b->mutex);
}

/* Works on a thread of its own, which has the plain floating-point environment
 * that this one has now, and takes no signals; `theirs` is the caller's. */
static void run_watched(struct library_call *call,
                        const struct incode_options *options,
                        const fenv_t *theirs) {
    struct beside b = {.call = call};
    pthread_condattr_t monotonic;
    pthread_t thread;
    sigset_t all, before;
    if (pthread_condattr_init(&monotonic) != 0)
        return;
    (void)pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    (void)pthread_mutex_init(&b.mutex, NULL);
    (void)pthread_cond_init(&b.condition, &monotonic);
    (void)pthread_condattr_destroy(&monotonic);
    (void)sigfillset(&all);
    (void)pthread_sigmask(SIG_BLOCK, &all, &before);
    bool running = pthread_create(&thread, NULL, run_beside, &b) == 0;
    (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
    (void)fesetenv(theirs);
    if (running) {
        watch(&b, options);
        (void)pthread_join(thread, NULL);
    }
    (void)pthread_cond_destroy(&b.condition);
    (void)pthread_mutex_destroy(&b.mutex);
    double done = call->status == INCODE_OK ? 1.0 : call->done(call);
    bool go_on =
        call->host.cancelled || options->progress(options->context, done);
    if (!go_on && call->status == INCODE_OK) {
        if (call->drop != NULL)
            call->drop(call);
        call->status = INCODE_CANCELLED;
    }
}

bool library_options(const struct incode_options **options,
                     unsigned known_flags) {
    static const struct incode_options defaults;
    if (*options == NULL)
        *options = &defaults;
    for (unsigned i = 0; i < 4; i++)
        if ((*options)->reserved[i] != NULL)
            return false;
    return ((*options)->flags & ~known_flags) == 0;
}

/* Reads files of the kernel only where the answer may not be 1. */
static unsigned threads_for(const struct incode_options *o, uint64_t useful) {
    uint64_t threads = o->threads;
    if (threads == 0 && useful > 1)
        threads = host_processors();
    if (o->threads == 0 && useful < threads)
        threads = useful;
    threads = threads < 1 ? 1 : threads;
    return threads < HOST_THREADS_MAX ? (unsigned)threads : HOST_THREADS_MAX;
}

enum incode_status library_call(struct library_call *call,
                                const struct incode_options *options,
                                uint64_t useful) {
    int saved_errno = errno;
    fenv_t theirs;
    (void)fegetenv(&theirs);
    (void)fesetenv(FE_DFL_ENV);
    call->host.threads = threads_for(options, useful);
    call->host.memory_max =
        options->memory_max == 0 ? UINT64_MAX : options->memory_max;
    call->status = INCODE_NO_MEMORY; /* where no thread can be had */
    if (incode_arithmetic_fault() != NULL)
        call->status = INCODE_INTERNAL;
    else if (options->progress != NULL)
        run_watched(call, options, &theirs);
    else
        run(call);
    (void)fesetenv(&theirs);
    errno = saved_errno;
    return call->status;
}
