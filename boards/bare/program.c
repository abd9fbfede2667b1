/* The node program on a bare board, from its start to its restart. */
#include "as_node.h"
#include "bare.h"
#include "fault_text.h"
#include "node/loader/slots.h"
#include "node/node.h"

enum { DEAD_US = 30000000 /* as nodes of a cube file have it */ };

static struct bare_node bare;
static struct node *node;
static struct loader_state up; /* what the flash is to say of this image, */
static bool unconfirmed;       /* once a neighbour has been met */

static unsigned links(struct node_link_state state[CUBE_LINKS_MAX]) {
    return node_links(node, state);
}

/* Whoever has started it: a loader, which has looked at the reason and counted
 * the start, or the processor. */
static void begin(void) {
    bare_node_begin(&bare, false);
    if (bare_handover_take(&bare.handover)) {
        bare.boot = bare.handover.boot;
        bare.reason = bare_reason_taken(bare.handover.reason);
        unconfirmed = loader_slots_unconfirmed(board_facts.flash,
                                               bare.handover.slot, &up);
    } else {
        bare.reason = bare_reason_take();
        bare_node_may_start(&bare);
        if (board_facts.flash != NULL)
            (void)loader_boots_next(board_facts.flash, &bare.boot);
    }
    bare_node_fill_in(&bare);
    bare.board.identity.dead_us = DEAD_US;
    bare_node_tell_start(&bare);
}

/* A neighbour has been met: the image is good enough to be told another, and
 * starts from now on whatever happens. */
static void confirm(void) {
    if (!loader_slots_confirm(board_facts.flash, &up))
        bare_fault("the flash takes no record of this image", NULL, 0, 0);
    unconfirmed = false;
}

/* Without neighbours, as it is before a board is wired: this start has not
 * failed. */
static void wait_unwired(void) {
    static bool lived;
    if (!lived && bare.handover.magic != 0 &&
        board_now_us() >= LOADER_LIVED_US) {
        lived = true;
        (void)loader_slots_lived(board_facts.flash, bare.handover.slot);
    }
}

_Noreturn void bare_main(void) {
    const char *why = NULL;
    begin();
    bare.waits = wait_unwired;
    bare_node_learn(&bare);
    node = node_start(&bare.board, &why);
    if (node == NULL)
        bare_fault(why, NULL, 0, 0);
    bare.links = links;
    for (enum node_event event = NODE_BUSY; event != NODE_STOPPED;) {
        event = node_step(node);
        board_feed();
        bare_node_console(&bare);
        if (unconfirmed && node_has_met(node))
            confirm();
        else if (unconfirmed)
            wait_unwired();
        if (event == NODE_IDLE)
            bare_node_idle(&bare, node_wait_us(node));
    }
    bare_node_end(node_reset_why(node));
}
