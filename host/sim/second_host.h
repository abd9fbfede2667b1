/* A second host that knocks at the simulated cube while the first is at work:
 * the host's service as it is, a round at a time, on a connection that takes
 * the place of the first host's, as over TCP.  It has to be sent away.
 *
 * Memory: the service's, while it is there.  Work: its rounds.
 *
 *     host_rival_come(&rival, &world, leave_us, host_us);
 *     ... the world calls host_rival_round as its guest ...
 *     host_rival_leave(&rival);
 *     if (rival.fault != NULL) it was let in;
 */
#ifndef HOST_SIM_RIVAL_H
#define HOST_SIM_RIVAL_H

#include "host/service/service.h"
#include "sim_world.h"

struct host_rival {
    struct host_world *world;
    struct host_service service;
    struct host_machine machine;
    uint64_t leave_us, random;
    uint64_t busy_us, sleep_us; /* until then, by the world's clock */
    uint64_t ahead_us;          /* of that clock, once it has hung up */
    uint32_t host_us;           /* a round, more or less */
    bool there;
    unsigned told;    /* times that it was sent away, */
    uint64_t told_us; /* and when last */
    char fault[256];
};

/* The rival is clear before.  It goes by itself at leave_us at the latest. */
void host_rival_come(struct host_rival *rival, struct host_world *world,
                     uint64_t leave_us, uint32_t host_us);

/* The guest of the world: rival is a struct host_rival. */
void host_rival_round(void *rival);

void host_rival_leave(struct host_rival *rival);

#endif
