/* What a node gives its role: messages, of which those between it and the host
 * are counted, and what looks at the links while it works long.  The host
 * compares the counts with its own, and so learns of those that a node on their
 * way has lost with its memory.
 *
 * Memory: the struct.  Work: that of cube_write.
 *
 *     if (node_counted_write(&counted, CUBE_HOST, NODE_SPILL, data, size) != 0)
 *         return CUBE_AGAIN; // later
 */
#ifndef NODE_COUNTED_H
#define NODE_COUNTED_H

#include "incode/predicates/pause.h"
#include "transport/cube.h"

struct node_counted {
    struct cube *cube;
    uint16_t self;             /* the node's number */
    uint32_t received, sent;   /* from and to the host, in this generation */
    struct incode_pause pause; /* what looks at the links in long work */
    /* The board's `write` and its context, or NULL: see board.h. */
    int (*write)(void *context, struct node_counted *counted, uint16_t dest,
                 uint8_t type, const void *data, size_t size);
    void *context;
};

/* As cube_write. */
int node_counted_write(struct node_counted *counted, uint16_t dest,
                       uint8_t type, const void *data, size_t size);

/* The same where there is room for it: it must succeed. */
void node_counted_put(struct node_counted *counted, uint16_t dest, uint8_t type,
                      const void *data, size_t size);

#endif
