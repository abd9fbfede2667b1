/* Who a node is that has neither options nor a file: it listens on its links
 * until a neighbour, or the host, greets a node that has such links there.  A
 * greeting to another is counted, and passed over.  Nothing is sent.
 *
 * Memory: struct learner, LEARN_BYTES a link.  Work: learner_poll reads at most
 * LEARN_BYTES a link.
 *
 *     learner_init(&learner, pipes, links);
 *     while (!learner_poll(&learner, &learned))
 *         wait();
 *     config.self = learned.self, config.dimension = learned.dimension;
 */
#ifndef TRANSPORT_LEARN_H
#define TRANSPORT_LEARN_H

#include "cube.h"

enum { LEARN_BYTES = 64 }; /* a greeting takes 44 on the wire */

struct learned {
    uint16_t self; /* who this node is, */
    uint8_t dimension;
    bool host_port;   /* (other than node 0) the host itself says so */
    uint16_t teacher; /* by the account of this node or CUBE_HOST, */
    uint8_t link;     /* on this link */
};

struct learner {
    struct link_pipe pipes[CUBE_LINKS_MAX];
    unsigned links;
    /* Greetings that came in by another link than they should: the last. */
    uint32_t misplaced;
    uint8_t misplaced_link, misplaced_expected;
    /* Greetings to a node with another number of links. */
    uint32_t misfits;
    struct {
        uint8_t bytes[LEARN_BYTES];
        uint8_t size;
        bool skipping; /* to the next zero */
    } heard[CUBE_LINKS_MAX];
};

void learner_init(struct learner *learner, const struct link_pipe *pipes,
                  unsigned links);

/* True: *learned tells; what more the pipes have brought is for the cube. */
bool learner_poll(struct learner *learner, struct learned *learned);

#endif
