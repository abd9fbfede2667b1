/* The boot loader of a bare board: starts the image that its flash has for it,
 * or, where there is none or the host has asked for it, is a node that takes
 * one. */
#include "node/loader/loader.h"

#include <assert.h>
#include <string.h>

#include "as_node.h"
#include "bare.h"
#include "fault_text.h"
#include "node/loader/incoming.h"
#include "node/version.h"
#include "sign_key.h"
#include "transport/drivers/sign_sodium.h"

static struct bare_node bare;
static struct loader_rules rules;
static struct loader_slots slots;
static struct loader *loader;

static unsigned links(struct node_link_state state[CUBE_LINKS_MAX]) {
    return loader_links(loader, state);
}

/* --- the image ------------------------------------------------------------ */

/* What the image is told, and the host where the loader stays. */
static void describe(unsigned slot) {
    struct bare_handover *handover = &bare.handover;
    handover->boot = bare.boot;
    handover->reason = bare.reason.kind;
    (void)loader_slots_serial(rules.flash, handover->serial);
    static_assert(sizeof NODE_VERSION <= sizeof handover->loader,
                  "the version fits");
    memcpy(handover->loader, NODE_VERSION, sizeof NODE_VERSION);
    if (slot < LOADER_SLOTS) {
        handover->slot = slot;
        handover->number = slots.image[slot].number;
        memcpy(handover->digest, slots.image[slot].digest,
               sizeof handover->digest);
    }
}

/* Returns where the flash takes no record of a start on trial, or gives another
 * code than it gave before. */
static void start(unsigned slot) {
    struct loader_look look;
    const struct loader_flash *flash = rules.flash;
    /* NOLINTNEXTLINE(performance-no-int-to-ptr) */
    void *to = (void *)(uintptr_t)board_facts.image_at;
    if (!loader_slots_try(&slots))
        return;
    flash->read(flash->context, loader_slots_code(&slots, slot), to,
                slots.image[slot].bytes);
    if (!loader_look_copy(&look, &slots, slot, to))
        return;
    board_feed();
    bare_handover_give(&bare.handover);
    board_launch(board_facts.image_at);
}

/* --- its start ------------------------------------------------------------ */

static void begin(void) {
    bare_node_begin(&bare, true);
    bare.reason = bare_reason_take();
    bool ended_badly =
        bare_handover_drop() &&
        (bare.reason.kind == BARE_FAULT || bare.reason.kind == BARE_HUNG);
    rules = (struct loader_rules){.flash = board_facts.flash,
                                  .suite = &sign_sodium,
                                  .key = bare_sign_key,
                                  .board = board_facts.name,
                                  .address = board_facts.image_at,
                                  .room = board_facts.image_bytes,
                                  .alive = board_feed,
                                  .budget = bare.budget};
    bare_node_may_start(&bare);
    unsigned slot = loader_slots_start(&slots, &rules, ended_badly, &bare.boot);
    describe(slot);
    if (slot < LOADER_SLOTS && bare.reason.kind != BARE_STAY)
        start(slot);
    bare_node_fill_in(&bare);
    bare_node_tell_start(&bare);
}

_Noreturn void bare_main(void) {
    const char *why = NULL;
    begin();
    bare_node_learn(&bare);
    loader = loader_start(&bare.board, &slots, &why);
    if (loader == NULL)
        bare_fault(why, NULL, 0, 0);
    bare.links = links;
    for (enum node_event event = NODE_BUSY; event != NODE_STOPPED;) {
        event = loader_step(loader);
        board_feed();
        bare_node_console(&bare);
        if (event == NODE_IDLE)
            bare_node_idle(&bare, loader_wait_us(loader));
    }
    bare_node_restart(loader_reset_why(loader) == NODE_RESET_STAY ? BARE_STAY
                                                                  : BARE_BOOT);
}
