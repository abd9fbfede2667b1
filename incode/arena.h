/* How a triangulator's arena is divided: the triangulator itself, a bit a
 * brick, the maker's share, and the front's or an insertion's.
 *
 * Memory: the arena.  Work: constant, but for tables that are cleared.
 *
 *     if (!incode_arena_divide(&shares, &map, &setup, bytes))
 *         why = "the arena is too small";
 */
#ifndef INCODE_ARENA_H
#define INCODE_ARENA_H

#include "state.h"

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
