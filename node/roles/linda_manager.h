/* The face manager of the Linda program (figure 8 of the paper): lends its
 * faces as tuples, which builders that it has started by eval take when they
 * like (linda_builder.h), and stops them at the end. */
#ifndef NODE_LINDA_MANAGER_H
#define NODE_LINDA_MANAGER_H

#include "roles.h"

extern const struct node_role node_linda_manager_role;

#endif
