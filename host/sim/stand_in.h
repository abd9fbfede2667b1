/* What is at a node's place and is no sound node, on the board of one: an idler
 * answers pings and never works; a teller tells its neighbours of a wiring that
 * another host began. */
#ifndef HOST_SIM_STAND_IN_H
#define HOST_SIM_STAND_IN_H

#include "node/node.h"

enum host_stand_in_kind { HOST_NO_STAND_IN, HOST_IDLER, HOST_TELLER };

struct host_stand_in_orders {
    enum host_stand_in_kind kind;
    bool ready;                /* the idler has answered its setup */
    struct cube_wiring wiring; /* of which the teller tells */
};

struct host_stand_in; /* opaque: lives at the start of the arena */

/* NULL: the arena does not hold the links. */
struct host_stand_in *
host_stand_in_start(const struct node_board *board,
                    const struct host_stand_in_orders *orders);

/* As of node.h. */
enum node_event host_stand_in_step(struct host_stand_in *one);
uint64_t host_stand_in_wait_us(const struct host_stand_in *one);

#endif
