#include "in_use.h"

#include "onlookers.h"

enum {
    IN_USE_US_MAX = 5000000,  /* longer than a link keeps to a silent host, */
    IN_USE_US_LAST = 9000000, /* whether it was told so again or not */
    IN_USE_TOLD_US = 2000000, /* it is told so more often as long as it is so */
    IN_USE_REST_US = 1000000
};

enum host_in_use_state host_in_use_look(struct host_in_use *in_use,
                                        const struct host_machine *machine,
                                        const struct link_peer *peer,
                                        uint64_t now_us) {
    if (peer->refusal != LINK_IN_USE) {
        in_use->since_us = 0;
        return HOST_FREE;
    }
    if (in_use->since_us == 0) {
        in_use->since_us = now_us;
    }
    if (in_use->told != peer->in_use) {
        in_use->told_us = now_us;
        if (machine->rest != NULL) {
            machine->rest(machine->context, IN_USE_REST_US);
        }
    }
    in_use->told = peer->in_use;
    uint64_t passed = now_us - in_use->since_us;
    bool stays =
        passed > IN_USE_US_LAST ||
        (passed > IN_USE_US_MAX && now_us - in_use->told_us <= IN_USE_TOLD_US);
    return stays ? HOST_STAYS : HOST_TAKEN;
}

int host_in_use_fail(const struct host_machine *machine, unsigned node,
                     struct host_error *error) {
    const struct host_onlookers *them = machine->onlookers;
    const char *holder = them == NULL ? NULL : them->holder(them->context);
    return holder == NULL
               ? host_fail(error, HOST_CUBE,
                           "node %u link %u: the cube is in use by another "
                           "host; wait until its run is over, or end it",
                           node, machine->dimension)
               : host_fail(error, HOST_CUBE,
                           "node %u link %u: the cube is in use by %s; wait "
                           "until it has ended, or end it; look on meanwhile "
                           "with: incode console %s",
                           node, machine->dimension, holder,
                           host_where(machine));
}
