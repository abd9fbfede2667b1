/* Pages between the nodes of an exchange.  A page of points belongs to the node
 * that has its brick, a page of boxes to the node that has its first brick.
 * This node requests the page from the host; others request it from this node.
 * If it has evicted the page, it passes the request on to the host, so no node
 * waits for more than one other.  Some pages are sent to all nodes without a
 * request.
 *
 * Memory: node_lending_bytes of the role's arena.  Each other node may have
 * NODE_PAGES_LENT_MAX requests outstanding. */
#ifndef NODE_LENDING_H
#define NODE_LENDING_H

#include <stdbool.h>

#include "incode/front/job.h"
#include "node/common.h"
#include "node/message.h"
#include "incode/triangulator.h"
#include "node/page_check.h"
#include "incode/lending.h"

/* Tetrahedra on their way to other nodes of an exchange, in small batches, each
 * for one node.  A batch leaves as soon as the link has room.
 *
 * Memory: node_shares_bytes of the role's arena: NODE_SHARE_BATCHES batches of
 * NODE_SHARES_A_BATCH, and the first brick of each node's region. */

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
    uint8_t *asked; /* [nodes] pages requested from each */
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

/* Regions are known: all pages from that one on are sent without a request. */
void node_lending_to_all(struct node_lending *lending, uint32_t first);

/* From where to request a page, once regions are known: a node, CUBE_HOST, or
 * NODE_LENDING_COMES: no request, because it is sent to all. */
uint16_t node_lending_keeper(const struct node_lending *lending, uint32_t page);

/* _room: how many pages may be requested from that keeper now. _asked: so many
 * were requested. _came: one of them has arrived. */
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

/* Loans of work between the nodes of an exchange.  A node that has nothing to
 * do asks the other nodes one after another, its neighbours first.  A node with
 * many ready vertices lends a run of them to a node that has asked
 * (incode/front/exchange.h), and uses the tetrahedra that come back.
 *
 * A node asks each other node once, and again after it has returned a loan from
 * it, so the number of requests is bounded by the nodes and the loans.  The
 * asked node keeps a request until it can lend.  No node waits for a request,
 * and none is repeated by time.  A loan that arrives when there is no slot for
 * it is returned unchanged.
 *
 * The lender is not quiet (waves.h) while a loan is out, and the borrower sends
 * to the lender only, so waves do not count loans.  A lender waits only for a
 * borrower, and a borrower only for pages, so there is no circle.
 *
 * Memory: the struct, about 12 KB, with slots for NODE_LOANS_OUT loans that are
 * out and their answers, and for NODE_LOANS_IN borrowed loans; and
 * node_loans_bytes of the role's arena: three bits for each node, whether it
 * has asked, was asked, and gets its loan back. */

enum { NODE_LOANS_OUT = 4, NODE_LOANS_IN = 2 };

struct node_loans {
    struct node_counted *counted;
    struct node_fault *fault;
    uint32_t nodes, bricks;
    struct node_loan_out {
        enum node_loan_state {
            NODE_LOAN_IS_FREE,
            NODE_LOAN_IS_MADE, /* it is to be sent */
            NODE_LOAN_IS_OUT,
            NODE_LOAN_IS_BACK /* its answers have come, and is being used */
        } state;
        uint16_t to;
        uint32_t used;
        struct incode_loan loan;
        struct incode_found found;
    } out[NODE_LOANS_OUT];
    struct node_loan_in {
        bool open;
        uint16_t from;
        uint64_t born;
        struct incode_loan loan;
    } in[NODE_LOANS_IN];
    struct node_loan_in *at_work; /* the oldest of them, or NULL */
    struct incode_borrower borrower;
    /* A bit a node. */
    uint64_t *askers; /* have asked this one, */
    uint64_t *asked;  /* or are asked by it, */
    uint64_t *back;   /* or have their loan back at once */
    uint32_t askers_count, asked_count, back_count;
    uint64_t clock, stars, bytes_in, bytes_out;
};

size_t node_loans_bytes(uint32_t nodes);

/* memory: aligned to NODE_ALIGNMENT, node_loans_bytes.  counted and fault stay.
 */
void node_loans_init(struct node_loans *loans, void *memory,
                     const struct node_setup_message *setup,
                     struct node_counted *counted, struct node_fault *fault);

/* NODE_LOAN_ASK, NODE_LOAN or NODE_LOAN_FOUND. */
void node_loans_take(struct node_loans *loans,
                     const struct cube_message *message);

/* The borrower of the loan that node_loans_use works on: it found the
 * tetrahedra that are emitted. */
uint16_t node_loans_finder(const struct node_loans *loans);

/* A step of about so many units, with a loan that came back (_use) or is
 * borrowed (_help).  False: there is nothing to do. */
bool node_loans_use(struct node_loans *loans, struct incode_triangulator *t,
                    uint32_t units);
bool node_loans_help(struct node_loans *loans, struct incode_triangulator *t,
                     uint32_t units);

/* Lends, gives back and asks, as far as the links take it; the number of
 * messages. */
unsigned node_loans_send(struct node_loans *loans,
                         struct incode_triangulator *t);

/* A node that has a loan of this one; CUBE_HOST: none has. */
uint16_t node_loans_owing(const struct node_loans *loans);

#endif
