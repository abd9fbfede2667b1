/* Tetrahedra on their way to other nodes, for an exchange: small batches, each
 * for one node, that leave as soon as the link has room.
 *
 * Memory: node_shares_bytes of the role's arena: NODE_SHARE_BATCHES batches of
 * NODE_SHARES_A_BATCH, and the first brick of each node's region.  Where no
 * batch is free, the front waits.  Work: a search among the regions and a pass
 * over the batches, for each node that is told.
 *
 *     node_shares_init(&shares, memory, &setup, &counted);
 *     struct incode_front_peers peers = node_shares_peers(&shares);
 *     sent = node_shares_send(&shares);   // and so in every step
 */
#ifndef NODE_SHARES_H
#define NODE_SHARES_H

#include <stdbool.h>

#include "incode/front/job.h"
#include "node/counted.h"
#include "node/message.h"

enum { NODE_SHARE_BATCHES = 48, NODE_SHARES_A_BATCH = 32 };

struct node_share_batch {
    uint16_t to;
    uint16_t count; /* 0: it is free */
    struct node_shared share[NODE_SHARES_A_BATCH];
};

struct node_shares {
    struct node_counted *counted;
    uint32_t nodes;
    uint32_t *first; /* [nodes + 1] brick of each region, and after the last */
    uint32_t known;  /* of these, from the first on */
    struct node_share_batch *batch;
    uint32_t used, turn;
    uint64_t sent; /* since the setup, those that wait included */
    uint64_t bytes_out;
};

size_t node_shares_bytes(uint32_t nodes);

/* memory: aligned to NODE_ALIGNMENT, node_shares_bytes. */
void node_shares_init(struct node_shares *shares, void *memory,
                      const struct node_setup_message *setup,
                      struct node_counted *counted);

/* As a front sees them. */
struct incode_front_peers node_shares_peers(struct node_shares *shares);

/* NODE_REGIONS: false where it is not what is to come next. */
bool node_shares_regions(struct node_shares *shares, const uint8_t *data,
                         size_t size);

/* Whether all regions are known. */
bool node_shares_ready(const struct node_shares *shares);

/* The node whose region a brick is in, when they are. */
uint16_t node_shares_owner(const struct node_shares *shares, uint32_t brick);

/* Sends what the links take; the number of messages. */
unsigned node_shares_send(struct node_shares *shares);

#endif
