/* What all nodes of a cube do together, for programs as in ncube.h: each call
 * is made by every node (the host takes no part), in the same order, and blocks
 * as nwrite and nread do.  The trees are bit
 * arithmetic, relative to the root: a node's parent is the node without its
 * lowest bit, so that all messages go between neighbours.
 *
 * Memory: none; gather's result is at the root alone, reduce's too.  Work: a
 * broadcast takes `dimension` hops, as do gather and reduce, a barrier twice as
 * many; messages are cut to NCUBE_BYTES_MAX.
 *
 *     int status = ncube_broadcast(&n, 0, data, size);
 *     status |= ncube_reduce(&n, 0, sums, sizeof sums, sizeof sums[0], add);
 *     status |= ncube_barrier(&n);
 *
 * All give 0, or -1 and n->failure.  On the e-cube paths one slot suffices:
 * each link brings what its neighbour wrote, in order, and what is asked for
 * comes first.  (Not so where nodes write to others by themselves between these
 * calls, or where links are dead and the messages of several neighbours come by
 * one link: then give slots enough for what may run ahead, and a barrier
 * between calls.) */
#ifndef TRANSPORT_NCUBE_COLLECT_H
#define TRANSPORT_NCUBE_COLLECT_H

#include "ncube.h"

/* The root's bytes come to all. */
int ncube_broadcast(struct ncube *n, unsigned root, void *data, size_t size);

/* The `size` bytes of node i come to all + i * size at the root; elsewhere
 * `all` is not touched. */
int ncube_gather(struct ncube *n, unsigned root, const void *own, size_t size,
                 void *all);

/* Combines `size` bytes of all nodes at the root, in an order that depends on
 * the cube alone; elsewhere data holds what was combined so far.  Elements of
 * `element` bytes stay whole.  combine(into, from, bytes). */
int ncube_reduce(struct ncube *n, unsigned root, void *data, size_t size,
                 size_t element,
                 void (*combine)(void *into, const void *from, size_t bytes));

/* Nobody leaves before all have come. */
int ncube_barrier(struct ncube *n);

#endif
