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

/* A carrier brings lists of faces from a face manager to tetrahedron builders,
 * and answers back: by messages from node to node (below), or through a tuple
 * space.  Both ends have the same interface.  A manager sends struct
 * incode_list and receives struct incode_answers, a builder the reverse; only
 * the used bytes travel (incode/paper/list.h). */

struct node_carrier {
    void *context;
    /* Whether it can send now.  It reserves room for the reply before it sends.
     */
    bool (*has_room)(void *context);
    /* Sends, where it has room. */
    void (*send)(void *context, const void *data, size_t size);
    /* The first message that waits at this end, the same until it is dropped;
     * NULL: none. */
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
    uint32_t peers;    /* nodes to which they go */
    uint16_t peer[NODE_BUILDERS_MAX];
    uint8_t owed[NODE_BUILDERS_MAX]; /* by each peer */
    uint64_t bytes_in, bytes_out;
};

/* Bytes for so many waiting messages. */
size_t node_lists_bytes(uint32_t places);

/* sends: NODE_LIST (a manager, each_max lists a builder) or NODE_ANSWERS (a
 * builder, to one manager, with a slot for each list that the manager may
 * send). memory: aligned to NODE_ALIGNMENT. counted and fault must outlive it.
 */
void node_lists_init(struct node_lists *lists, void *memory, uint32_t places,
                     uint8_t sends, uint32_t each_max,
                     struct node_counted *counted, struct node_fault *fault);

/* Another peer, up to NODE_BUILDERS_MAX. */
void node_lists_add(struct node_lists *lists, uint16_t peer);

struct node_carrier node_lists_carrier(struct node_lists *lists);

/* NODE_LIST or NODE_ANSWERS; an unsound message is a fault. */
void node_lists_take(struct node_lists *lists,
                     const struct cube_message *message);

/* A peer whose answers are outstanding; CUBE_HOST: there is none. */
uint16_t node_lists_owing(const struct node_lists *lists);

/* Waiting messages. */
uint32_t node_lists_held(const struct node_lists *lists);

#endif
