/* What a setup must be before a role looks at it.
 *
 * Memory: none.  Work: a copy, and a look at what is reserved.
 *
 *     if (!node_setup_read(&setup, &message, 8, &fault))
 *         return -1; // the fault says why
 */
#ifndef NODE_SETUP_H
#define NODE_SETUP_H

#include "fault.h"

/* nodes: of the cube, as the node's board has it.  False: *fault. */
bool node_setup_read(struct node_setup_message *setup,
                     const struct cube_message *message, unsigned nodes,
                     struct node_fault *fault);

#endif
