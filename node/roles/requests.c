#include "requests.h"

#include <string.h>

#include "incode/pages/sound.h"
#include "incode/predicates/check.h"
#include "node/keepers.h"

void node_requests_init(struct node_requests *requests, uint32_t holders,
                        struct node_lending *lending,
                        struct node_counted *counted, struct node_fault *fault)
{
    memset(requests, 0, sizeof *requests);
    requests->counted = counted;
    requests->fault = fault;
    requests->holders = holders;
    requests->lending = lending;
}

static uint16_t keeper_of(const struct node_requests *r, uint32_t page)
{
    return r->lending != NULL ? node_lending_keeper(r->lending, page)
                              : node_keeper(page, r->holders);
}

/* How many pages may be asked of that keeper now. */
static uint32_t room_at(const struct node_requests *r, uint16_t keeper)
{
    return cube_room(r->counted->cube, keeper) == 0 ? 0
           : r->lending == NULL                     ? NODE_PAGES_A_REQUEST
                                : node_lending_room(r->lending, keeper);
}

/* Sends for wanted pages from place i on that have the same keeper; false: he
 * cannot be asked now. */
static bool send_batch(struct node_requests *r, uint32_t i)
{
    uint32_t batch[NODE_PAGES_A_REQUEST];
    uint32_t count = 0, left = i;
    uint16_t to = keeper_of(r, r->wanted[i]);
    uint32_t most = room_at(r, to);
    if (most == 0) {
        return false;
    }
    most = most < NODE_PAGES_A_REQUEST ? most : NODE_PAGES_A_REQUEST;
    for (; i < r->wanted_count; i++) {
        if (count < most && keeper_of(r, r->wanted[i]) == to) {
            batch[count++] = r->wanted[i];
        } else {
            r->wanted[left++] = r->wanted[i];
        }
    }
    r->wanted_count = left;
    r->in_flight += count;
    if (r->lending != NULL) {
        node_lending_asked(r->lending, to, count);
    }
    node_counted_put(r->counted, to, NODE_PAGE_REQUEST, batch,
                     count * sizeof batch[0]);
    r->bytes_out += count * sizeof batch[0];
    return true;
}

/* Sends for wanted pages, a message or more for each node that has some. */
static void send_wanted(struct node_requests *r)
{
    uint32_t i = 0;
    while (i < r->wanted_count) {
        i += !send_batch(r, i);
    }
}

static bool outside_request(void *context, uint32_t page)
{
    struct node_requests *r = context;
    if (r->lending != NULL &&
        node_lending_keeper(r->lending, page) == NODE_LENDING_COMES) {
        return true;
    }
    if (r->wanted_count == NODE_WANTED_MAX) {
        send_wanted(r);
    }
    if (r->wanted_count == NODE_WANTED_MAX ||
        r->wanted_count + r->in_flight >= NODE_PAGES_IN_FLIGHT_MAX) {
        return false;
    }
    r->wanted[r->wanted_count++] = page;
    return true;
}

struct incode_page_source node_requests_source(struct node_requests *requests)
{
    return (struct incode_page_source){requests, outside_request};
}

bool node_requests_take(struct node_requests *requests, const uint8_t *data,
                        size_t size, uint32_t *page, const uint8_t **bytes,
                        size_t *count)
{
    if (size < sizeof *page) {
        node_fault_set(requests->fault, "page in # bytes, expected # at least",
                       (uint32_t)size, sizeof *page);
        return false;
    }
    memcpy(page, data, sizeof *page);
    if (requests->in_flight == 0) {
        node_fault_set(requests->fault, "page # was not requested", *page, 0);
        return false;
    }
    requests->in_flight--;
    if (requests->lending != NULL) {
        node_lending_came(requests->lending, *page);
    }
    *bytes = data + sizeof *page;
    *count = size - sizeof *page;
    return true;
}

void node_requests_judge(struct node_requests *requests, int status,
                         uint32_t page, size_t count)
{
    if (status != 0) {
        node_fault_set(requests->fault,
                       status == INCODE_PAGE_UNSOUND
                           ? "content of page # in # bytes is out of its limits"
                           : "page # of # bytes was not requested",
                       page, (uint32_t)count);
    }
}

unsigned node_requests_send(struct node_requests *requests)
{
    unsigned wanted = requests->wanted_count;
    send_wanted(requests);
    return wanted - requests->wanted_count;
}

uint32_t node_requests_held(const struct node_requests *requests)
{
    return requests->wanted_count + requests->in_flight;
}
