/* Lists of faces and answers as messages from node to node: the carrier of a
 * manager and its builders in the strategies `master-slaves` and `hybrid`.  The
 * builder with the fewest lists gets the next one. */
#ifndef NODE_LISTS_H
#define NODE_LISTS_H

#include <stdbool.h>
#include <stddef.h>

#include "node/common.h"
#include "node/message.h"
#include "node/result.h"

/* What carries lists of faces from a face manager to tetrahedron builders, and
 * answers back: messages from node to node (lists.h), or a tuple space.  Each
 * end sees the same: a manager sends struct incode_list and is sent struct
 * incode_answers, a builder the other way round, as many bytes of them as are
 * in use (incode/paper/list.h). */

struct node_carrier {
    void *context;
    /* Whether it takes something to send now.  It must have room for what is
     * sent back before it does. */
    bool (*has_room)(void *context);
    /* Sends, where it has room. */
    void (*send)(void *context, const void *data, size_t size);
    /* What was sent to this end and waits, one of them: the same until it is
     * dropped; NULL: nothing. */
    const void *(*first)(void *context, size_t *size);
    void (*drop)(void *context);
};

struct node_lists {
    struct node_counted *counted;
    struct node_fault *fault;
    uint8_t sends; /* NODE_LIST, or NODE_ANSWERS; the other one comes */
    struct node_outbox inbox;
    uint32_t out;      /* lists sent, and not answered: all of them, */
    uint32_t each_max; /* at most so many of a peer, */
    uint32_t next;     /* the peer to be looked at first */
    uint32_t peers;    /* who they go to */
    uint16_t peer[NODE_BUILDERS_MAX];
    uint8_t owed[NODE_BUILDERS_MAX]; /* by each peer */
    uint64_t bytes_in, bytes_out;
};

/* Bytes for so many messages that wait. */
size_t node_lists_bytes(uint32_t places);

/* sends: NODE_LIST (a manager, each_max lists a builder) or NODE_ANSWERS (a
 * builder, to one manager, a place for each list that this may send).  memory:
 * aligned to NODE_ALIGNMENT.  counted and fault stay. */
void node_lists_init(struct node_lists *lists, void *memory, uint32_t places,
                     uint8_t sends, uint32_t each_max,
                     struct node_counted *counted, struct node_fault *fault);

/* Another peer, up to NODE_BUILDERS_MAX. */
void node_lists_add(struct node_lists *lists, uint16_t peer);

struct node_carrier node_lists_carrier(struct node_lists *lists);

/* NODE_LIST or NODE_ANSWERS; what is not sound is a fault. */
void node_lists_take(struct node_lists *lists,
                     const struct cube_message *message);

/* A peer that owes answers; CUBE_HOST: none does. */
uint16_t node_lists_owing(const struct node_lists *lists);

/* Messages that wait. */
uint32_t node_lists_held(const struct node_lists *lists);

#endif
