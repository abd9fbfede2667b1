/* The cube as a node's identity and memory make it: the same for the node
 * program and a board's loader, so that they take each other's place.
 *
 * Memory: none.  Work: constant.
 *
 *     struct cube_config config = node_configure(&board.identity, 1u << 20);
 *     memcpy(config.pipes, board.pipes, sizeof config.pipes);
 */
#ifndef NODE_CONFIGURE_H
#define NODE_CONFIGURE_H

#include "board.h"

/* All but the pipes.  memory: of the node in all, arena and fixed. */
struct cube_config node_configure(const struct node_identity *identity,
                                  size_t memory);

#endif
