#include "parallel.h"

#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scratch.h"

static _Thread_local struct host_call *call_here;

struct host_call *host_call(void) {
    return call_here;
}

void host_call_enter(struct host_call *call) {
    call_here = call;
}

bool host_call_cancelled(void) {
    const struct host_call *call = call_here;
    return call != NULL &&
           atomic_load_explicit(&call->cancelled, memory_order_relaxed);
}

static _Thread_local size_t touched_here; /* since this thread looked */

void host_call_trim(size_t touched) {
    struct host_call *call = call_here;
    if (call == NULL || call->scratch == NULL)
        return;
    touched_here += touched;
    if (touched_here < call->scratch->step)
        return;
    touched = touched_here;
    touched_here = 0;
    host_scratch_trim(call->scratch, touched);
}

size_t host_call_share(void) {
    enum { SHARE = 8 };
    const struct host_call *call = call_here;
    return call == NULL || call->scratch == NULL
               ? SIZE_MAX
               : (size_t)(call->scratch->resident_max / SHARE / call->threads);
}

/* Processors that the quota "MAX PERIOD" of a control group in `folder` gives,
 * rounded up; `most` where it gives no fewer. */
static unsigned by_quota(const char *folder, unsigned most) {
    char name[4200], text[64];
    (void)snprintf(name, sizeof name, "/sys/fs/cgroup%s/cpu.max", folder);
    FILE *file = fopen(name, "re");
    if (file == NULL)
        return most;
    char *end = NULL;
    unsigned long quota = 0, period = 0;
    if (fgets(text, sizeof text, file) != NULL) {
        quota = strtoul(text, &end, 10); /* "max": 0 */
        period = strtoul(end, NULL, 10);
    }
    (void)fclose(file);
    if (quota == 0 || period == 0)
        return most;
    unsigned long count = (quota + period - 1) / period;
    return count < most ? (unsigned)count : most;
}

unsigned host_processors(void) {
    cpu_set_t set;
    unsigned count = 1;
    if (sched_getaffinity(0, sizeof set, &set) == 0)
        count = (unsigned)CPU_COUNT(&set);
    count = count < 1 ? 1 : count > HOST_THREADS_MAX ? HOST_THREADS_MAX : count;
    /* The group of this process and those above it.  In a container that sees
     * none but its own, that is the root. */
    char line[4096];
    FILE *file = fopen("/proc/self/cgroup", "re");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        if (strncmp(line, "0::", 3) != 0)
            continue;
        line[strcspn(line, "\n")] = '\0';
        for (char *end = line + strlen(line); end != NULL && count > 1;) {
            *end = '\0';
            count = by_quota(line + 3, count);
            end = strrchr(line + 3, '/');
        }
    }
    if (file != NULL)
        (void)fclose(file);
    return count;
}

unsigned host_threads(void) {
    return call_here != NULL ? call_here->threads : host_processors();
}

static void *trampoline(void *argument) {
    struct host_fork *fork = argument;
    call_here = fork->call;
    fork->function(fork->argument);
    if (call_here != NULL && call_here->scratch != NULL)
        host_scratch_ended(call_here->scratch, touched_here);
    return NULL;
}

static void start(struct host_fork *fork, void (*function)(void *),
                  void *argument, bool beside) {
    sigset_t all, before;
    fork->function = function;
    fork->argument = argument;
    fork->call = call_here;
    (void)sigfillset(&all);
    (void)sigdelset(&all, SIGBUS); /* of what is put aside: limits.h */
    (void)pthread_sigmask(SIG_BLOCK, &all, &before);
    fork->running = (beside || call_here == NULL || call_here->threads > 1) &&
                    pthread_create(&fork->thread, NULL, trampoline, fork) == 0;
    (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (!fork->running)
        function(argument);
}

void host_fork_start(struct host_fork *fork, void (*function)(void *),
                     void *argument) {
    start(fork, function, argument, false);
}

void host_fork_beside(struct host_fork *fork, void (*function)(void *),
                      void *argument) {
    start(fork, function, argument, true);
}

void host_fork_join(struct host_fork *fork) {
    if (fork->running) {
        (void)pthread_join(fork->thread, NULL);
        fork->running = false;
    }
}

struct part {
    void (*function)(void *, unsigned);
    void *context;
    unsigned number;
};

static void run_part(void *argument) {
    struct part *part = argument;
    part->function(part->context, part->number);
}

void host_fork_all(unsigned parts, void (*function)(void *, unsigned),
                   void *context) {
    struct host_fork fork[HOST_THREADS_MAX];
    struct part part[HOST_THREADS_MAX];
    for (unsigned i = 0; i + 1 < parts; i++) {
        part[i] = (struct part){function, context, i};
        host_fork_start(&fork[i], run_part, &part[i]);
    }
    if (parts > 0)
        function(context, parts - 1);
    for (unsigned i = 0; i + 1 < parts; i++)
        host_fork_join(&fork[i]);
}
