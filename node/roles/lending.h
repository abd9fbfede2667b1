/* Pages between the nodes of an exchange.  A page of points belongs to who has
 * its brick, one of boxes to who has its first brick; that node gets it of the
 * host, others ask that node for it.  What it has given up it leaves to the
 * host to send, so that nobody waits for more than one node; and some pages
 * come to all, unasked.
 *
 * Memory: node_lending_bytes of the role's arena: each other node may have
 * asked for NODE_PAGES_LENT_MAX pages and not got them.  As who asks has a
 * frame for each, what is sent is always read, and as nobody waits for a page
 * here but for one that the host has been asked for, nothing deadlocks.  Work:
 * a search among the regions a page, a pass over the queue a call of `send`.
 *
 *     to = node_lending_keeper(&lending, page);
 *     count = node_lending_room(&lending, to);   // as many may be asked for
 *     node_lending_take(&lending, &message);     // NODE_PAGE_REQUEST
 *     sent = node_lending_send(&lending, triangulator);   // in every step
 */
#ifndef NODE_LENDING_H
#define NODE_LENDING_H

#include "incode/triangulator.h"
#include "node/counted.h"
#include "node/fault.h"
#include "node/message.h"
#include "node/page_check.h"
#include "shares.h"

enum { NODE_LENDING_COMES = CUBE_ALL }; /* in a keeper's place */

struct node_lending {
    struct node_counted *counted;
    struct node_fault *fault;
    const struct node_shares *shares; /* whose bricks are whose */
    struct incode_tree tree;
    uint32_t to_all, next; /* pages [to_all, next) still come to all */
    /* Requests that wait: for this page, by that node. */
    struct node_lent {
        uint32_t page, node;
    } * queue;
    uint32_t queued, queue_max;
    uint8_t *asked; /* [nodes] pages that each has been asked for */
    uint64_t sent, passed;
    uint64_t bytes_out;
};

size_t node_lending_bytes(uint32_t nodes);

/* memory: aligned to NODE_ALIGNMENT, node_lending_bytes.  All that is given
 * stays. */
void node_lending_init(struct node_lending *lending, void *memory,
                       const struct node_setup_message *setup,
                       const struct node_shares *shares,
                       struct node_counted *counted, struct node_fault *fault);

/* Regions are known: from that page on all come unasked. */
void node_lending_to_all(struct node_lending *lending, uint32_t first);

/* Whom to ask for a page, once regions are known: a node, CUBE_HOST, or
 * NODE_LENDING_COMES: nobody, as it comes to all. */
uint16_t node_lending_keeper(const struct node_lending *lending, uint32_t page);

/* How many pages may be asked of that keeper now; that so many were; and that
 * one of them has come. */
uint32_t node_lending_room(const struct node_lending *lending, uint16_t keeper);
void node_lending_asked(struct node_lending *lending, uint16_t keeper,
                        uint32_t pages);
void node_lending_came(struct node_lending *lending, uint32_t page);

/* NODE_PAGE_REQUEST of another node. */
void node_lending_take(struct node_lending *lending,
                       const struct cube_message *message);

/* Gives NODE_PAGE_TO_ALL to a triangulator.  Returns the page's number if it
 * arrived altered: then the triangulator does not have it, and may wait for it.
 * Else INCODE_NONE. */
uint32_t node_lending_take_to_all(struct node_lending *lending,
                                  struct node_page_check *check,
                                  struct incode_triangulator *triangulator,
                                  const struct cube_message *message);

/* Sends what others wait for and the links take; the number of messages. */
unsigned node_lending_send(struct node_lending *lending,
                           struct incode_triangulator *triangulator);

#endif
