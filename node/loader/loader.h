/* The boot loader of a bare board as a node of its cube: it forwards messages
 * for other nodes, reports its identity, and takes an image (image.h) into the
 * slot that is not in use.  It never starts an image: a board whose loader has
 * used its links restarts, because an epoch is used once. */
#ifndef NODE_LOADER_LOADER_H
#define NODE_LOADER_LOADER_H

#include "node/board.h"
#include "node/node.h"
#include "slots.h"

struct loader; /* opaque: lives at the start of the arena */

/* The board as for node_start: its `who` fills in board, loader, serial number
 * and boot number; kind, version, digest and number are the loader's to say.
 * loader_slots_start has been called.  NULL: the arena does not suffice, or
 * the identity breaks a limit of the cube: *why. */
struct loader *loader_start(const struct node_board *board,
                            struct loader_slots *slots, const char **why);

/* NODE_STOPPED: the board is to restart, for the reason of loader_reset_why:
 * NODE_RESET_STAY: not to start an image; else it may. */
enum node_event loader_step(struct loader *loader);
enum node_reset loader_reset_why(const struct loader *loader);

/* State of its links, for the board's own console: of how many. */
unsigned loader_links(const struct loader *loader,
                      struct node_link_state state[CUBE_LINKS_MAX]);

/* Microseconds until loader_step must be called even if no byte comes. */
uint64_t loader_wait_us(const struct loader *loader);

#endif
