/* The face manager of the Linda program (figure 8 of the paper): starts the
 * builders by eval (linda_builder.h), lends its faces as tuples, which the
 * builders take, and stops the builders at the end. */
#ifndef NODE_LINDA_MANAGER_H
#define NODE_LINDA_MANAGER_H

#include "roles.h"

extern const struct node_role node_linda_manager_role;

#endif
