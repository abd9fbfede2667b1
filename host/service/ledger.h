/* Which bricks are committed, which are out, and under which epoch.  A result
 * counts when the brick that owns it (incode/front/owner.h) is committed; what
 * a loss left uncommitted is dropped by host_ledger_abandon, and those bricks
 * are given out again, in ranges.
 *
 * Memory: a byte a brick and 16 bytes a node.  Work: constant a call, but for
 * host_ledger_abandon, one pass over the tetrahedra, and host_ledger_next,
 * which passes over the bricks once between two calls of the former.
 *
 *     while (host_ledger_next(&ledger, &order, &first, &last))
 *         epoch = host_ledger_open(&ledger, node, first, last);
 *     if (host_ledger_current(&ledger, node, epoch) &&
 *         host_ledger_commit(&ledger, node, brick) != 0)
 *         return HOST_CUBE;
 */
#ifndef HOST_LEDGER_H
#define HOST_LEDGER_H

#include <assert.h>
#include <stdbool.h>
#include <stdint.h>

#include "host/mesh/tetrahedra.h"
#include "host/order/order.h"
#include "incode/front/owner.h"

struct host_job {
    uint32_t epoch; /* 0: the node has no job */
    uint32_t first, last;
    uint32_t committed; /* bricks of [first, last) */
};
static_assert(sizeof(struct host_job) == 16, "16 bytes a node");

struct host_ledger {
    uint32_t bricks, nodes;
    enum incode_owner_rule owner_rule; /* after init: the smallest vertex */
    uint32_t epoch;                    /* of the last job given out */
    uint32_t committed;                /* bricks in all */
    uint32_t cursor;    /* bricks below it are committed or given out */
    uint32_t piece_max; /* bricks of a range, at most */
    uint8_t *open; /* [bricks] all bits set, or none where it is committed */
    struct host_job *job; /* [nodes] */
};

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
static inline bool host_ledger_committed(const struct host_ledger *ledger,
                                         uint32_t brick)
{
    return ledger->open[brick] == 0;
}

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
