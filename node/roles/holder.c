#include "holder.h"

#include <string.h>

#include "incode/predicates/check.h"

int node_holder_start(struct node_holder *holder, void *arena, size_t bytes,
                      struct node_counted *counted,
                      const struct node_setup_message *setup, const char **why)
{
    memset(holder, 0, sizeof *holder);
    holder->counted = counted;
    holder->holders = setup->holders;
    holder->frames = arena;
    holder->frame_count = (uint32_t)(bytes / sizeof holder->frames[0]);
    if (holder->frame_count == 0) {
        *why = "the node's memory does not hold a page";
        return -1;
    }
    memset(arena, 0, holder->frame_count * sizeof holder->frames[0]);
    return 0;
}

static struct node_holder_frame *frame_of(const struct node_holder *h,
                                          uint32_t page)
{
    return &h->frames[page / h->holders % h->frame_count];
}

static void take_request(struct node_holder *h, const uint8_t *data,
                         size_t size)
{
    for (size_t at = 0; at + 4 <= size; at += 4) {
        if (h->queued == NODE_HOLDER_QUEUE) {
            h->fault = "more pages asked for than were agreed";
            return;
        }
        memcpy(&h->queue[h->queued++], data + at, 4);
    }
}

static void take_page(struct node_holder *h, const uint8_t *data, size_t size)
{
    uint32_t page;
    if (size <= sizeof page || size > sizeof page + INCODE_PAGE_BYTES) {
        h->fault = "a page of a wrong size";
        return;
    }
    memcpy(&page, data, sizeof page);
    struct node_holder_frame *frame = frame_of(h, page);
    if (!frame->loading || frame->page != page) {
        h->fault = "a page that was not asked for";
        return;
    }
    memcpy(frame->data, data + sizeof page, size - sizeof page);
    frame->size = (uint16_t)(size - sizeof page);
    frame->loading = false;
    frame->fresh = true;
}

void node_holder_message(struct node_holder *holder,
                         const struct cube_message *message)
{
    holder->bytes_in += message->size;
    if (message->type == NODE_PAGE_REQUEST) {
        take_request(holder, message->data, message->size);
    } else if (message->type == NODE_PAGE) {
        take_page(holder, message->data, message->size);
    }
}

/* Takes a frame for a page and notes it as wanted.  A page that has just come
 * goes to node 0 first: otherwise two pages of one frame could displace each
 * other for ever. */
static bool claim(struct node_holder *h, struct node_holder_frame *frame,
                  uint32_t page)
{
    if (frame->loading || frame->fresh) {
        return false;
    }
    h->frames_used += frame->size == 0;
    frame->page = page;
    frame->size = 0;
    frame->loading = true;
    h->misses++;
    return true;
}

unsigned node_holder_send(struct node_holder *holder)
{
    uint32_t wanted[NODE_PAGES_A_REQUEST];
    uint32_t wanted_count = 0, i = 0;
    unsigned sent = 0;
    bool may_ask = cube_room(holder->counted->cube, CUBE_HOST) > 0;
    while (i < holder->queued) {
        uint32_t page = holder->queue[i];
        struct node_holder_frame *frame = frame_of(holder, page);
        size_t size = sizeof page + frame->size;
        if (frame->page == page && frame->size > 0 &&
            cube_write(holder->counted->cube, 0, NODE_PAGE, frame, size) == 0) {
            holder->hits += !frame->fresh;
            frame->fresh = false;
            holder->queue[i] = holder->queue[--holder->queued];
            holder->bytes_out += size;
            sent++;
            continue;
        }
        if (may_ask && wanted_count < NODE_PAGES_A_REQUEST &&
            (frame->page != page || frame->size == 0) &&
            claim(holder, frame, page)) {
            wanted[wanted_count++] = page;
        }
        i++;
    }
    if (wanted_count > 0) {
        /* Pages for node 0 may have taken the room on the same link. */
        if (node_counted_write(holder->counted, CUBE_HOST, NODE_PAGE_REQUEST,
                               wanted, wanted_count * sizeof wanted[0]) != 0) {
            for (i = 0; i < wanted_count; i++) {
                frame_of(holder, wanted[i])->loading = false;
            }
            return sent;
        }
        holder->bytes_out += wanted_count * sizeof wanted[0];
        sent++;
    }
    return sent;
}
