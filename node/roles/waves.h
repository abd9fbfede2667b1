/* Whether all nodes of a cube have nothing to do: waves along the binomial tree
 * of node 0, in which the parent of node i is i & (i - 1).  A wave goes down
 * from node 0 at once; its answers come up, each when a node is quiet and has
 * those of its children, with what all of them have sent to others and had from
 * them.  Two waves with the same sums, as much received as sent, mean that the
 * whole cube was quiet between them, and nothing was under way (the four
 * counters of Mattern, Distributed Computing 2:161-175, 1987).
 *
 * The first wave is the barrier at the start: it is answered by who is ready to
 * receive.  The next lets all begin.  Where the cube is quiet and work is left,
 * one tells all to seed; where that has been, it is stuck.
 *
 * A tetrahedron that was sent and does not come, although no link has lost it,
 * would have waves go round for ever.  Links may be slow, but the nodes answer
 * waves meanwhile, and each takes what has come before it does; so where
 * the sums have differed and not changed for NODE_WAVES_UNCHANGED waves and for
 * NODE_WAVES_UNCHANGED_US, which no living link keeps a frame for, it is a
 * fault.  One of the two is not enough: waves are quick where links are, and a
 * node that stands still answers none. */
#ifndef NODE_WAVES_H
#define NODE_WAVES_H

#include <stdbool.h>

#include "node/common.h"
#include "node/message.h"

enum { NODE_WAVES_UNCHANGED = 1000, NODE_WAVES_UNCHANGED_US = 60000000 };

/* Of one node, as it is now. */
struct node_waves_state {
    bool ready;              /* to receive from others */
    bool quiet;              /* it has nothing to do, and nothing to send */
    uint64_t sent, received; /* to and from others */
    uint64_t left;           /* work that it has not done */
};

struct node_waves {
    struct node_counted *counted;
    struct node_fault *fault;
    uint16_t children;  /* links d: node self | 1 << d is one */
    uint32_t number;    /* of the wave; 0: there was none */
    uint8_t command;    /* of the wave: enum node_wave_command */
    bool begun;         /* the barrier is passed */
    bool open;          /* this node has not answered */
    uint16_t to_tell;   /* children that have not been told */
    uint16_t to_answer; /* children that have not answered */
    bool seeded;        /* at node 0: all have been told to */
    bool over;          /* at node 0: no work is left */
    struct node_wave_answer_message sum, before;
    uint64_t now_us; /* the node's clock, for the caller to set */
    /* At node 0: waves in which the sums differed as before, and since when. */
    uint32_t unchanged;
    uint64_t unchanged_us;
};

void node_waves_init(struct node_waves *waves,
                     const struct node_setup_message *setup,
                     struct node_counted *counted, struct node_fault *fault);

/* At node 0: the first wave. */
void node_waves_begin(struct node_waves *waves);

/* Passes on what is to be; the number of messages.  At node 0, *command is what
 * the cube is told that this node has to follow as well, or 0. */
unsigned node_waves_send(struct node_waves *waves,
                         const struct node_waves_state *state,
                         uint8_t *command);

#endif
