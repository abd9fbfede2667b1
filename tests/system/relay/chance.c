#include "chance.h"

#include <time.h>

uint64_t chance_of_seed(uint64_t seed) {
    return seed * 2 + 1;
}

uint64_t chance_draw(uint64_t *random) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return *random >> 33;
}

/* clock: wires have their rates, and trouble comes now and then. */
uint64_t chance_now_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}
