/* A node's polls of its links.  They move frames often enough, also during long
 * work, and record which links have been up and which are silent, and the
 * measurements of the board. */
#ifndef NODE_LOOKS_H
#define NODE_LOOKS_H

#include "board.h"
#include "incode/predicates/yield.h"
#include "message.h"

struct node_looks {
    const struct node_board *board;
    struct cube *cube;
    struct {
        uint64_t frames; /* received until the last check */
        uint32_t quiet_us;
    } heard[CUBE_LINKS_MAX];
    uint32_t silent;    /* links, as of the last look */
    uint64_t looked_us; /* when that was */
    uint64_t polled_us; /* when frames were moved last, */
    bool busy;          /* and the node has not been idle since */
    uint32_t poll_us_max;
    /* The last reading of the clock during work; the units until the next, and
     * the time of a unit. */
    uint64_t paused_us;
    uint32_t units;
    uint64_t unit_ns;
    bool working; /* no poll since that look */
    bool tends;   /* during work; set by a caller that has a clock */
};

void node_looks_init(struct node_looks *looks, const struct node_board *board,
                     struct cube *cube);

/* Moves the frames of the links; returns how many. */
unsigned node_looks_poll(struct node_looks *looks, uint64_t now_us);

/* For a role during its work: reads the clock, and moves frames if NODE_PACE_US
 * / 4 have passed.  Meanwhile no message is given to the role, and the node
 * stays in its generation. */
struct incode_yield node_looks_yield(struct node_looks *looks);

/* The node sleeps now: the time until the next poll does not count. */
void node_looks_idle(struct node_looks *looks);

/* Called between two messages, and before the role sends: moves frames
 * likewise. */
void node_looks_between(struct node_looks *looks);

/* Whether the set of silent links has changed since the last check; checks at
 * most 20 times a second. */
bool node_looks_silent(struct node_looks *looks, uint64_t now_us);

/* The links that were silent at the last check and from which nothing has
 * arrived since. */
uint32_t node_looks_silent_yet(const struct node_looks *looks);

/* Links that have been up since the start. */
uint32_t node_looks_seen(const struct node_looks *looks);

/* Whether the neighbour at link d does not need this node any more: it has sent
 * BYE, or is gone. */
bool node_looks_parted(const struct node_looks *looks, unsigned d);

/* What the links and the board have counted. */
void node_looks_totals(const struct node_looks *looks,
                       struct node_finished_message *finished);

#endif
