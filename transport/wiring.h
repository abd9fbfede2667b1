/* What the ends of a cube agree on (struct cube_wiring): how it is merged, so
 * that all come to the same whatever the order and number of datagrams, and how
 * it looks as bytes.  PROTOCOL.md has the layout.
 *
 * Memory: the caller's.  Work: at most CUBE_DEAD_MAX^2 comparisons a call.
 *
 *     changed = wiring_merge(&mine, &theirs, dimension);
 *     size = wiring_pack(&mine, bytes);
 *     sound = wiring_unpack(&theirs, bytes, size, dimension);
 */
#ifndef TRANSPORT_WIRING_H
#define TRANSPORT_WIRING_H

#include "cube.h"

enum {
    WIRING_HEAD = 14, /* bytes, then 3 a dead link, 7 a wrong wire */
    WIRING_BYTES_MAX = WIRING_HEAD + 3 * CUBE_DEAD_MAX + 7 * CUBE_WRONG_MAX
};

/* Bytes written. */
size_t wiring_pack(const struct cube_wiring *wiring, uint8_t *bytes);

/* False: not the wiring of a cube of that dimension. */
bool wiring_unpack(struct cube_wiring *wiring, const uint8_t *bytes,
                   size_t size, unsigned dimension);

bool wiring_same(const struct cube_wiring *a, const struct cube_wiring *b);

/* Whether generation b was begun after a: less than half the circle of 2^32
 * ahead of it (serial numbers, RFC 1982); of two just opposite, the higher
 * number.  0, not told yet, is before all others.  Not transitive where three
 * lie all around the circle: who asks must end by itself. */
bool wiring_after(uint32_t b, uint32_t a);

/* The generation behind that one: never 0. */
uint32_t wiring_next(uint32_t generation);

/* Whether both are of one generation of one host. */
bool wiring_together(const struct cube_wiring *a, const struct cube_wiring *b);

/* What messages carry of the generation and its host: CRC-16 of both.  Two
 * that meet are the same only by a chance of 1 in 65,536. */
uint16_t wiring_stamp(const struct cube_wiring *wiring);

/* Whether b was begun after a: a later generation, or the same of a host with
 * a higher epoch. */
bool wiring_newer(const struct cube_wiring *b, const struct cube_wiring *a);

/* The newer wiring, or both where neither is; true: mine has changed. */
bool wiring_merge(struct cube_wiring *mine, const struct cube_wiring *theirs,
                  unsigned dimension);

/* Adds what was found; false: known already, or no room.  Of more than there
 * is room for, the lowest stay, whatever the order they came in. */
bool wiring_add_dead(struct cube_wiring *wiring, struct cube_dead dead,
                     unsigned dimension);
bool wiring_add_wrong(struct cube_wiring *wiring, struct cube_wrong wrong);

/* Whether the link of that node is dead by the first `count` entries. */
bool wiring_is_dead(const struct cube_wiring *wiring, unsigned count,
                    unsigned node, unsigned link, unsigned dimension);

/* Makes all that is dead settled, each once, and a node whose links are all
 * dead a whole one. */
void wiring_settle(struct cube_wiring *wiring, unsigned dimension);

#endif
