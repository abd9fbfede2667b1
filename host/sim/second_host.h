/* A second host that comes to the simulated cube while the first is at work:
 * the host's service as it is, a round at a time, on a connection that takes
 * the place of the first host's, as over TCP.  It has to be sent away. */
#ifndef HOST_SIM_SECOND_HOST_H
#define HOST_SIM_SECOND_HOST_H

#include "host/service/service.h"
#include "sim_world.h"

struct host_second_host {
    struct host_world *world;
    struct host_service service;
    struct host_machine machine;
    uint64_t leave_us, random;
    uint64_t busy_us, sleep_us; /* until then, by the world's clock */
    uint64_t ahead_us;          /* of that clock, once it has hung up */
    uint32_t host_us;           /* a round, more or less */
    bool there;
    unsigned refused;    /* times that it was sent away, */
    uint64_t refused_us; /* and when last */
    char fault[256];
};

/* The host is clear before.  It goes by itself at leave_us at the latest. */
void host_second_host_come(struct host_second_host *host,
                           struct host_world *world, uint64_t leave_us,
                           uint32_t host_us);

/* The `second` of the world: host is a struct host_second_host. */
void host_second_host_round(void *host);

void host_second_host_leave(struct host_second_host *host);

#endif
