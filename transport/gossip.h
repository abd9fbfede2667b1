/* The learner: finds the number of a node that has neither options nor a file.
 * The node waits until a neighbour, or the host, sends a HELLO to a node with
 * these links.  A HELLO to another node is counted and skipped.
 *
 * A neighbour whose link is up sends no HELLO, and a serial wire does not
 * report that this end has started again.  So a node with serial wires asks
 * until it knows its number (PROTOCOL.md).  Over TCP without a key a listener
 * expects a HELLO first, so a pipe without `send` is not asked.
 *
 * Memory: struct learner, LEARN_BYTES a link.  Work: learner_poll reads at most
 * LEARN_BYTES a link; learner_ask sends at most 21 bytes a link. */
#ifndef TRANSPORT_GOSSIP_H
#define TRANSPORT_GOSSIP_H

#include "cube.h"

enum {
    LEARN_BYTES = 64,      /* a greeting takes 44 on the wire */
    LEARN_ASK_BYTES = 32,  /* a question 21, and what its encoder writes past */
    LEARN_ASK_US = 100000, /* between two on a link, at least */
    LEARN_ASKS = 10,       /* a link of the node's own may leave unanswered, */
    LEARN_HOST_ASKS = 3    /* and one to a host that may not be there */
};

struct learned {
    uint16_t self; /* number of this node, */
    uint8_t dimension;
    bool host_port;   /* (other than node 0) the host itself says so */
    uint16_t teacher; /* by the account of this node or CUBE_HOST, */
    uint8_t link;     /* on this link */
    uint32_t epoch;   /* the largest that any greeting said it knew of this
                         node; 0: none did */
};

struct learner {
    struct link_pipe pipes[CUBE_LINKS_MAX];
    unsigned links;
    bool ports;         /* begun by learner_init_ports */
    unsigned host_link; /* there; CUBE_LINKS_MAX: none */
    uint8_t ask[LEARN_ASK_BYTES];
    unsigned ask_size;
    unsigned asks;     /* times, each on all links, */
    unsigned waited;   /* and so many of them since it was found */
    uint64_t asked_us; /* the last time */
    bool found;
    struct learned known; /* once it was found */
    /* Links whose other end has reported the epoch that it knows of this node,
     * or is learning its own number and so knows nothing. */
    uint32_t settled;
    /* HELLOs that arrived at a wrong link: their number, and the last. */
    uint32_t misplaced;
    uint8_t misplaced_link, misplaced_expected;
    /* Greetings to a node with another number of links. */
    uint32_t misfits;
    struct {
        uint8_t bytes[LEARN_BYTES];
        uint8_t size;
        uint8_t ask_left; /* bytes of a question */
        bool skipping;    /* to the next zero */
    } heard[CUBE_LINKS_MAX];
};

void learner_init(struct learner *learner, const struct link_pipe *pipes,
                  unsigned links);

/* For a board that may have more sockets than its cube has dimensions. pipes[0
 * .. ports - 1] are dimensions 0 .. ports - 1.  With `host`, pipes[ports] may
 * lead to the host.  At most CUBE_LINKS_MAX pipes in all. */
void learner_init_ports(struct learner *learner, const struct link_pipe *pipes,
                        unsigned ports, bool host);

/* Asks on each link that has `send`, at most every LEARN_ASK_US; to be called
 * as often as learner_poll, since a pipe may take a part.  A link that is up,
 * or opens, answers with a greeting and stays as it is. */
void learner_ask(struct learner *learner, uint64_t now_us);

/* True: *learned is complete, and further bytes of the pipes are for the cube.
 * A learner of learner_init_ports that asks then waits for all its own links to
 * settle, for at most LEARN_ASKS questions: its neighbours may know of
 * different starts of the node, and it needs the largest epoch. */
bool learner_poll(struct learner *learner, struct learned *learned);

#endif
