#include "requests.h"

#include <string.h>

#include "incode/pages/pages.h"
#include "incode/predicates/check.h"
#include "node/common.h"

/* A bit in a wanted page's number: the page is to come from the host, even if a
 * node keeps it.  No page has so high a number. */
#define OF_HOST (UINT32_C(1) << 31)

void node_requests_init(struct node_requests *requests,
                        const struct node_setup_message *setup,
                        struct node_lending *lending,
                        struct node_counted *counted,
                        struct node_fault *fault) {
    memset(requests, 0, sizeof *requests);
    requests->counted = counted;
    requests->fault = fault;
    requests->holders = setup->holders;
    requests->lending = lending;
    node_page_check_init(&requests->check, setup, counted, fault);
}

static uint16_t keeper_of(const struct node_requests *r, uint32_t wanted) {
    return (wanted & OF_HOST) != 0 ? CUBE_HOST
           : r->lending != NULL    ? node_lending_keeper(r->lending, wanted)
                                   : node_keeper(wanted, r->holders);
}

/* How many pages may be asked of that keeper now. */
static uint32_t room_at(const struct node_requests *r, uint16_t keeper) {
    return cube_room(r->counted->cube, keeper) == 0 ? 0
           : r->lending == NULL                     ? NODE_PAGES_A_REQUEST
                                : node_lending_room(r->lending, keeper);
}

/* Sends for wanted pages from place i on that have the same keeper; false: he
 * cannot be asked now. */
static bool send_batch(struct node_requests *r, uint32_t i) {
    uint32_t batch[NODE_PAGES_A_REQUEST];
    uint32_t count = 0, left = i;
    uint16_t to = keeper_of(r, r->wanted[i]);
    uint32_t most = room_at(r, to);
    if (most == 0)
        return false;
    most = most < NODE_PAGES_A_REQUEST ? most : NODE_PAGES_A_REQUEST;
    for (; i < r->wanted_count; i++)
        if (count < most && keeper_of(r, r->wanted[i]) == to)
            batch[count++] = r->wanted[i] & ~OF_HOST;
        else
            r->wanted[left++] = r->wanted[i];
    r->wanted_count = left;
    r->in_flight += count;
    if (r->lending != NULL)
        node_lending_asked(r->lending, to, count);
    node_counted_put(r->counted, to, NODE_PAGE_REQUEST, batch,
                     count * sizeof batch[0]);
    r->bytes_out += count * sizeof batch[0];
    return true;
}

/* Sends for wanted pages, a message or more for each node that has some. */
static void send_wanted(struct node_requests *r) {
    uint32_t i = 0;
    while (i < r->wanted_count)
        i += !send_batch(r, i);
}

static bool outside_request(void *context, uint32_t page) {
    struct node_requests *r = context;
    if (r->lending != NULL &&
        node_lending_keeper(r->lending, page) == NODE_LENDING_COMES)
        return true;
    if (r->wanted_count >= NODE_WANTED_MAX)
        send_wanted(r);
    if (r->wanted_count >= NODE_WANTED_MAX ||
        r->wanted_count + r->in_flight >= NODE_PAGES_IN_FLIGHT_MAX)
        return false;
    r->wanted[r->wanted_count++] = page;
    return true;
}

struct incode_page_source node_requests_source(struct node_requests *requests) {
    return (struct incode_page_source){requests, outside_request};
}

/* A page that nothing here waits for.  The host may send a page twice if
 * another node's copies of it were altered twice. */
static void refuse(struct node_requests *r, const struct node_page *page,
                   const char *words) {
    if (page->source != CUBE_HOST)
        node_page_check_report(&r->check, page->source, page->number);
    else if (!r->altered)
        node_fault_set(r->fault, words, page->number, (uint32_t)page->size);
}

bool node_requests_take(struct node_requests *requests,
                        const struct cube_message *message,
                        struct node_page *page) {
    struct node_requests *r = requests;
    bool right = node_page_check_take(&r->check, message, page);
    bool due = page->number != INCODE_NONE && r->in_flight > 0 &&
               (page->source == CUBE_HOST ||
                keeper_of(r, page->number & ~OF_HOST) == page->source);
    if (right && !due)
        refuse(r, page, "page # was not requested");
    r->altered = r->altered || !right;
    page->number = due ? page->number : INCODE_NONE;
    return right && due;
}

void node_requests_judge(struct node_requests *requests, int status,
                         const struct node_page *page) {
    struct node_requests *r = requests;
    if (status == INCODE_PAGE_UNASKED) {
        refuse(r, page, "page # of # bytes was not requested");
        return;
    }
    r->in_flight--;
    if (r->lending != NULL)
        node_lending_came(r->lending, page->number);
    if (status != 0) {
        node_fault_set(r->fault,
                       "content of page # in # bytes is out of its limits",
                       page->number, (uint32_t)page->size);
    }
}

void node_requests_again(struct node_requests *requests, uint32_t page,
                         bool asked) {
    struct node_requests *r = requests;
    if (r->wanted_count == NODE_PAGES_IN_FLIGHT_MAX) {
        node_fault_set(r->fault, "page # came altered, and # wait already",
                       page, r->wanted_count);
        return;
    }
    INCODE_ASSERT(!asked || r->in_flight > 0);
    r->in_flight -= asked;
    r->wanted[r->wanted_count++] = page | OF_HOST;
}

unsigned node_requests_send(struct node_requests *requests) {
    unsigned wanted = requests->wanted_count;
    send_wanted(requests);
    return wanted - requests->wanted_count +
           node_page_check_send(&requests->check);
}

uint32_t node_requests_held(const struct node_requests *requests) {
    return requests->wanted_count + requests->in_flight + requests->check.owed;
}
