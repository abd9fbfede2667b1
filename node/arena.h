/* How the tables of an arena are laid: each begins at an address that suits
 * anything, vector lanes included.
 *
 * Memory: none.  Work: none.
 *
 *     size_t own = node_aligned(sizeof(struct node_counted));
 *     uint8_t *rest = (uint8_t *)arena + own;
 */
#ifndef NODE_ARENA_H
#define NODE_ARENA_H

#include <stddef.h>

enum { NODE_ALIGNMENT = 64 };

/* Bytes, rounded up so that what follows is aligned for anything. */
static inline size_t node_aligned(size_t bytes) {
    return (bytes + NODE_ALIGNMENT - 1) / NODE_ALIGNMENT * NODE_ALIGNMENT;
}

#endif
