/* What the relay's wires share: chance from a seed, and the time.
 *
 * Memory: 8 bytes a generator, the caller's. */
#ifndef TESTS_SYSTEM_RELAY_CHANCE_H
#define TESTS_SYSTEM_RELAY_CHANCE_H

#include <stdint.h>

uint64_t chance_of_seed(uint64_t seed);

/* 31 random bits. */
uint64_t chance_draw(uint64_t *random);

/* Microseconds of a clock that never goes back. */
uint64_t chance_now_us(void);

#endif
