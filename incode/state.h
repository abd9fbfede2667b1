/* What a triangulator is made of: a maker that finds apexes and a front that
 * wants them.
 *
 * Memory: the struct, at the start of the arena.  Work: none.
 *
 *     struct incode_triangulator *t = arena;
 *     t->front.room_faces = t->front.afl.capacity - 500;   // it spills soon
 */
#ifndef INCODE_STATE_H
#define INCODE_STATE_H

#include "incode/front/front.h"
#include "incode/maker/maker.h"
#include "triangulator.h"

struct incode_triangulator {
    struct incode_map map;
    struct incode_front front;
    struct incode_maker maker;
    uint32_t units; /* of work that a step may do, as it goes on */
    uint64_t spent; /* units */
};

#endif
