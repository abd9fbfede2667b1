/* What an insertion leaves to the front when it does not fit any more: the
 * faces between released tetrahedra and what is not final, which are open, and
 * which vertices have been reached.  All goes out as spilled toggles, so that
 * the front begins with nothing in memory and has each brick's brought back in
 * its turn.
 *
 * Memory: struct incode_handover.  Work: a step looks at some cells, or at the
 * points once for a brick.
 *
 *     incode_handover_begin(&h, &n);
 *     while ((step = incode_handover_step(&h, &front)) ==
 *            INCODE_INSERTION_WORKED)
 *         continue;
 */
#ifndef INCODE_HANDOVER_H
#define INCODE_HANDOVER_H

#include "incode/front/front.h"
#include "insertion.h"

struct incode_handover {
    struct incode_insertion *n;
    uint32_t cell;   /* at work: facets of cells first, */
    uint32_t vertex; /* then vertices ahead of their turn, */
    uint32_t brick;  /* then points of bricks */
    struct incode_face faces[INCODE_BRICK_POINTS];
    uint32_t count;
};

void incode_handover_begin(struct incode_handover *h,
                           struct incode_insertion *n);

/* front: idle, with the rule and the bricks of the job, which is its next one.
 * INCODE_INSERTION_FINISHED: all has gone out. */
enum incode_insertion_step incode_handover_step(struct incode_handover *h,
                                                struct incode_front *front);

#endif
