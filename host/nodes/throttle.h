/* A machine whose host is slow on purpose, for tests: reads no faster than a
 * rate for a while, all its wires together, and stalls at random.
 *
 * Memory: the struct.  Work: that of the machine beneath, and the sleep.
 *
 *     struct host_throttled throttled;
 *     machine = host_throttle_machine(&throttled, &machine, &throttle);
 */
#ifndef HOST_THROTTLE_H
#define HOST_THROTTLE_H

#include "host/service/machine.h"

struct host_throttle {
    uint64_t stall_us_max;   /* sleeps up to this long, at random; 0: never */
    uint64_t bytes_a_second; /* reads no faster; 0: unlimited */
    uint64_t slow_us;        /* as long as this after the start */
    uint64_t seed;
};

struct host_throttled {
    struct host_machine machine; /* the one beneath */
    struct host_throttled_wire {
        struct host_throttled *throttled;
        struct link_pipe pipe; /* beneath */
    } wire[CUBE_HOST_PORTS_MAX];
    struct host_throttle throttle;
    uint64_t start_us, taken, random;
};

/* `machine` as it looks from a host so throttled. */
struct host_machine host_throttle_machine(struct host_throttled *throttled,
                                          const struct host_machine *machine,
                                          const struct host_throttle *throttle);

#endif
