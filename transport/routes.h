/* Routes of messages.  If nothing is dead: e-cube, the lowest differing
 * dimension first, and binomial trees.  Otherwise all messages go along one
 * spanning tree of the remaining cube, rooted at the gateway.
 *
 * The tree.  A node's parent is the node without its lowest bit, counted from
 * the gateway.  If the link to the parent is dead, the node's subtree is
 * detached.  The first node of the subtree with a live link into the tree is
 * attached by that link, and the parents between that node and the subtree's
 * root are reversed.  Only such parents are stored.  All nodes compute the same
 * tree, because it depends on the wiring only.
 *
 * No deadlock.  In a tree a path goes up and then down.  Number the channels:
 * those to a parent by falling depth, then those to a child by rising depth.
 * Every message, and every copy of a message to all, goes from a channel to a
 * higher one.  Each channel has buffers of its own, and the last end reads all
 * messages.  So no circle of waits can close.  The rule changes only with the
 * generation, which drops all older messages.
 *
 * Memory: routes_bytes(dimension), whatever the number of nodes: 1.7 KB for 10.
 * Work: a route is a walk from the destination towards the root, of at most as
 * many steps as the tree is deep. routes_find visits each detached node and its
 * links once for each time that such a subtree is attached. */
#ifndef TRANSPORT_ROUTES_H
#define TRANSPORT_ROUTES_H

#include "cube.h"

/* The wiring (struct cube_wiring): its merge, so that all ends converge to the
 * same wiring in any order and number of datagrams, and its form as bytes.
 * PROTOCOL.md has the layout.
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
 * number.  0, unknown so far, is before all others.  Not transitive for three
 * generations all around the circle, so a loop over it must end by another
 * rule. */
bool wiring_after(uint32_t b, uint32_t a);

/* The generation after that one: never 0. */
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
