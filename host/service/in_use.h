/* Whether another host has the nodes, as the node at the end of the host's wire
 * says.  That host may have died just before: then the node says so no more
 * after three seconds, and lets this one in a moment later.  Meanwhile the wire
 * is left alone each time that it was told so, where there is an other who
 * needs it. */
#ifndef HOST_IN_USE_H
#define HOST_IN_USE_H

#include "machine.h"

struct host_in_use {
    uint64_t since_us; /* 0: it is not */
    uint64_t told_us;  /* when the node said so last */
    uint32_t told;     /* times */
};

enum host_in_use_state { HOST_FREE, HOST_TAKEN, HOST_STAYS };

/* peer: who is at the other end of the wire. */
enum host_in_use_state host_in_use_look(struct host_in_use *in_use,
                                        const struct host_machine *machine,
                                        const struct link_peer *peer,
                                        uint64_t now_us);

/* HOST_CUBE: the node at the host's wire; says who has it, where that is
 * known. */
int host_in_use_fail(const struct host_machine *machine, unsigned node,
                     struct host_error *error);

#endif
