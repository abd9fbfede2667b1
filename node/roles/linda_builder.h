/* A tetrahedron builder of the Linda program (figure 9 of the paper): after
 * eval has started it, it takes lists of faces from the tuple space and puts
 * answers, until it takes the end. */
#ifndef NODE_LINDA_BUILDER_H
#define NODE_LINDA_BUILDER_H

#include "roles.h"

extern const struct node_role node_linda_builder_role;

#endif
