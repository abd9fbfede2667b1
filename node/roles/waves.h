/* Detects that all nodes of a cube have nothing to do, by waves along the
 * binomial tree of node 0, in which the parent of node i is i & (i - 1).  A
 * wave goes down from node 0 at once.  A node answers when it is quiet and has
 * its children's answers.  The answer has the sums of tetrahedra that this
 * subtree has sent to other nodes and received from them.  If two waves have
 * the same sums, and as much was received as sent, the whole cube was quiet
 * between them, and nothing was under way (the four counters of Mattern,
 * Distributed Computing 2:161-175, 1987).
 *
 * The first wave is the barrier at the start: a node answers it when it is
 * ready to receive.  The next lets all nodes begin.  If the cube is quiet and
 * work is left, a wave orders all nodes to try first tetrahedra.  If that has
 * been done, the cube is stuck, which is a fault.
 *
 * If a tetrahedron was sent and does not arrive, although no link has lost it,
 * waves would go on for ever.  Links may be slow, but nodes answer waves
 * meanwhile, and each node takes the messages that have arrived before it
 * answers.  So it is a fault if sent and received differ and have not changed
 * for NODE_WAVES_UNCHANGED waves and for NODE_WAVES_UNCHANGED_US; no living
 * link keeps a frame that long.  Neither condition alone is enough: waves are
 * fast on fast links, and a node that is stopped answers none. */
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
    uint16_t to_tell;   /* children without this wave so far */
    uint16_t to_answer; /* children that have not answered */
    bool seeded;        /* at node 0: the cube has been ordered to */
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

/* Forwards waves and answers; returns the number of messages.  At node 0,
 * *command is the command of a wave that this node must follow as well, or 0.
 */
unsigned node_waves_send(struct node_waves *waves,
                         const struct node_waves_state *state,
                         uint8_t *command);

#endif
