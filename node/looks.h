/* What a node sees of its links: that they move their frames often enough, in
 * the midst of long work as well, which have been up, which have fallen silent,
 * and what its board measures. */
#ifndef NODE_LOOKS_H
#define NODE_LOOKS_H

#include "board.h"
#include "incode/predicates/yield.h"
#include "message.h"

struct node_looks {
    const struct node_board *board;
    struct cube *cube;
    struct {
        uint64_t frames; /* that had come at the last look */
        uint32_t quiet_us;
    } heard[CUBE_LINKS_MAX];
    uint32_t silent;    /* links, as of the last look */
    uint64_t looked_us; /* when that was */
    uint64_t polled_us; /* when frames were moved last, */
    bool busy;          /* and the node has not been idle since */
    uint32_t poll_us_max;
    /* The last look at the clock in the midst of work; how much was to be done
     * until the next, and how long a unit took. */
    uint64_t paused_us;
    uint32_t units;
    uint64_t unit_ns;
    bool working; /* no poll since that look */
    bool tends;   /* in the midst of work; set by who has a clock for that */
};

void node_looks_init(struct node_looks *looks, const struct node_board *board,
                     struct cube *cube);

/* Has the links move their frames; how many. */
unsigned node_looks_poll(struct node_looks *looks, uint64_t now_us);

/* For a role in the midst of its work: looks at the clock, and tends the links
 * where NODE_PACE_US / 4 have passed.  Nothing that came is given to the role
 * meanwhile, and its node stays in the generation that it is in. */
struct incode_yield node_looks_yield(struct node_looks *looks);

/* The node sleeps now: the time until the next poll is no matter of its. */
void node_looks_idle(struct node_looks *looks);

/* Between two messages, and before what the role sends: likewise. */
void node_looks_between(struct node_looks *looks);

/* Whether other links than at the last look have been silent for long; 20 times
 * a second at most. */
bool node_looks_silent(struct node_looks *looks, uint64_t now_us);

/* The links that were silent at the last look and have said nothing since. */
uint32_t node_looks_silent_yet(const struct node_looks *looks);

/* Links that have been up since the start. */
uint32_t node_looks_seen(const struct node_looks *looks);

/* Whether the neighbour at link d needs this node no more: it has said
 * farewell, or is gone. */
bool node_looks_parted(const struct node_looks *looks, unsigned d);

/* What the links and the board have counted. */
void node_looks_totals(const struct node_looks *looks,
                       struct node_finished_message *finished);

#endif
