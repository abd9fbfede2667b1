/* A bare board as its node asks for it (node/board.h): pipes, time, sleep, who
 * it is, and its console; for the node program and the loader alike.
 *
 * Work: bare_node_learn waits until a neighbour has told who the node is; the
 * others return at once, but for idle. */
#ifndef BOARDS_BARE_AS_NODE_H
#define BOARDS_BARE_AS_NODE_H

#include "handover.h"
#include "node/board.h"
#include "node/identity.h"
#include "node/loader/slots.h"
#include "node/message.h"
#include "shell.h"

struct bare_node {
    struct node_board board;
    bool loader; /* runs, not the program */
    struct loader_budget *budget;
    struct bare_reason reason;
    struct bare_handover handover; /* a loader's: what it starts */
    uint32_t boot;                 /* 0: the board counts none */
    bool known;                    /* who the node is */
    uint64_t idle_us;
    void (*waits)(void); /* is called while it is not known; NULL: nobody is */
    struct learner learner;
    struct bare_shell shell;
    /* For the console, once the node has begun: state of its links, of how
     * many. */
    unsigned (*links)(struct node_link_state state[CUBE_LINKS_MAX]);
};

/* Time, UARTs and guard. */
void bare_node_begin(struct bare_node *bare, bool loader);

/* Waits if there were too many starts of late (slots.h).  Called by the first
 * program that runs, before the start is counted in the flash. */
void bare_node_may_start(struct bare_node *bare);

/* What a node needs of its board, and what is known of this start: to be called
 * once reason and boot are. */
void bare_node_fill_in(struct bare_node *bare);

/* Who and why, and the memory map, to the console. */
void bare_node_tell_start(const struct bare_node *bare);

/* The node's number, from who has greeted it; ends with the pipes in their
 * places. */
void bare_node_learn(struct bare_node *bare);

/* Between two steps: answers a line typed at the console, and counts the time.
 */
void bare_node_console(struct bare_node *bare);

/* Sleeps until a link has something to do, at most so long. */
void bare_node_idle(struct bare_node *bare, uint64_t wait_us);

/* The node's end. */
_Noreturn void bare_node_end(enum node_reset why);

/* Lets what is on its way go, keeps the reason and restarts. */
_Noreturn void bare_node_restart(enum bare_reason_kind reason);

#endif
