/* The holder's role in the strategy `sequential`: keeps pages for node 0, and
 * asks the host for those that it does not have.  Page p belongs to holder
 * p % holders, and there to frame (p / holders) % frames.
 *
 * Memory: one arena: a queue with room for every page that node 0 may have in
 * flight, then frames.  Since that room is there before node 0 asks, and a
 * frame before the host is asked, the holder always reads what comes, and
 * nothing deadlocks.  Work: one pass over the queue a call.
 *
 *     node_holder_start(&holder, arena, bytes, &counted, &setup, &why);
 *     node_holder_message(&holder, &message);
 *     moved = node_holder_send(&holder);
 */
#ifndef NODE_HOLDER_H
#define NODE_HOLDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "node/counted.h"
#include "node/message.h"

enum { NODE_HOLDER_QUEUE = 256 }; /* at least NODE_IN_FLIGHT_MAX */

struct node_holder_frame {
    uint32_t page; /* then the page itself: the body of a NODE_PAGE */
    uint8_t data[INCODE_PAGE_BYTES];
    uint16_t size; /* of data; 0: nothing here */
    bool loading;  /* the host has been asked */
    bool fresh;    /* there, but not yet passed on to whom it was got for */
};

struct node_holder {
    struct node_counted *counted;
    uint32_t holders;
    struct node_holder_frame *frames;
    uint32_t frame_count, frames_used;
    uint32_t queue[NODE_HOLDER_QUEUE]; /* pages that node 0 waits for */
    uint32_t queued;
    uint64_t hits, misses, bytes_in, bytes_out;
    const char *fault;
};

int node_holder_start(struct node_holder *holder, void *arena, size_t bytes,
                      struct node_counted *counted,
                      const struct node_setup_message *setup, const char **why);

/* A message of type NODE_PAGE_REQUEST or NODE_PAGE. */
void node_holder_message(struct node_holder *holder,
                         const struct cube_message *message);

/* Passes on what is there and asks for what is not; number of messages. */
unsigned node_holder_send(struct node_holder *holder);

#endif
