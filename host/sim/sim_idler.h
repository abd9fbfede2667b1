/* A node that is there and does nothing: it passes messages of others on,
 * answers pings, says that it is ready, and never works.  In the place of a
 * struct node of the simulated cube.
 *
 * Memory: the start of the board's arena: the struct, and the cube's windows.
 * Work: a few messages a step.
 *
 *     struct host_idler *idler = host_idler_start(&board);
 *     bool moved = host_idler_step(idler);
 *     uint64_t wait_us = moved ? 0 : host_idler_wait_us(idler);
 */
#ifndef HOST_SIM_IDLER_H
#define HOST_SIM_IDLER_H

#include "node/board.h"

struct host_idler;

/* The arena must have room for it. */
struct host_idler *host_idler_start(const struct node_board *board);

/* Whether it has moved anything. */
bool host_idler_step(struct host_idler *idler);

/* Until it has something to do by itself. */
uint64_t host_idler_wait_us(const struct host_idler *idler);

#endif
