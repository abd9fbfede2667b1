/* The node program: divides its arena between the cube's windows and its role
 * (roles/roles.h), and moves messages between them.  Nothing here waits; the
 * board sleeps when a step had nothing to do.
 *
 * Work: a step handles the frames that links hold, then lets the role compute
 * for NODE_PACE_US (common.h) and send what may leave.
 *
 *     struct node *node = node_start(&board, &why);
 *     while ((event = node_step(node)) != NODE_STOPPED)
 *         if (event == NODE_IDLE)
 *             board.idle(board.context, node_wait_us(node));
 */
#ifndef NODE_NODE_H
#define NODE_NODE_H

#include "board.h"
#include "message.h"

enum node_event {
    NODE_BUSY,   /* call again at once */
    NODE_IDLE,   /* call again when bytes come or node_wait_us is over */
    NODE_STOPPED /* the host has ended the run, or has this node restart */
};

struct node; /* opaque: lives at the start of the arena */

/* NULL where the arena does not suffice, the identity breaks a limit of the
 * cube or the arithmetic is unsound: *why. */
struct node *node_start(const struct node_board *board, const char **why);

/* Bytes of arena that a node of this identity needs for this setup, its role
 * included, where its memory (arena and fixed) is `memory` in all. */
size_t node_arena_needed(const struct node_identity *identity, size_t memory,
                         const struct node_setup_message *setup);

enum node_event node_step(struct node *node);

/* The parts of a step, for a simulator that times nodes by their work, and
 * whose links work beside the processors: then links are not polled during
 * work. node_receive moves frames, forwards messages of other nodes and takes
 * the node's own. node_work lets the role compute.  Both return how much was
 * done. */
unsigned node_receive(struct node *node);
unsigned node_work(struct node *node);

/* Sends what may leave; `moved`: what the other parts did. */
enum node_event node_send(struct node *node, unsigned moved);

/* Microseconds until node_step must be called even if no byte comes. */
uint64_t node_wait_us(const struct node *node);

/* State of its links, for a board's own console.  Returns the number of links.
 */
unsigned node_links(const struct node *node,
                    struct node_link_state state[CUBE_LINKS_MAX]);

/* Whether any link has been up since its start. */
bool node_has_met(const struct node *node);

/* Slots of the role's queues that are in use: 0 when no job is open. */
uint32_t node_held(const struct node *node);

/* For a simulator that times nodes by their work: the node's statistics since
 * its start, as in a report to the host but without those of the board and the
 * links; and its messages. */
void node_account(const struct node *node,
                  struct node_finished_message *totals);
const struct cube_statistics *node_messages(const struct node *node);

/* Why it is stopped, for board.reset. */
enum node_reset node_reset_why(const struct node *node);

/* Steps and sleeps until the host ends the run, or has it restart. */
enum node_reset node_run(struct node *node);

#endif
