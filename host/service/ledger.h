/* Which bricks are committed, which are out, and under which epoch.  A result
 * counts when the brick that owns it (incode/front/job.h) is committed; what
 * a loss left uncommitted is dropped by host_ledger_abandon, and those bricks
 * are given out again, in ranges.
 *
 * The ledger also knows which node committed a brick and which node found a
 * tetrahedron, so that the check of the result (audit.h) can name the node.
 *
 * Memory: 3 bytes a brick, 40 bytes a node and 16 bytes for each change of
 * the finder between two tetrahedra that follow each other; in a call that puts
 * arrays aside (host/base/scratch.h), all but those of nodes on disk. */
#ifndef HOST_LEDGER_H
#define HOST_LEDGER_H

#include <assert.h>
#include <stdbool.h>
#include <stdint.h>

#include "host/mesh/tetrahedra.h"
#include "host/mesh/order.h"
#include "incode/front/job.h"

struct host_job {
    uint32_t epoch; /* 0: the node has no job */
    uint32_t first, last;
    uint32_t committed; /* bricks of [first, last) */
    uint64_t rows;     /* tetrahedra that have come for it; how many may come */
    uint64_t rows_max; /* before they are judged: results.h */
};

/* A run of tetrahedra that one node has found: from the end of the run before,
 * or 0, to `end`. */
struct host_found {
    uint64_t end;
    uint32_t node;
};

enum {
    HOST_LEDGER_ROWS_A_POINT = 16, /* tetrahedra a point of a job, before they
                                      are judged; uniform points have 6.8 */
    HOST_LEDGER_ROWS_MIN = 4096
};

struct host_ledger {
    uint32_t bricks, nodes;
    enum incode_owner_rule owner_rule; /* after init: the smallest vertex */
    uint32_t epoch;                    /* of the last job given out */
    uint32_t committed;                /* bricks in all */
    uint32_t cursor;    /* bricks below it are committed or given out */
    uint32_t piece_max; /* bricks of a range, at most */
    uint8_t *open; /* [bricks] all bits set, or none where it is committed */
    bool alone;    /* nodes hear nothing of each other: a brick is the
                      work of the node that commits it */
    uint16_t *by;  /* [bricks] the node that committed it last, and ALONE; all
                      bits set: none has yet */
    struct host_job *job;     /* [nodes] */
    struct host_found *found; /* [runs] */
    size_t runs, runs_max;
};

#define HOST_LEDGER_ALONE UINT16_C(0x8000)

/* The node that committed a brick last; if none has, a number that is no
 * node's.
 */
static inline uint32_t host_ledger_by(const struct host_ledger *ledger,
                                      uint32_t brick) {
    return ledger->by[brick] & (HOST_LEDGER_ALONE - 1u);
}

int host_ledger_init(struct host_ledger *ledger, uint32_t bricks,
                     uint32_t nodes, struct host_error *error);
void host_ledger_free(struct host_ledger *ledger);

/* The brick that owns a tetrahedron of vertices v. */
uint32_t host_ledger_owner(const struct host_ledger *ledger,
                           const struct host_order *order, const uint32_t v[4]);

/* The next range of bricks that are neither committed nor given out, within
 * one region of the order; false: none is left. */
bool host_ledger_next(struct host_ledger *ledger,
                      const struct host_order *order, uint32_t *first,
                      uint32_t *last);

/* Gives bricks [first, last) to a node; returns the job's epoch, never 0. */
uint32_t host_ledger_open(struct host_ledger *ledger, uint32_t node,
                          uint32_t first, uint32_t last);

/* Whether results of this epoch count. */
bool host_ledger_current(const struct host_ledger *ledger, uint32_t node,
                         uint32_t epoch);

/* 0, or -1 where the brick is not the node's or is committed already. */
int host_ledger_commit(struct host_ledger *ledger, uint32_t node,
                       uint32_t brick);
/* A brick that is not committed was so in an earlier run of the host; by: a
 * number that stands for all its nodes. */
void host_ledger_restore(struct host_ledger *ledger, uint32_t brick,
                         uint32_t by);
static inline bool host_ledger_committed(const struct host_ledger *ledger,
                                         uint32_t brick) {
    return ledger->open[brick] == 0;
}

/* Notes that `node` has found the next `count` tetrahedra.  Sets the error if
 * there is no memory. */
int host_ledger_found(struct host_ledger *ledger, uint32_t node, uint64_t count,
                      struct host_error *error);

/* The node that found tetrahedron i. */
uint32_t host_ledger_finder(const struct host_ledger *ledger, uint64_t i);

/* A committed brick is to be done again: its tetrahedra are dropped by the next
 * host_ledger_abandon. */
void host_ledger_reopen(struct host_ledger *ledger, uint32_t brick);

/* Closes the job of a node that has said it is done: 0, or -1 where a brick
 * of it is not committed. */
int host_ledger_finish(struct host_ledger *ledger, uint32_t node);

/* Closes all jobs, drops the tetrahedra (of vertex numbers, in any order) that
 * belong to uncommitted bricks, and makes ready to give those bricks out in
 * ranges, each at most one of so many equal pieces (1 or more) of what is left.
 * Returns how many tetrahedra were dropped. */
uint64_t host_ledger_abandon(struct host_ledger *ledger, uint32_t pieces,
                             const struct host_order *order,
                             struct host_tetrahedra *tets);

#endif
