/* A machine whose host is slow on purpose, for tests: reads no faster than a
 * rate for a while, and stalls at random.
 *
 * Memory: the struct.  Work: that of the machine beneath, and the sleep.
 *
 *     machine = host_hinder(&hindered, &machine, &hindrance);
 *     ... use machine ...
 */
#ifndef HOST_HINDRANCE_H
#define HOST_HINDRANCE_H

#include "host/service/machine.h"

struct host_hindrance {
    uint64_t stall_us_max;   /* sleeps up to this long, at random; 0: never */
    uint64_t bytes_a_second; /* reads no faster; 0: unlimited */
    uint64_t slow_us;        /* as long as this after the start */
    uint64_t seed;
};

struct host_hindered {
    struct host_machine machine; /* the one beneath */
    struct host_hindrance hindrance;
    uint64_t start_us, taken, random;
};

/* `machine` as it looks from a host so hindered. */
struct host_machine host_hinder(struct host_hindered *hindered,
                                const struct host_machine *machine,
                                const struct host_hindrance *hindrance);

#endif
