/* What all roles of a node share: faults, the check of a setup, counted
 * messages, the keepers of pages, the arena, and the pace of work. */
#ifndef NODE_COMMON_H
#define NODE_COMMON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "message.h"
#include "incode/predicates/yield.h"
#include "transport/cube.h"

/* Why a node cannot go on, as a text with figures for its user.  The first
 * fault stays, because later ones are usually its consequences. */

struct node_fault {
    size_t size; /* of the text; 0: there is no fault */
    char text[NODE_FAULT_TEXT_MAX + 1];
};

/* The first `#` of words becomes a, in decimals, and those after it b; what is
 * longer than NODE_FAULT_TEXT_MAX is cut off. */
void node_fault_set(struct node_fault *fault, const char *words, uint32_t a,
                    uint32_t b);

static inline bool node_fault_is_set(const struct node_fault *fault) {
    return fault->size > 0;
}

/* nodes: nodes of the cube, as the node's board has it.  False: *fault is set.
 */
bool node_setup_read(struct node_setup_message *setup,
                     const struct cube_message *message, unsigned nodes,
                     struct node_fault *fault);

/* What a node gives its role: counted messages, and the function that polls the
 * links during long work.  Messages between a node and the host are counted at
 * both ends.  The host compares the counts, and so learns of messages that a
 * node on their way has lost with its memory. */

struct node_counted {
    struct cube *cube;
    uint16_t self;             /* the node's number */
    uint32_t received, sent;   /* from and to the host, in this generation */
    struct incode_yield yield; /* polls the links in long work */
    /* The board's `write` and its context, or NULL: see board.h. */
    int (*write)(void *context, struct node_counted *counted, uint16_t dest,
                 uint8_t type, const void *data, size_t size);
    void *context;
};

/* As cube_write. */
int node_counted_write(struct node_counted *counted, uint16_t dest,
                       uint8_t type, const void *data, size_t size);

/* The same if there is room for the message: it must succeed. */
void node_counted_put(struct node_counted *counted, uint16_t dest, uint8_t type,
                      const void *data, size_t size);

/* Which node keeps a page: nodes 1 .. holders in turn.  Requesting and keeping
 * nodes use the same functions. */

/* The node from which a page is requested; CUBE_HOST if there are no holders.
 */
static inline uint16_t node_keeper(uint32_t page, uint32_t holders) {
    return (uint16_t)(holders == 0 ? CUBE_HOST : 1 + page % holders);
}

/* The page's index among the pages of its keeper, from 0 on; holders: 1 or
 * more. */
static inline uint32_t node_keeper_place(uint32_t page, uint32_t holders) {
    return page / holders;
}

/* Whether the cube has as many holders as the setup says, and node `self` is a
 * holder if and only if `keeps` (otherwise it would request pages from itself).
 * False: *fault is set. */
bool node_keepers_fit(const struct node_setup_message *setup, unsigned self,
                      bool keeps, struct node_fault *fault);

/* The layout of tables in an arena: each begins at an address that is aligned
 * for every type, vectors included. */

enum { NODE_ALIGNMENT = 64 };

/* Bytes, rounded up so that the next table is aligned. */
static inline size_t node_aligned(size_t bytes) {
    return (bytes + NODE_ALIGNMENT - 1) / NODE_ALIGNMENT * NODE_ALIGNMENT;
}

/* The pace: how long a role works between two polls of the links, by the
 * board's clock, on any processor.  Work is counted in units.  How many units
 * are worked between two readings of the clock is learned from the time that
 * units took. */

enum {
    /* Between two polls of the links, at most.  An acknowledgement may wait as
     * long, on each hop; a frame is sent again after 100 ms at the earliest. */
    NODE_PACE_US = 5000,
    /* A step may last half of it, so that few steps are cut short.  It begins
     * before three eighths are over, and the clock is read each eighth. */
    NODE_PACE_STEP_US = NODE_PACE_US / 2,
    NODE_PACE_LAST_US = NODE_PACE_US * 3 / 8,
    NODE_PACE_LOOKS = 4, /* a step's time */
    /* If units were faster than estimated, the estimate falls by an eighth of
     * the difference when so much time has passed, and by less in less time. */
    NODE_PACE_FALL_US = NODE_PACE_STEP_US / 8,
    NODE_PACE_UNITS_MIN = 8, /* less, and what is begun anew is most of it */
    NODE_PACE_UNITS_MAX = 4096,
    NODE_PACE_UNITS_UNMEASURED_MAX = 1024, /* before any has taken time */
    NODE_STEPS = 32 /* of a role between polls of the links, at most */
};

struct node_pace {
    uint64_t (*now_us)(void *context); /* the board's, and its context */
    void *context;
    uint64_t begun_us, looked_us;
    uint32_t units;   /* that a step may work */
    uint64_t unit_ns; /* that one takes, as far as is known */
    bool measured;    /* the clock has gone on while something was worked */
};

/* One unit at first, as nothing is known of the processor. */
void node_pace_init(struct node_pace *pace, uint64_t (*now_us)(void *context),
                    void *context);

/* The links have been polled. */
void node_pace_begin(struct node_pace *pace, uint64_t now_us);

/* Whether the clock is to be read again, after so many units since the last
 * reading. */
static inline bool node_pace_is_due(const struct node_pace *pace,
                                    uint32_t units) {
    return units * NODE_PACE_LOOKS >= pace->units;
}

/* Calls `step` between two polls of the links, as often as NODE_STEPS and the
 * time allow, while it does something. step may work about `units` units, and
 * sets *spent to the units that it worked.  Returns the number of steps that
 * did something. */
unsigned node_pace_work(struct node_pace *pace,
                        bool (*step)(void *context, uint32_t units,
                                     uint32_t *spent),
                        void *context);

#endif
