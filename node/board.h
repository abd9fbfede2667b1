/* All that a node asks of the place where it runs.  A new board fills this
 * struct, calls node_start once and node_step for ever, and touches no other
 * room.
 *
 * Memory: the arena is the whole of a node's tables; `fixed` states what the
 * board holds besides (.data, .bss, stack).  Work: every function returns at
 * once, but for idle, which sleeps until its time is over or a byte comes.
 *
 *     struct node *node = node_start(&board, &why);
 *     while (node_step(node) != NODE_STOPPED)
 *         board.idle(board.context, node_wait_us(node));
 *     board.reset(board.context, 0);
 */
#ifndef NODE_BOARD_H
#define NODE_BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "transport/cube.h"

/* Who the node is: straps, in the language of boards. */
struct node_identity {
    uint16_t self;      /* 0 .. 2^dimension - 1 */
    uint8_t dimension;  /* of the cube */
    uint8_t window;     /* frames a link and direction; 0: what suits memory */
    uint32_t epoch;     /* of this start, never repeated */
    bool host_wire;     /* at link `dimension`; node 0 has it always */
    uint8_t host_wires; /* nodes that have, where all below this; see cube.h */
    uint32_t dead_us;   /* a link that is down or silent for so long is given up
                           for the run; 0: never */
    uint32_t serial_baud; /* of the slowest serial wire of the cube; 0: none */
};

struct node_board {
    void *context;
    struct node_identity identity;
    /* Sends and receives bytes on link i: 0 .. dimension - 1 to the neighbours;
     * node 0, and the one with host_wire, have the host at link `dimension`. */
    struct link_pipe pipes[CUBE_LINKS_MAX];
    /* Microseconds since any fixed time, never going back. */
    uint64_t (*now_us)(void *context);
    /* Processor time that this node has used. */
    uint64_t (*busy_us)(void *context);
    /* Sleeps until bytes can be received, or sent where a link had no room,
     * but no longer than wait_us. */
    void (*idle)(void *context, uint64_t wait_us);
    /* The node's end: a fresh start, or where there is a system, an exit with
     * this status. */
    void (*reset)(void *context, int status);
    void *arena; /* aligned to 64 bytes */
    size_t arena_bytes;
    size_t fixed_bytes; /* data memory outside the arena, stack included */
};

#endif
