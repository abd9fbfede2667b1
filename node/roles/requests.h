/* The pages that a role with a maker asks for, of the host or of the nodes that
 * keep them: holders, or those of an exchange.  It is the maker's source of
 * pages (incode/pages/pager.h).
 *
 * Memory: the struct.  Work: a pass over the pages that are wanted, a call.
 *
 *     node_requests_init(&requests, setup.holders, NULL, &counted, &fault);
 *     struct incode_page_source source = node_requests_source(&requests);
 *     sent = node_requests_send(&requests);   // and so in every step
 */
#ifndef NODE_REQUESTS_H
#define NODE_REQUESTS_H

#include "incode/pages/pager.h"
#include "lending.h"
#include "node/counted.h"
#include "node/fault.h"
#include "node/message.h"

enum {
    NODE_WANTED_MAX = NODE_PAGES_A_REQUEST, /* pages not yet asked for */
    NODE_REQUESTS_FEW = 8                   /* fewer may wait for others */
};

struct node_requests {
    struct node_counted *counted;
    struct node_fault *fault;
    uint32_t holders;             /* as in the setup */
    struct node_lending *lending; /* of an exchange, or NULL */
    uint32_t wanted[NODE_WANTED_MAX];
    uint32_t wanted_count, in_flight;
    uint64_t bytes_out;
};

/* lending: of an exchange, or NULL. */
void node_requests_init(struct node_requests *requests, uint32_t holders,
                        struct node_lending *lending,
                        struct node_counted *counted, struct node_fault *fault);

/* As a maker sees them. */
struct incode_page_source node_requests_source(struct node_requests *requests);

/* NODE_PAGE: true with its number and its bytes, for whoever wanted it, who
 * tells what he says of it; false: it is not sound, or was not asked for, which
 * is a fault. */
bool node_requests_take(struct node_requests *requests, const uint8_t *data,
                        size_t size, uint32_t *page, const uint8_t **bytes,
                        size_t *count);

/* status: 0, or why the page of so many bytes is not taken, as in
 * incode/triangulator.h: a fault. */
void node_requests_judge(struct node_requests *requests, int status,
                         uint32_t page, size_t count);

/* Whether few pages are wanted: where there is other work, more may join. */
static inline bool node_requests_few(const struct node_requests *requests)
{
    return requests->wanted_count < NODE_REQUESTS_FEW;
}

/* Sends for wanted pages, one message for each node that has some; the number
 * of pages. */
unsigned node_requests_send(struct node_requests *requests);

/* Pages that are wanted, or on their way. */
uint32_t node_requests_held(const struct node_requests *requests);

#endif
