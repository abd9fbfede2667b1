/* The interface between a node and its board.  A new board fills this struct,
 * and calls node_start once and node_step until the node is stopped.  It needs
 * nothing from other rooms except, if one fits, a driver of transport/drivers.
 *
 * Work: every function returns at once, but for idle, which sleeps until its
 * time is over or a byte comes.
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
#include "transport/secure.h"

/* The node's identity, as its board was told or has learnt. */
struct node_identity {
    /* Its number, 0 .. 2^dimension - 1. */
    uint16_t self;

    /* Of the cube, 0 .. CUBE_DIMENSION_MAX; the same on all nodes. */
    uint8_t dimension;

    /* Frames a link and direction, 1 .. LINK_WINDOW_MAX; 0: what suits the
     * memory: 8 from 2 MiB on, 4 from 1 MiB on, else 2; and 16 to the host
     * from 3 MiB on, where no wire is serial. */
    uint8_t window;

    /* Of this start; not 0, and never used before by this node. */
    uint32_t epoch;

    /* This node has a host port, at link `dimension`; node 0 always has. */
    bool host_port;

    /* Nodes 0 .. host_ports - 1 have host ports: a power of two, 2 ..
     * CUBE_HOST_PORTS_MAX, the same on all nodes.  0: node 0 has one, and a
     * node with host_port. */
    uint8_t host_ports;

    /* Microseconds after which a link that is down or silent is given up for
     * the run; 0: never. */
    uint32_t dead_us;

    /* Baud rate of the slowest serial wire of the cube; 0: it has none. */
    uint32_t serial_baud;
};

/* Measurements of a board since its start. */
struct node_gauges {
    uint32_t stack_bytes;      /* that the node's stack has, */
    uint32_t stack_high_water; /* and that were ever in use */
    uint32_t overruns; /* bytes that came by a link and had no room, at most
                          2^32 - 1 */
};

/* Why a node ends: what board.reset gets. */
enum node_reset {
    NODE_RESET_OVER = 0,   /* the run is over */
    NODE_RESET_AGAIN = 16, /* it is to begin anew */
    NODE_RESET_STAY        /* and a loader not to start an image */
};

struct node_who;     /* message.h */
struct node_counted; /* common.h */

struct node_board {
    void *context;
    struct node_identity identity;
    /* The source of values that never repeat: random bytes, or the device and
     * the number of its start. identity.h draws the epoch from it, and keyed
     * wires their nonces.  All 0: the board is told its epoch, and has no keys.
     */
    struct secure_source source;
    /* Sends and receives bytes on link i: 0 .. dimension - 1 to the neighbours;
     * node 0, and the one with host_port, have the host at link `dimension`. */
    struct link_pipe pipes[CUBE_LINKS_MAX];
    /* Microseconds since any fixed time, never going back. */
    uint64_t (*now_us)(void *context);
    /* Processor time that this node has used. */
    uint64_t (*busy_us)(void *context);
    /* Sleeps until bytes can be received, or sent where a link had no room,
     * but no longer than wait_us. */
    void (*idle)(void *context, uint64_t wait_us);
    /* Bit i: the peer on link i could not prove that it knows this node's key.
     * NULL: the wires have no keys. */
    uint32_t (*refused)(void *context);
    /* NULL: there is nothing to tell. */
    void (*gauges)(void *context, struct node_gauges *gauges);
    /* Fills in the board's fields; before the call, *who describes a process of
     * Linux.  NULL: the board is one. */
    void (*who)(void *context, struct node_who *who);
    /* Writes the board's log of its starts and faults: text, lines ended by \n,
     * at most `size` bytes.  Returns the number of bytes.  NULL: the board has
     * no log. */
    size_t (*log)(void *context, char *text, size_t size);
    /* Bytes that arrived on link d and were dropped for lack of room since the
     * start.  NULL: not known. */
    uint32_t (*lost)(void *context, unsigned d);
    /* Replaces cube_write for all messages of the node's role, with the same
     * return values.  For tests: a node that alters its own messages.  NULL:
     * cube_write. */
    int (*write)(void *context, struct node_counted *counted, uint16_t dest,
                 uint8_t type, const void *data, size_t size);
    /* Ends the node, for the reason of enum node_reset: a fresh start or, with
     * an operating system, an exit with this status. */
    void (*reset)(void *context, int status);
    void *arena;        /* aligned to NODE_ALIGNMENT bytes: common.h */
    size_t arena_bytes; /* with fixed_bytes, below 4 GiB */
    size_t fixed_bytes; /* data memory outside the arena, stack included, which
                           has 48 KiB at least: an insertion takes up to 40 */
};

#endif
