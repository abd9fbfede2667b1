/* A tetrahedron builder of the Linda program (figure 9 of the paper): once eval
 * has started it, takes lists of faces from the tuple space and puts answers,
 * until it takes the end.
 *
 * Memory: that of a share of the tuple space (share.h), then as a tetrahedron
 * builder's.  Work: as a tetrahedron builder's.
 *
 *     const struct node_role *role = &node_linda_builder_role;
 *     if (role->start(arena, bytes, &setup, &counted, &fault))
 *         moved = role->work(arena, &pace) + role->send(arena);
 */
#ifndef NODE_LINDA_BUILDER_H
#define NODE_LINDA_BUILDER_H

#include "roles.h"

extern const struct node_role node_linda_builder_role;

#endif
