/* Why a node cannot go on, as a text with figures for its user.  The first
 * fault stays: what follows is its consequence as a rule.
 *
 * Memory: the struct.  Work: a pass over the text.
 *
 *     node_fault_set(&fault, "page # of # bytes was not requested", 17, 1536);
 *     if (node_fault_is_set(&fault))
 *         cube_write(cube, CUBE_HOST, NODE_FAULT, fault.text, fault.size);
 */
#ifndef NODE_FAULT_H
#define NODE_FAULT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "message.h"

struct node_fault {
    size_t size; /* of the text; 0: there is no fault */
    char text[NODE_FAULT_TEXT_MAX + 1];
};

/* The first `#` of words becomes a, in decimals, and those after it b; what is
 * longer than NODE_FAULT_TEXT_MAX is cut off. */
void node_fault_set(struct node_fault *fault, const char *words, uint32_t a,
                    uint32_t b);

static inline bool node_fault_is_set(const struct node_fault *fault) {
    return fault->size > 0;
}

#endif
