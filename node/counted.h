/* A node's messages, of which those between it and the host are counted: the
 * host compares the counts with its own, and so learns of letters that a node
 * on their way has lost with its memory.
 *
 * Memory: the struct.  Work: that of cube_write.
 *
 *     if (node_letters_write(&letters, CUBE_HOST, NODE_SPILL, data, size) != 0)
 *         try again later;
 */
#ifndef NODE_LETTERS_H
#define NODE_LETTERS_H

#include "transport/cube.h"

struct node_letters {
    struct cube *cube;
    uint32_t received, sent; /* from and to the host, in this generation */
};

/* As cube_write. */
int node_letters_write(struct node_letters *letters, uint16_t dest,
                       uint8_t type, const void *data, size_t size);

#endif
