/* The parts of a triangulator: a maker that finds apexes, a front that asks for
 * them, and an insertion, which needs no apexes. */
#ifndef INCODE_STATE_H
#define INCODE_STATE_H

#include "incode/front/front.h"
#include "incode/apex/maker.h"
#include "incode/insertion/insertion.h"
#include "triangulator.h"

/* The phase of a job. */
enum incode_phase {
    INCODE_PHASE_CHOOSE,   /* by points or faces, by pages of boxes */
    INCODE_PHASE_POINTS,   /* point by point */
    INCODE_PHASE_HANDOVER, /* fall back to faces: open ones to the front */
    INCODE_PHASE_FACES,    /* face by face, star after star */
    INCODE_PHASE_IDLE
};

struct incode_triangulator {
    struct incode_map map;
    struct incode_front front;
    struct incode_maker maker;
    struct incode_insertion insertion;
    struct incode_fallback fallback;
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

/* How a triangulator's arena is divided: the triangulator itself, a bit a
 * brick, the maker's share, and the front's or an insertion's. */

static inline size_t incode_arena_aligned(size_t bytes) {
    return (bytes + 63) & ~(size_t)63;
}

/* Bytes of the bits of bricks that are committed by points; 0: they would take
 * more than a 64th of the arena.  With INCODE_OWNER_LOWEST, bytes of the maps
 * of an exchange. */
size_t incode_arena_bits(const struct incode_setup *setup, size_t bytes);

/* The shares for building by faces; false: the arena is too small. */
bool incode_arena_divide(struct incode_shares *s, struct incode_map *map,
                         const struct incode_setup *setup, size_t bytes);

/* The share of a maker alone: the horizon, and frames in the rest. */
struct incode_maker_share incode_arena_maker(size_t bytes);

/* Bytes of the arena for an insertion. */
size_t incode_arena_room(const struct incode_triangulator *t);

/* Divides the arena for a job by points, which begins, or by faces.  False:
 * pages are on their way, and their frames must stay. */
bool incode_arena_turn(struct incode_triangulator *t, bool points);

/* The most bytes that were in use, before or after the arena was divided anew.
 * A division that no job has worked in does not count. */
size_t incode_arena_high_water(const struct incode_triangulator *t);

#endif
