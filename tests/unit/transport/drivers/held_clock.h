/* The clock of a test and of the drivers that it tests, in the place of
 * clock_gettime (the Makefile names the tests that are linked so): it goes with
 * the machine's, but by a millisecond at the most between two looks at it, so
 * that no time passes while the machine has others to run. */
#ifndef TESTS_HELD_CLOCK_H
#define TESTS_HELD_CLOCK_H

#include <stdint.h>
#include <time.h>
#include <unistd.h>

enum {
    HELD_US = 1000,
    WAIT_US = 120000000, /* what does not come in so long does not come */
    WAIT_MS = WAIT_US / 1000
};

/* NOLINTBEGIN(bugprone-reserved-identifier) */
int __real_clock_gettime(clockid_t clock, struct timespec *now);
int __wrap_clock_gettime(clockid_t clock, struct timespec *now);

/* clock: what a machine that is never held up is at. */
int __wrap_clock_gettime(clockid_t clock, struct timespec *now) {
    static uint64_t before, held = 1000000000;
    int status = __real_clock_gettime(clock, now);
    uint64_t ns = (uint64_t)now->tv_sec * 1000000000 + (uint64_t)now->tv_nsec;
    uint64_t most = HELD_US * 1000;
    held += before == 0 ? 0 : ns - before < most ? ns - before : most;
    before = ns;
    now->tv_sec = (time_t)(held / 1000000000);
    now->tv_nsec = (long)(held % 1000000000);
    return status;
}
/* NOLINTEND(bugprone-reserved-identifier) */

/* clock: this one. */
static inline uint64_t clock_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

/* Sleeps until so much has passed.  clock: of this one. */
static inline void rest(uint64_t us) {
    for (uint64_t begin = clock_us(); clock_us() - begin < us;)
        (void)usleep(HELD_US / 2);
}

#endif
