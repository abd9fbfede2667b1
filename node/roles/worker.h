/* The worker's role: turns the calls of a triangulator into messages.  Page
 * requests go out in batches; stars are encoded into batches that leave as the
 * host gives credit, commits among them in order; lists that spill go to the
 * host and come back.
 *
 * Memory: its state, two outboxes, then the triangulator.  Work: `work` closes
 * at most NODE_STEPS stars, fewer where the time does not suffice, and `send`
 * sends what the link takes.
 *
 *     const struct node_role *role = &node_worker_role;
 *     role->message(arena, &message, now_us);
 *     moved = role->work(arena, &pace) + role->send(arena);
 */
#ifndef NODE_WORKER_H
#define NODE_WORKER_H

#include "roles.h"

enum {
    NODE_STEPS = 32, /* triangulator's steps between looks at links, at most */
    NODE_WANTED_MAX = 64, /* pages asked for and not yet sent for */
    /* Messages on their way out: one for each 64 KiB of memory, within. */
    NODE_RESULT_SLOTS_MIN = 4,
    NODE_RESULT_SLOTS_MAX = 32,
    NODE_SPILL_SLOTS_MIN = 9,
    NODE_SPILL_SLOTS_MAX = 16
};

extern const struct node_role node_worker_role;

#endif
