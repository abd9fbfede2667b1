/* Which node keeps a page: of nodes 1 .. holders in turn, as those who ask for
 * pages and those who keep them must agree.
 *
 * Memory: none.  Work: constant a call.
 *
 *     uint16_t to = node_keeper(page, holders);
 *     if (to != CUBE_HOST)
 *         frame = node_keeper_place(page, holders) % frames;
 */
#ifndef NODE_KEEPERS_H
#define NODE_KEEPERS_H

#include "fault.h"
#include "message.h"

/* Whom to ask for the page: CUBE_HOST where there are no holders. */
static inline uint16_t node_keeper(uint32_t page, uint32_t holders) {
    return (uint16_t)(holders == 0 ? CUBE_HOST : 1 + page % holders);
}

/* The page's place among those of its keeper, from 0 on; holders: 1 or more. */
static inline uint32_t node_keeper_place(uint32_t page, uint32_t holders) {
    return page / holders;
}

/* Whether the cube has as many holders as the setup says, and node `self` is
 * one of them where it is to be, and else none: it would ask itself for pages.
 * False: *fault. */
bool node_keepers_fit(const struct node_setup_message *setup, unsigned self,
                      bool keeps, struct node_fault *fault);

#endif
