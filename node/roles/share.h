/* A node's share of the tuple space (transport/tuples), and its use by roles: a
 * carrier of lists and answers (lists.h) as tuples (kind, bytes), and the
 * process that eval starts here.
 *
 * The places are the manager and its builders, as the setup names them, in the
 * order of their numbers.  Kinds are keys, chosen so that all tuples are stored
 * at the manager, which is one end of every transfer.  So a list reaches its
 * builder in one message, and the manager knows which node has taken a list and
 * has not answered.  Its store never fills: the number of lists that are out is
 * bounded by the largest tuples that it holds. */
#ifndef NODE_SHARE_H
#define NODE_SHARE_H

#include "lists.h"
#include "node/common.h"
#include "node/message.h"
#include "transport/tuples/tuples.h"

enum {
    NODE_SHARE_STORE_MAX = 65536, /* bytes of tuples in a node */
    NODE_SHARE_OPERATIONS = 16,
    NODE_SHARE_TAKES_MAX = 8, /* that a carrier has under way at a time */
    NODE_SHARE_FUNCTION = 0   /* what eval starts: the role's process */
};

/* What a tuple is; its first field has the number for that. */
enum node_share_kind {
    NODE_SHARE_JOB,    /* then struct incode_list; no bytes: the end */
    NODE_SHARE_RESULT, /* then struct incode_answers */
    NODE_SHARE_WORKER, /* then an uint32: jobs that the process has done */
    NODE_SHARE_REGION, /* then struct incode_job */
    NODE_SHARE_TAKEN,  /* then struct node_taken */
    NODE_SHARE_KINDS
};

struct node_share {
    struct tuples *space;
    struct node_counted *counted;
    struct node_fault *fault;
    tuples_function *process; /* with the role as its context */
    void *role;
    enum node_share_kind puts, takes;  /* of the carrier */
    uint32_t number[NODE_SHARE_KINDS]; /* first fields */
    uint32_t takes_max;                /* 1 .. NODE_SHARE_TAKES_MAX */
    uint32_t next;                     /* of `taking`, to be looked at first */
    int taking[NODE_SHARE_TAKES_MAX];  /* its operations, or -1 */
    uint32_t out, out_max;             /* jobs without an answer */
    uint32_t taken;                    /* by the carrier */
    bool ended;                        /* it has taken the end */
    uint64_t bytes_in, bytes_out;
    uint16_t places;
    uint16_t node_of[NODE_BUILDERS_MAX + 1]; /* places, in rising order */
};

/* Bytes beside the struct, for a sound setup; 0: it is not sound. */
size_t node_share_bytes(const struct node_setup_message *setup);

/* memory: aligned to NODE_ALIGNMENT.  False: *fault is set. */
bool node_share_init(struct node_share *share, void *memory,
                     const struct node_setup_message *setup,
                     tuples_function *process, void *role,
                     struct node_counted *counted, struct node_fault *fault);

/* NODE_TUPLES. */
void node_share_take(struct node_share *share,
                     const struct cube_message *message);

/* Puts tuples of one kind, and takes those of the other, with up to takes_max
 * requests at a time, 1 .. NODE_SHARE_TAKES_MAX. */
struct node_carrier node_share_carrier(struct node_share *share,
                                       enum node_share_kind puts,
                                       enum node_share_kind takes,
                                       uint32_t takes_max);

/* At the manager: a node that has not answered an operation, such as the eval
 * of its process; else one that has taken a list and put no answer; CUBE_HOST:
 * there is none. */
uint16_t node_share_owing(const struct node_share *share);

/* Takes no more tuples: pending requests are given up. */
void node_share_stop(struct node_share *share);

/* _eval_all: an eval of the process at each other place. _end_all: an out of
 * the end for each.  A call begins as many of these operations as leave `kept`
 * operations free, and closes each at once.  False: none was begun. */
bool node_share_eval_all(struct node_share *share, uint32_t *count,
                         unsigned kept);
bool node_share_end_all(struct node_share *share, uint32_t *count,
                        unsigned kept);

/* Takes a tuple (kind, number) or (kind, bytes) by *operation, which begins if
 * it is -1.  True: the tuple has come, and *operation is -1 again.  `into` gets
 * the tuple's bytes, which must be `size`. */
bool node_share_in_worker(struct node_share *share, int *operation);
bool node_share_in_bytes(struct node_share *share, enum node_share_kind kind,
                         int *operation, void *into, size_t size);

/* Puts a tuple; false: no operation is free. */
bool node_share_out_bytes(struct node_share *share, enum node_share_kind kind,
                          const void *data, size_t size);

#endif
