/* The holder's role in the strategy `sequential`: keeps pages for a worker, and
 * asks the host for those that it does not have.  Whose a page is, keepers.h
 * says; there it has the frame of its place, modulo their number. */
#ifndef NODE_HOLDER_H
#define NODE_HOLDER_H

#include "roles.h"

extern const struct node_role node_holder_role;

#endif
