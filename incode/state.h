/* What a triangulator is made of: a maker that finds apexes, a front that wants
 * them, and an insertion that does without. */
#ifndef INCODE_STATE_H
#define INCODE_STATE_H

#include "incode/front/front.h"
#include "incode/apex/maker.h"
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

/* Bytes of the bits that say which bricks are committed point by point; 0: they
 * would take more than a part in 64.  Where the owner is the lowest vertex, of
 * the maps of an exchange. */
size_t incode_arena_bits(const struct incode_setup *setup, size_t bytes);

/* The shares face by face; false: it is too small. */
bool incode_arena_divide(struct incode_shares *s, struct incode_map *map,
                         const struct incode_setup *setup, size_t bytes);

/* The share of a maker alone: what its horizon leaves, frames take. */
struct incode_maker_share incode_arena_maker(size_t bytes);

/* Bytes of the arena for an insertion. */
size_t incode_arena_room(const struct incode_triangulator *t);

/* Divides the arena for a job point by point, which is begun, or face by face;
 * false: pages are on their way, whose frames stay. */
bool incode_arena_turn(struct incode_triangulator *t, bool points);

/* The most bytes that were in use, before or after the arena was divided anew.
 * A division that no job has worked in does not count. */
size_t incode_arena_high_water(const struct incode_triangulator *t);

#endif
