/* A strategy: which node has which role, what each is given first and next,
 * and what a commit and a loss mean.  The service runs them all and knows none;
 * to add one, write a file that defines such a struct, and put it into the
 * table of strategies.h.
 *
 * Work: that of the functions; the service calls `next` and `send` whenever
 * it comes to a node, so that they have to return at once. */
#ifndef HOST_STRATEGY_H
#define HOST_STRATEGY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "host/base/error.h"
#include "host/mesh/tetrahedra.h"
#include "host/mesh/order.h"
#include "host/service/ledger.h"
#include "incode/triangulator.h"
#include "node/message.h"
#include "transport/cube.h"

/* What a user may say of how a strategy shares the work; 0: nothing, and the
 * strategy has its own default. */
struct host_sharing {
    unsigned cluster;         /* nodes a cluster */
    unsigned builders;        /* of each face manager */
    unsigned faces_per_job;   /* in a list, at most */
    unsigned jobs_per_worker; /* lists a builder may have at a time */
};

/* Which of it a strategy heeds, a bit each. */
enum {
    HOST_SHARING_CLUSTER = 1,
    HOST_SHARING_BUILDERS = 2,
    HOST_SHARING_LISTS = 4 /* faces_per_job, jobs_per_worker */
};

/* What a strategy sees of a run. */
struct host_work {
    struct host_sharing sharing;
    unsigned nodes;  /* of the cube */
    unsigned living; /* of them, those that are not lost */
    bool *lost;      /* [nodes]: not in this generation */
    bool goes_round; /* links that are dead: no message has its own way */
    const struct host_order *order;
    struct host_ledger *ledger;
    struct host_tetrahedra *tets; /* that have come, of vertex numbers */
    uint32_t frames;   /* pages that each node has slots for, from `first` on */
    uint64_t page_key; /* of the setup */
    void *state;       /* the strategy's own, state_bytes */
    /* Sends a counted message, of at most CUBE_PAYLOAD_MAX bytes; false: there
     * is no room now.  For the strategy's `send`. */
    bool (*write)(void *context, unsigned node, uint8_t type, const void *data,
                  size_t size);
    /* The same to all nodes, of which none is lost. */
    bool (*write_to_all)(void *context, uint8_t type, const void *data,
                         size_t size);
    void *context; /* of both */
};

/* Whether a node is not in this generation. */
static inline bool host_is_lost(const struct host_work *work, unsigned node) {
    return work->lost != NULL && work->lost[node];
}

/* The first one from `node` on that is not lost; there must be one. */
static inline unsigned host_first_left(const struct host_work *work,
                                       unsigned node) {
    while (host_is_lost(work, node))
        node++;
    return node;
}

struct host_strategy;

/* What `auto` knows when it chooses. */
struct host_task {
    uint64_t points;
    uint64_t memory; /* of a node, bytes */
    unsigned nodes;
    unsigned processors;   /* so many of the nodes compute at once, */
    bool with_host;        /* on processors that are the host's, too */
    uint64_t wire_bytes_s; /* of the host's wire; 0: it holds nobody up */
    enum incode_face_rule face_rule;
    enum incode_build build;
    struct host_sharing sharing;
    /* Whether the nodes' memory does; NULL: it does for all. */
    bool (*fits)(const void *context, const struct host_strategy *strategy);
    const void *context; /* of fits */
    bool by_points;      /* one node alone may insert them (triangulator.h), */
    bool uneven; /* and they fill no volume evenly, as far as is known */
};

/* Processor time, in that of one node alone. */
struct host_cost {
    double busiest; /* of the node that has most to do */
    double total;   /* of all nodes */
};

struct host_strategy {
    const char *name;                  /* in options and statistics */
    const char *title;                 /* in tables */
    const char *help;                  /* what it does, in a few words */
    const char *linda;                 /* in --linda; NULL: no Linda program */
    size_t state_bytes;                /* of its own */
    enum incode_owner_rule owner_rule; /* of nodes and host */
    bool meshes;                       /* its nodes send to each other, too */
    bool by_faces;                     /* whatever is asked for, face by face */
    bool helps; /* nodes work for others after their own jobs, and tell of it */
    unsigned nodes_default;  /* 0: as many as this machine has processors */
    unsigned pages_in_a_row; /* to a node that has asked for them, before it is
                                another's turn; 0: one */
    unsigned sharing;        /* what it heeds of struct host_sharing */
    /* 0, or HOST_USAGE with the error where it cannot be run so.  NULL: it
     * always can. */
    int (*check)(unsigned nodes, const struct host_sharing *sharing,
                 enum incode_face_rule rule, struct host_error *error);
    /* Processor time that it is expected to take; INFINITY where it cannot do
     * the task.  `auto` takes the one that is done first (strategies.h). */
    struct host_cost (*cost)(const struct host_task *task);
    /* Regions that the order is cut into: a power of two. */
    unsigned (*regions)(unsigned nodes);
    /* Fills in what the node has to know: its role, and what goes with it.  The
     * rest is there already.  Once a node and generation, or more often; before
     * the run as well, where work has no more than the numbers of nodes and
     * the sharing: all of them are living, or one. */
    void (*set_up)(const struct host_work *work, unsigned node,
                   struct node_setup_message *setup);
    /* The first job of a node, when all nodes have their setup: true, or false
     * where it has none.  Once a node and generation, in the order of nodes. */
    bool (*first)(struct host_work *work, unsigned node,
                  struct incode_job *job);
    /* The same for a node that is not lost and has no job. */
    bool (*next)(struct host_work *work, unsigned node, struct incode_job *job);
    /* A node says that all tetrahedra of a brick are here: notes it in the
     * ledger.  0, or -1 where it is not for this node to say. */
    int (*commit)(struct host_work *work, unsigned node, uint32_t brick);
    /* A generation begins after a loss, work->lost and work->living are those
     * of the new one: drops what does not count any more, closes all jobs. */
    void (*lose)(struct host_work *work);
    /* Sends a node what else is due to it, a message at most: true where it has
     * sent one.  NULL: there is nothing else. */
    bool (*send)(struct host_work *work, unsigned node);
    /* A message of a type that the service does not know, behind a struct
     * node_result_header: none before it is lost, and its epoch is 0 or that of
     * the node's job.  0; -1 where the strategy does not know the type either;
     * or the code of `error`, filled in, where it is not sound.  NULL: there is
     * none of them. */
    int (*take)(struct host_work *work, const struct cube_message *message,
                struct host_error *error);
    /* Whether a node without a job has something to do.  NULL: it has not. */
    bool (*owes)(const struct host_work *work, unsigned node);
};

#endif
