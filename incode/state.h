/* What a triangulator is made of: a maker that finds apexes, a front that wants
 * them, and an insertion that does without.
 *
 * Memory: the struct, at the start of the arena.  Work: none.
 *
 *     struct incode_triangulator *t = arena;
 *     t->front.room_faces = t->front.afl.capacity - 500;   // it spills soon
 */
#ifndef INCODE_STATE_H
#define INCODE_STATE_H

#include "incode/front/front.h"
#include "incode/apex/maker.h"
#include "incode/insertion/handover.h"
#include "incode/insertion/insertion.h"
#include "triangulator.h"

/* What a job is about. */
enum incode_phase {
    INCODE_PHASE_CHOOSE,   /* how: pages of boxes tell */
    INCODE_PHASE_POINTS,   /* point by point */
    INCODE_PHASE_HANDOVER, /* of what is open to the front */
    INCODE_PHASE_FACES,    /* face by face, star after star */
    INCODE_PHASE_IDLE
};

struct incode_triangulator {
    struct incode_map map;
    struct incode_front front;
    struct incode_maker maker;
    struct incode_insertion insertion;
    struct incode_handover handover;
    uint64_t *committed; /* a bit a brick; NULL: there is no room for them */
    struct incode_job job;
    enum incode_phase phase;
    enum incode_build build;
    uint8_t *arena; /* behind this struct */
    size_t bytes;
    struct incode_shares {
        struct incode_front_share front;
        struct incode_maker_share maker;
    } shares;          /* of it, face by face */
    bool by_points;    /* it is divided for points */
    bool has_worked;   /* a job has, since init */
    size_t high_water; /* bytes, before it was divided as it is */
    uint32_t units;    /* of work that a step may do, as it goes on */
    uint64_t spent;    /* units */
};

#endif
