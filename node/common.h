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
 * fault stays: what follows is its consequence as a rule. */

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

/* nodes: of the cube, as the node's board has it.  False: *fault. */
bool node_setup_read(struct node_setup_message *setup,
                     const struct cube_message *message, unsigned nodes,
                     struct node_fault *fault);

/* What a node gives its role: messages, of which those between it and the host
 * are counted, and what looks at the links while it works long.  The host
 * compares the counts with its own, and so learns of those that a node on their
 * way has lost with its memory. */

struct node_counted {
    struct cube *cube;
    uint16_t self;             /* the node's number */
    uint32_t received, sent;   /* from and to the host, in this generation */
    struct incode_yield yield; /* what looks at the links in long work */
    /* The board's `write` and its context, or NULL: see board.h. */
    int (*write)(void *context, struct node_counted *counted, uint16_t dest,
                 uint8_t type, const void *data, size_t size);
    void *context;
};

/* As cube_write. */
int node_counted_write(struct node_counted *counted, uint16_t dest,
                       uint8_t type, const void *data, size_t size);

/* The same where there is room for it: it must succeed. */
void node_counted_put(struct node_counted *counted, uint16_t dest, uint8_t type,
                      const void *data, size_t size);

/* Which node keeps a page: of nodes 1 .. holders in turn, as those who ask for
 * pages and those who keep them must agree. */

/* Whom to ask for the page: CUBE_HOST where there are no holders. */
static inline uint16_t node_keeper(uint32_t page, uint32_t holders) {
    return (uint16_t)(holders == 0 ? CUBE_HOST : 1 + page % holders);
}

/* The page's place among those of its keeper, from 0 on; holders: 1 or more. */
static inline uint32_t node_keeper_place(uint32_t page, uint32_t holders) {
    return page / holders;
}

/* Whether the cube has as many holders as the setup says, and node `self` is
 * one of them where it is to be, and else none: it would ask itself for pages.
 * False: *fault. */
bool node_keepers_fit(const struct node_setup_message *setup, unsigned self,
                      bool keeps, struct node_fault *fault);

/* How the tables of an arena are laid: each begins at an address that suits
 * anything, vector lanes included. */

enum { NODE_ALIGNMENT = 64 };

/* Bytes, rounded up so that what follows is aligned for anything. */
static inline size_t node_aligned(size_t bytes) {
    return (bytes + NODE_ALIGNMENT - 1) / NODE_ALIGNMENT * NODE_ALIGNMENT;
}

/* How much a role works between two looks at the links: as much as fits a time,
 * by the board's clock, whatever the processor.  Work is counted in units, of
 * which some are worked between two looks at the clock; how many, is learned
 * from the time that they took. */

enum {
    /* Between two looks at the links, at most.  An acknowledgement may wait for
     * as long; a frame is sent again after 100 ms at least, and each hop on
     * its way may cost this much. */
    NODE_PACE_US = 5000,
    /* A step may last half of it, so that few are cut short; it begins before
     * three eighths are over, and the clock is looked at each eighth. */
    NODE_PACE_STEP_US = NODE_PACE_US / 2,
    NODE_PACE_LAST_US = NODE_PACE_US * 3 / 8,
    NODE_PACE_LOOKS = 4, /* a step's time */
    /* Where a look finds units faster, the estimate falls by an eighth of the
     * difference, if so much time has passed, and by less in less. */
    NODE_PACE_FALL_US = NODE_PACE_STEP_US / 8,
    NODE_PACE_UNITS_MIN = 8, /* less, and what is begun anew is most of it */
    NODE_PACE_UNITS_MAX = 4096,
    NODE_PACE_UNITS_UNMEASURED_MAX = 1024, /* before any has taken time */
    NODE_STEPS = 32 /* of a role between looks at links, at most */
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

/* The links have been looked at. */
void node_pace_begin(struct node_pace *pace, uint64_t now_us);

/* Whether so many units since the last look at the clock are worth another. */
static inline bool node_pace_is_due(const struct node_pace *pace,
                                    uint32_t units) {
    return units * NODE_PACE_LOOKS >= pace->units;
}

/* Steps between two looks at the links: as many as NODE_STEPS and the time
 * allow, while `step` does something.  It may work about so many units, and
 * sets how many it has.  How many steps did something. */
unsigned node_pace_work(struct node_pace *pace,
                        bool (*step)(void *context, uint32_t units,
                                     uint32_t *spent),
                        void *context);

#endif
