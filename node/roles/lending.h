/* Pages between the nodes of an exchange.  A page of points belongs to who has
 * its brick, one of boxes to who has its first brick; that node gets it of the
 * host, others ask that node for it.  What it has given up it leaves to the
 * host to send, so that nobody waits for more than one node; and some pages
 * come to all, unasked.
 *
 * Memory: node_lending_bytes of the role's arena: each other node may have
 * asked for NODE_PAGES_LENT_MAX pages and not got them. */
#ifndef NODE_LENDING_H
#define NODE_LENDING_H

#include <stdbool.h>

#include "incode/front/job.h"
#include "node/common.h"
#include "node/message.h"
#include "incode/triangulator.h"
#include "node/page_check.h"
#include "incode/lending.h"

/* Tetrahedra on their way to other nodes, for an exchange: small batches, each
 * for one node, that leave as soon as the link has room.
 *
 * Memory: node_shares_bytes of the role's arena: NODE_SHARE_BATCHES batches
 * of NODE_SHARES_A_BATCH, and the first brick of each node's region. */

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

/* Work that moves while the nodes of an exchange run: who has nothing to do
 * asks the others, one after another, his neighbours first; who has many ready
 * vertices lends a run of them to one that has asked (incode/front/exchange.h),
 * and uses what comes back.
 *
 * A node asks each other node once, and again when it has been lent something
 * and is through with it, so that asks are as few as nodes and loans.  An ask
 * stays with who is asked until it can be met; nobody waits for it, nothing is
 * repeated by time, and no node is awake for it.  A loan that comes when there
 * is no place for it, as others came first, goes back as it was.
 *
 * The lender is not quiet (waves.h) while a loan is out, and the borrower tells
 * nothing to others, so loans are not counted for the end.  A lender waits for
 * a borrower at most, a borrower for pages alone: there is no circle.
 *
 * Memory: the struct, about 12 KB, with a place for each loan that may be out
 * and what comes back of it, NODE_LOANS_OUT, and for those that are borrowed,
 * NODE_LOANS_IN; and node_loans_bytes of the role's arena, a bit a node for
 * who has asked, who is asked, and whose loan goes back. */

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

/* The borrower whose loan `use` goes on with: it found what `use` emits. */
uint16_t node_loans_finder(const struct node_loans *loans);

/* A step with what came back, or with what is borrowed, of about so many units;
 * false: there is nothing to do. */
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
