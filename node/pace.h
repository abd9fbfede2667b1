/* How much a role works between two looks at the links: as much as fits a time,
 * by the board's clock, whatever the processor.  Work is counted in units, of
 * which some are worked between two looks at the clock; how many, is learned
 * from the time that they took.
 *
 * Memory: the struct.  Work: constant a call; a look at the clock takes as long
 * as the board's.
 *
 *     node_pace_begin(&pace, now_us);
 *     do
 *         triangulate(pace.units);
 *     while (node_pace_goes_on(&pace, pace.units));
 */
#ifndef NODE_PACE_H
#define NODE_PACE_H

#include <stdbool.h>
#include <stdint.h>

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

/* Looks at it.  False: it is time to look at the links. */
bool node_pace_goes_on(struct node_pace *pace, uint32_t units);

/* Work ends with so many, that is, fewer. */
void node_pace_end(struct node_pace *pace, uint32_t units);

/* Steps between two looks at the links: as many as NODE_STEPS and the time
 * allow, while `step` does something.  It may work about so many units, and
 * sets how many it has.  How many steps did something. */
unsigned node_pace_work(struct node_pace *pace,
                        bool (*step)(void *context, uint32_t units,
                                     uint32_t *spent),
                        void *context);

#endif
