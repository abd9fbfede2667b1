/* The bricks around one brick, by their boxes, and copies of the points of some
 * in single precision: most searches beyond the points at hand end among them,
 * without the tree, and read the points themselves only where they matter.
 *
 * Memory: struct incode_vicinity, about 6 KB, and room for 16 to 32 copies of
 * 768 bytes, given by its owner.  Work: a walk of the box pages a brick; a
 * search looks at every box of the list, a vector at a time, and at the points
 * of those that it cannot rule out.
 *
 *     incode_vicinity_make(&vicinity, &walker, brick, lo, hi, pages_max);
 *     r = incode_vicinity_visit(&vicinity, &walker, &query, visit, context);
 */
#ifndef INCODE_VICINITY_H
#define INCODE_VICINITY_H

#include <stdalign.h>
#include <stdint.h>

#include "query.h"

enum {
    INCODE_VICINITY_BRICKS = 192,
    INCODE_VICINITY_PADDING = 16,
    INCODE_VICINITY_COPIES = 32,
    INCODE_NO_COPY = 0xff
};

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
    /* The points of some of the bricks, in the boxes' units. */
    float (*point)[3][INCODE_BRICK_POINTS];
    uint32_t room; /* for so many of them, up to INCODE_VICINITY_COPIES */
    uint8_t copy[INCODE_VICINITY_BRICKS]; /* which, or INCODE_NO_COPY */
    uint8_t owner[INCODE_VICINITY_COPIES];
    uint32_t next; /* copy to be given away */
};

/* The ball of a round query in the list's units, widened by what rounding to
 * single precision may move its centre, a point in it, or their distance. */
struct incode_vicinity_ball {
    float centre[3], square;
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

/* Indices, in the list, of the bricks that meet the ball of a round query and
 * are not certainly on the known side of its face; returns how many, and the
 * ball.  Room for a vector more is needed. */
uint32_t incode_vicinity_in_ball(
    const struct incode_vicinity *vicinity, const struct incode_query *q,
    struct incode_vicinity_ball *ball,
    uint32_t index[INCODE_VICINITY_BRICKS + INCODE_VICINITY_PADDING]);

void incode_vicinity_set_ball(const struct incode_vicinity *vicinity,
                              const struct incode_query *q,
                              struct incode_vicinity_ball *ball);

/* Copies the points of a listed brick, which is in the frame; the oldest copy
 * gives way. */
void incode_vicinity_copy(struct incode_vicinity *vicinity, uint32_t index,
                          const struct incode_frame *frame);

/* The points of a listed brick that has been copied, one bit each, that are not
 * certainly outside the ball: all are looked at, without a branch on where they
 * are.  The bits past the brick's last point mean nothing. */
uint64_t incode_vicinity_points(const struct incode_vicinity *vicinity,
                                uint32_t index,
                                const struct incode_vicinity_ball *ball);

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
