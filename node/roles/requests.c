#include "requests.h"

#include <string.h>

#include "incode/pages/sound.h"
#include "incode/predicates/check.h"
#include "node/keepers.h"

void node_requests_init(struct node_requests *requests, uint32_t holders,
                        struct node_counted *counted, struct node_fault *fault)
{
    memset(requests, 0, sizeof *requests);
    requests->counted = counted;
    requests->fault = fault;
    requests->holders = holders;
}

/* Sends for wanted pages, one message for each node that has some. */
static void send_wanted(struct node_requests *r)
{
    while (r->wanted_count > 0) {
        uint32_t batch[NODE_PAGES_A_REQUEST];
        uint32_t count = 0, left = 0;
        uint16_t to = node_keeper(r->wanted[0], r->holders);
        if (cube_room(r->counted->cube, to) == 0) {
            return;
        }
        for (uint32_t i = 0; i < r->wanted_count; i++) {
            if (count < NODE_PAGES_A_REQUEST &&
                node_keeper(r->wanted[i], r->holders) == to) {
                batch[count++] = r->wanted[i];
            } else {
                r->wanted[left++] = r->wanted[i];
            }
        }
        r->wanted_count = left;
        r->in_flight += count;
        node_counted_put(r->counted, to, NODE_PAGE_REQUEST, batch,
                         count * sizeof batch[0]);
        r->bytes_out += count * sizeof batch[0];
    }
}

static bool outside_request(void *context, uint32_t page)
{
    struct node_requests *r = context;
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
