/* The pages that a role with a maker requests from the host, or from the nodes
 * that keep them: holders, or those of an exchange.  It is the maker's source
 * of pages (incode/pages/pager.h).
 *
 * A page that was altered (node/page_check.h) is reported, and requested again
 * from the host.
 *
 * Memory: the struct, about 1 KB. */
#ifndef NODE_REQUESTS_H
#define NODE_REQUESTS_H

#include "incode/pages/pager.h"
#include "lending.h"
#include "node/common.h"
#include "node/message.h"
#include "node/page_check.h"

enum {
    NODE_WANTED_MAX = NODE_PAGES_A_REQUEST, /* pages not yet requested */
    NODE_REQUESTS_FEW = 8                   /* fewer may wait for others */
};

struct node_requests {
    struct node_counted *counted;
    struct node_fault *fault;
    uint32_t holders;             /* as in the setup */
    struct node_lending *lending; /* of an exchange, or NULL */
    struct node_page_check check;
    bool altered; /* a page has arrived altered */
    /* At most NODE_WANTED_MAX pages, and those that arrived altered. */
    uint32_t wanted[NODE_PAGES_IN_FLIGHT_MAX];
    uint32_t wanted_count, in_flight;
    uint64_t bytes_out;
};

/* lending: of an exchange, or NULL. */
void node_requests_init(struct node_requests *requests,
                        const struct node_setup_message *setup,
                        struct node_lending *lending,
                        struct node_counted *counted, struct node_fault *fault);

/* As a maker sees them. */
struct incode_page_source node_requests_source(struct node_requests *requests);

/* Takes NODE_PAGE.  True with *page: the caller uses it, and then calls _judge.
 * False with its number: the page was altered; if it is still awaited, the
 * caller calls _again.  False with INCODE_NONE: the page was not requested, or
 * is not sound; that is a fault if the host sent it, and else it is reported.
 */
bool node_requests_take(struct node_requests *requests,
                        const struct cube_message *message,
                        struct node_page *page);

/* status: 0, or why the page was not used, as in incode/triangulator.h. */
void node_requests_judge(struct node_requests *requests, int status,
                         const struct node_page *page);

/* Requests the page from the host.  asked: it was requested here before; else
 * it was to come unasked. */
void node_requests_again(struct node_requests *requests, uint32_t page,
                         bool asked);

/* Whether few pages are wanted: then sending may wait for more, while there is
 * other work.  A report is sent at once. */
static inline bool node_requests_few(const struct node_requests *requests) {
    return requests->wanted_count < NODE_REQUESTS_FEW && !requests->check.owed;
}

/* Requests the wanted pages, one message for each node that has some, and sends
 * a report that waits.  Returns the number of pages and reports. */
unsigned node_requests_send(struct node_requests *requests);

/* The number of pages wanted or on their way, and of reports that wait. */
uint32_t node_requests_held(const struct node_requests *requests);

#endif
