#include "wait.h"

#include <sched.h>
#include <stddef.h>
#include <time.h>

static uint64_t clock_us(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

void wait_files(struct pollfd *fds, nfds_t count, uint64_t wait_us,
                uint64_t awake_us) {
    uint64_t awake = awake_us < wait_us ? awake_us : wait_us;
    uint64_t start = awake > 0 ? clock_us() : 0;
    while (awake > 0 && clock_us() - start < awake) {
        if (poll(fds, count, 0) != 0) {
            return;
        }
        (void)sched_yield();
    }
    struct timespec wait = {(time_t)(wait_us / 1000000),
                            (long)(wait_us % 1000000) * 1000};
    (void)ppoll(fds, count, &wait, NULL);
}
