/* Who is at the other end of a wire of which nothing else is known: a node
 * greets with its number and the dimension of its cube where it is asked as
 * PROTOCOL.md says, whatever its link does meanwhile.
 *
 * Memory: the struct.  Work: a few bytes a tenth of a second.
 *
 *     struct host_greeting greeting;
 *     host_greeting_wait(&greeting, &machine, true, 3000000);
 *     if (greeting.found)
 *         nodes = 1u << greeting.dimension;
 */
#ifndef HOST_GREETING_H
#define HOST_GREETING_H

#include "host/service/machine.h"

struct host_greeting {
    bool found;
    bool learns;   /* a board that waits to be told who it is */
    uint16_t node; /* who greets, by this port of its */
    uint8_t port;
    uint16_t peer_node; /* whom it expects here */
    uint8_t dimension;
    uint16_t frame_payload; /* bytes */
};

/* Asks by machine->pipe until somebody greets, wait_us at most; first_hello:
 * who is there listens for a link's greeting first, as over a socket. */
void host_greeting_wait(struct host_greeting *greeting,
                        const struct host_machine *machine, bool first_hello,
                        uint64_t wait_us);

#endif
