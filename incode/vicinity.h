/* The bricks around one brick, by their boxes alone: most searches beyond the
 * points at hand end among them, without the tree.
 *
 * Memory: struct incode_vicinity, about 6 KB.  Work: a walk of the box pages a
 * brick; a search looks at every box of the list, a vector at a time, and at
 * the leaves of those that it cannot rule out.
 *
 *     incode_vicinity_make(&vicinity, &walker, brick, lo, hi, pages_max);
 *     r = incode_vicinity_visit(&vicinity, &walker, &query, visit, context);
 */
#ifndef INCODE_VICINITY_H
#define INCODE_VICINITY_H

#include <stdalign.h>
#include <stdint.h>

#include "query.h"

enum { INCODE_VICINITY_BRICKS = 192, INCODE_VICINITY_PADDING = 16 };

struct incode_vicinity {
    /* Relative to origin and scaled, rounded outward. */
    alignas(64) float lo[3][INCODE_VICINITY_BRICKS];
    alignas(64) float hi[3][INCODE_VICINITY_BRICKS];
    alignas(64) uint32_t brick[INCODE_VICINITY_BRICKS];
    uint32_t count;
    uint32_t centre; /* brick, or INCODE_NONE */
    uint32_t self;   /* its index, where it is in the list */
    double origin[3], scale;
    double box_lo[3], box_hi[3]; /* what meets this box is in the list */
};

enum incode_listed {
    INCODE_LISTED,
    INCODE_LIST_WAIT, /* for page *missing */
    INCODE_LIST_FULL  /* too many bricks: the list is empty */
};

/* Lists what meets the box lo..hi. */
enum incode_listed incode_vicinity_make(struct incode_vicinity *vicinity,
                                        struct incode_walker *walker,
                                        uint32_t brick, const double lo[3],
                                        const double hi[3], uint32_t *missing);

/* Visits the leaves among the listed bricks that a query concerns: by its ball
 * where it is round, else by its box.  INCODE_WALK_WAIT: query.missing is not
 * there. */
enum incode_walk incode_vicinity_visit(const struct incode_vicinity *vicinity,
                                       struct incode_walker *walker,
                                       struct incode_query *q,
                                       incode_visit *visit, void *context);

/* Bricks of the list that meet the ball of a round query and are not certainly
 * on the known side of its face; returns how many.  Room for a vector more is
 * needed. */
uint32_t incode_vicinity_in_ball(
    const struct incode_vicinity *vicinity, const struct incode_query *q,
    uint32_t brick[INCODE_VICINITY_BRICKS + INCODE_VICINITY_PADDING]);

/* Whether a box lies in that of the list. */
static inline bool incode_vicinity_holds(const struct incode_vicinity *vicinity,
                                         const double lo[3], const double hi[3])
{
    bool holds = true;
    for (int d = 0; d < 3; d++)
        holds = holds && lo[d] >= vicinity->box_lo[d] &&
                hi[d] <= vicinity->box_hi[d];
    return holds;
}

#endif
