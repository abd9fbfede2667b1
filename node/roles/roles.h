/* Roles: what a node does in a generation of the wiring.  A role is a struct
 * of functions; the setup names it by its number, and the node calls nothing
 * else of it.  A new role is a file beside this one, a number in message.h and
 * a row in roles.c. */
#ifndef NODE_ROLES_H
#define NODE_ROLES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "node/common.h"
#include "node/message.h"

struct node_role {
    /* As statistics name it. */
    const char *name;

    /* The tables that fill its arena, as the memory map names them, in the
     * order in which `map` states their sizes; unit: of `count`, or NULL. */
    struct {
        const char *name, *unit;
    } tables[NODE_TABLES_MAX];

    /* Bytes of arena that suffice for this setup, in a node whose memory is
     * `memory` bytes in all. */
    size_t (*arena_min)(size_t memory, const struct node_setup_message *setup);

    /* Begins the role in an arena that is aligned to NODE_ALIGNMENT and not
     * cleared. counted sends its messages, fault takes its faults, now and
     * later; both outlive it.  False: *fault is set. */
    bool (*start)(void *self, size_t bytes,
                  const struct node_setup_message *setup,
                  struct node_counted *counted, struct node_fault *fault);

    /* Takes a message of any type that the node does not answer itself.  It
     * must take every message at once, except as `may_take` permits. */
    void (*message)(void *self, const struct cube_message *message,
                    uint64_t now_us);

    /* Whether the role takes this message now.  Otherwise it stays on its link,
     * and holds back those behind it.  The role may refuse only while messages
     * to the host have no room; they always get some.  NULL: it takes all. */
    bool (*may_take)(void *self, const struct cube_message *message);

    /* Computes for as long as the pace permits.  Returns the number of steps
     * that did something. */
    unsigned (*work)(void *self, struct node_pace *pace);

    /* Sends what may leave.  Returns the number of messages. */
    unsigned (*send)(void *self);

    /* The epoch of the job whose last result has left, so that its statistics
     * are due; 0: there is none. */
    uint32_t (*done)(const void *self);

    /* The statistics of that job have left: once for each, after `done` was not
     * 0, and never after a fault. */
    void (*end)(void *self, uint64_t now_us);

    /* The page that blocks the role: requested and not arrived.  INCODE_NONE:
     * there is none. */
    uint32_t (*awaited)(const void *self);

    /* A node whose answers to a list are outstanding; CUBE_HOST: none.  NULL:
     * the role has no lists. */
    uint32_t (*owing)(const void *self);

    /* Slots of its queues in use; 0 when no job is open. */
    uint32_t (*held)(const void *self);

    /* Fills in what it knows of the statistics since its start;
     * memory_high_water: bytes of its arena ever in use. */
    void (*totals)(const void *self, struct node_finished_message *totals,
                   uint64_t now_us);

    /* How full its tables are now.  Other fields stay. */
    void (*gauge)(const void *self, struct incode_gauge *gauge);

    /* Fills in `tables` and `pages` of the memory map. */
    void (*map)(const void *self, struct node_map *map);
};

/* The role of that number (enum node_role_number), or NULL: no such role. */
const struct node_role *node_role_named(uint32_t number);

#endif
