#include "guard.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <unistd.h>

#include "host/base/clock.h"

static const int signals[HOST_GUARD_SIGNALS] = {SIGINT, SIGTERM, SIGHUP,
                                                SIGQUIT, SIGTSTP};

/* What a handler can reach: signals come to any thread. */
static volatile sig_atomic_t came[HOST_GUARD_SIGNALS];
static volatile sig_atomic_t pipe_end = -1;

static void take(int signal) {
    int reason = errno;
    for (int i = 0; i < HOST_GUARD_SIGNALS; i++) {
        came[i] = came[i] || signals[i] == signal;
    }
    if (signal != SIGTSTP) {
        /* A pipe that is full wakes as well. */
        (void)!write((int)pipe_end, "", 1);
    }
    errno = reason;
}

int host_guard_begin(struct host_guard *guard) {
    struct sigaction action = {.sa_handler = take, .sa_flags = SA_RESTART};
    memset(guard, 0, sizeof *guard);
    if (pipe2(guard->ends, O_CLOEXEC | O_NONBLOCK) != 0) {
        return -1;
    }
    sigfillset(&action.sa_mask);
    pipe_end = guard->ends[1];
    for (int i = 0; i < HOST_GUARD_SIGNALS; i++) {
        came[i] = 0;
        guard->taken[i] = sigaction(signals[i], NULL, &guard->before[i]) == 0 &&
                          guard->before[i].sa_handler != SIG_IGN &&
                          sigaction(signals[i], &action, NULL) == 0;
    }
    return 0;
}

bool host_guard_wait(struct host_guard *guard, unsigned ms) {
    struct pollfd look = {.fd = guard->ends[0], .events = POLLIN};
    uint64_t end_us = host_now_us() + (uint64_t)ms * 1000, now_us;
    int got = 0;
    while (got <= 0 && (now_us = host_now_us()) < end_us) {
        got = poll(&look, 1, (int)((end_us - now_us + 999) / 1000));
    }
    return got <= 0;
}

void host_guard_end(struct host_guard *guard) {
    for (int i = 0; i < HOST_GUARD_SIGNALS; i++) {
        if (guard->taken[i]) {
            (void)sigaction(signals[i], &guard->before[i], NULL);
        }
    }
    /* A handler may still be at work in another thread: what it writes to is
     * the last to go. */
    for (int i = 0; i < HOST_GUARD_SIGNALS; i++) {
        if (came[i]) {
            came[i] = 0;
            (void)raise(signals[i]);
        }
    }
    pipe_end = -1;
    close(guard->ends[0]);
    close(guard->ends[1]);
}
