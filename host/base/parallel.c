#include "parallel.h"

#include <sched.h>
#include <signal.h>

enum { THREADS_MAX = 16 };

static unsigned threads_most = THREADS_MAX;

unsigned host_threads(void) {
    cpu_set_t set;
    if (threads_most == 1 || sched_getaffinity(0, sizeof set, &set) != 0) {
        return 1;
    }
    unsigned count = (unsigned)CPU_COUNT(&set);
    return count < 1 ? 1 : count > threads_most ? threads_most : count;
}

void host_threads_limit(unsigned most) {
    threads_most = most < 1 ? 1 : most > THREADS_MAX ? THREADS_MAX : most;
}

static void *trampoline(void *argument) {
    struct host_fork *fork = argument;
    fork->function(fork->argument);
    return NULL;
}

void host_fork_start(struct host_fork *fork, void (*function)(void *),
                     void *argument) {
    sigset_t all, before;
    fork->function = function;
    fork->argument = argument;
    (void)sigfillset(&all);
    (void)pthread_sigmask(SIG_BLOCK, &all, &before);
    fork->running = threads_most > 1 &&
                    pthread_create(&fork->thread, NULL, trampoline, fork) == 0;
    (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (!fork->running) {
        function(argument);
    }
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
    struct host_fork fork[THREADS_MAX];
    struct part part[THREADS_MAX];
    for (unsigned i = 0; i + 1 < parts; i++) {
        part[i] = (struct part){function, context, i};
        host_fork_start(&fork[i], run_part, &part[i]);
    }
    if (parts > 0) {
        function(context, parts - 1);
    }
    for (unsigned i = 0; i + 1 < parts; i++) {
        host_fork_join(&fork[i]);
    }
}
