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
 * its links, once for each time that such a subtree is tied.
 *
 *     routes_init(&routes, memory, dimension);
 *     routes_find(&routes, &wiring);
 *     link = routes_way(&routes, self, dest);
 */
#ifndef TRANSPORT_ROUTES_H
#define TRANSPORT_ROUTES_H

#include "wiring.h"

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
