/* Which way a message goes.  While nothing is dead: e-cube, the lowest
 * differing dimension first, and binomial trees.  Else: along one spanning tree
 * of what is left of the cube, rooted at the gateway, the same for all
 * messages.
 *
 * The tree.  A node's parent is the node without its lowest bit, counted from
 * the gateway.  Where that link is dead, a subtree hangs free; the first of its
 * nodes that has a live link into the tree is tied to it, and the parents
 * between that node and the subtree's root turn round.  Only such parents are
 * remembered.  All nodes come to the same tree, as it follows from the wiring.
 *
 * No deadlock.  In a tree a path goes up and then down.  Number the channels:
 * those to a parent by falling depth, then those to a child by rising depth.
 * Every message moves, and every copy of a message to all is made, from a
 * channel to higher ones, each has buffers of its own, and who reads at the end
 * takes them off; so no circle of waiting can close.  The rule changes with the
 * generation alone, which drops all messages under the old one.
 *
 * Memory: routes_bytes(dimension), whatever the number of nodes: 1.7 KB for 10.
 * Work: a way is a walk from the destination towards the root, at most as many
 * steps as the tree is deep; routes_find looks at each node that hangs free and
 * its links, once for each time that such a subtree is tied. */
#ifndef TRANSPORT_ROUTES_H
#define TRANSPORT_ROUTES_H

#include "cube.h"

/* What the ends of a cube agree on (struct cube_wiring): how it is merged, so
 * that all come to the same whatever the order and number of datagrams, and how
 * it looks as bytes.  PROTOCOL.md has the layout.
 *
 * Work: at most CUBE_DEAD_MAX^2 comparisons a call. */

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

enum { ROUTES_NONE = 0xffff }; /* no node, no link */

struct routes_altered {
    uint16_t node, parent;
};

struct routes {
    struct cube_wiring wiring;      /* settled entries alone */
    struct routes_altered *altered; /* by node */
    unsigned altered_count, altered_max;
    unsigned dimension;
    bool tree; /* not e-cube */
};

/* Of the memory, which is aligned to 2 bytes. */
size_t routes_bytes(unsigned dimension);
void routes_init(struct routes *routes, void *memory, unsigned dimension);

/* The routes of a generation. */
void routes_find(struct routes *routes, const struct cube_wiring *wiring);

/* The link of `self` that leads to dest, or ROUTES_NONE: there is no way.
 * dest != self. */
unsigned routes_way(const struct routes *routes, unsigned self, unsigned dest);

/* The link of `self` on which messages of `source` arrive, whether they are for
 * `self`, for a node behind it, or for all.  ROUTES_NONE: no path leads from
 * `source` to `self`.  source != self. */
unsigned routes_way_from(const struct routes *routes, unsigned self,
                         unsigned source);

/* The links, as bits, on which `self` passes on a message to all nodes that
 * `root` has sent (the gateway where the host has).  On the tree these are all
 * its links: the message does not go back where it came from. */
uint32_t routes_to_all(const struct routes *routes, unsigned self,
                       unsigned root);

/* Whether a node can be reached from the gateway. */
bool routes_reach(const struct routes *routes, unsigned node);

#endif
