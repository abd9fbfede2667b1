/* The holder's role in the strategy `sequential`: keeps pages for a worker, and
 * requests missing pages from the host. common.h defines which holder keeps a
 * page, and the page's index there; its frame is the index modulo the number of
 * frames. */
#ifndef NODE_HOLDER_H
#define NODE_HOLDER_H

#include "roles.h"

extern const struct node_role node_holder_role;

#endif
