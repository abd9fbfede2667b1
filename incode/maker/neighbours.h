/* The bricks around one brick, by their boxes, and copies of the points of some
 * in single precision: most searches beyond the local points end among them,
 * without the tree, and read the points themselves only where they matter.
 *
 * Memory: struct incode_neighbours, about 6 KB, and room for 16 to 32 copies of
 * 768 bytes, given by its owner.  Work: a walk of the box pages a brick; a
 * search looks at every box of the list, a vector at a time, and at the points
 * of those that it cannot rule out.
 *
 *     incode_neighbours_make(&list, &walker, brick, lo, hi, &missing);
 *     walked = incode_neighbours_visit(&list, &walker, &q, incode_visit_points,
 *                                      NULL);
 */
#ifndef INCODE_NEIGHBOURS_H
#define INCODE_NEIGHBOURS_H

#include <stdalign.h>
#include <stdint.h>

#include "query.h"

enum {
    INCODE_NEIGHBOURS_BRICKS = 192,
    INCODE_NEIGHBOURS_PADDING = 16,
    INCODE_NEIGHBOURS_COPIES = 32,
    INCODE_NO_COPY = 0xff
};

struct incode_neighbours {
    /* Relative to origin and scaled, rounded outward. */
    alignas(64) float lo[3][INCODE_NEIGHBOURS_BRICKS];
    alignas(64) float hi[3][INCODE_NEIGHBOURS_BRICKS];
    alignas(64) uint32_t brick[INCODE_NEIGHBOURS_BRICKS];
    uint32_t count;
    uint32_t centre; /* brick, or INCODE_NONE */
    uint32_t self;   /* its index, where it is in the list */
    double origin[3], scale;
    double box_lo[3], box_hi[3]; /* what meets this box is in the list */
    /* The points of some of the bricks, in the boxes' units. */
    float (*point)[3][INCODE_BRICK_POINTS];
    uint32_t room; /* for so many of them, up to INCODE_NEIGHBOURS_COPIES */
    uint8_t copy[INCODE_NEIGHBOURS_BRICKS]; /* which, or INCODE_NO_COPY */
    uint8_t owner[INCODE_NEIGHBOURS_COPIES];
    uint32_t next; /* copy to be given away */
};

/* The ball of a round query in the list's units, widened by what rounding to
 * single precision may move its centre, a point in it, or their distance. */
struct incode_neighbours_ball {
    float centre[3], square;
};

enum incode_listed {
    INCODE_LISTED,
    INCODE_LIST_WAIT, /* for page *missing */
    INCODE_LIST_FULL  /* too many bricks: the list is empty */
};

/* Lists what meets the box lo..hi. */
enum incode_listed incode_neighbours_make(struct incode_neighbours *neighbours,
                                          struct incode_walker *walker,
                                          uint32_t brick, const double lo[3],
                                          const double hi[3],
                                          uint32_t *missing);

/* Visits the leaves among the listed bricks that a query concerns: by its ball
 * where it is round, else by its box.  INCODE_WALK_WAIT: query.missing is not
 * there. */
enum incode_walk
incode_neighbours_visit(const struct incode_neighbours *neighbours,
                        struct incode_walker *walker, struct incode_query *q,
                        incode_visit *visit, void *context);

/* Indices, in the list, of the bricks that meet the ball of a round query and
 * are not certainly on the known side of its face; returns how many, and the
 * ball.  Room for a vector more is needed. */
uint32_t incode_neighbours_in_ball(
    const struct incode_neighbours *neighbours, const struct incode_query *q,
    struct incode_neighbours_ball *ball,
    uint32_t index[INCODE_NEIGHBOURS_BRICKS + INCODE_NEIGHBOURS_PADDING]);

void incode_neighbours_set_ball(const struct incode_neighbours *neighbours,
                                const struct incode_query *q,
                                struct incode_neighbours_ball *ball);

/* Copies the points of a listed brick, which is in the frame; the oldest copy
 * gives way. */
void incode_neighbours_copy(struct incode_neighbours *neighbours,
                            uint32_t index, const struct incode_frame *frame);

/* The points of a listed brick that has been copied, one bit each, that are not
 * certainly outside the ball: all are looked at, without a branch on where they
 * are.  The bits past the brick's last point mean nothing. */
uint64_t incode_neighbours_points(const struct incode_neighbours *neighbours,
                                  uint32_t index,
                                  const struct incode_neighbours_ball *ball);

/* Whether a box lies in that of the list. */
static inline bool
incode_neighbours_holds(const struct incode_neighbours *neighbours,
                        const double lo[3], const double hi[3])
{
    bool holds = true;
    for (int d = 0; d < 3; d++)
        holds = holds && lo[d] >= neighbours->box_lo[d] &&
                hi[d] <= neighbours->box_hi[d];
    return holds;
}

#endif
