/* The face manager of the Linda program (figure 8 of the paper): lends its
 * faces as tuples, which builders that it has started by eval take when they
 * like (linda_builder.h), and stops them at the end.
 *
 * Memory: that of a share of the tuple space (share.h), then as a face
 * manager's.  Work: as a face manager's.
 *
 *     const struct node_role *role = &node_linda_manager_role;
 *     if (role->start(arena, bytes, &setup, &counted, &fault))
 *         moved = role->work(arena, &pace) + role->send(arena);
 */
#ifndef NODE_LINDA_MANAGER_H
#define NODE_LINDA_MANAGER_H

#include "roles.h"

extern const struct node_role node_linda_manager_role;

#endif
