#include "ledger.h"

#include <stdlib.h>
#include <string.h>

#include "../incode/predicates.h"

int host_ledger_init(struct host_ledger *ledger, uint32_t bricks,
                     uint32_t nodes, struct host_error *error)
{
    memset(ledger, 0, sizeof *ledger);
    ledger->bricks = bricks;
    ledger->nodes = nodes;
    ledger->bits = calloc((size_t)bricks / 64 + 1, sizeof *ledger->bits);
    ledger->job = calloc(nodes, sizeof *ledger->job);
    if (ledger->bits == NULL || ledger->job == NULL) {
        host_ledger_free(ledger);
        return host_fail_memory(error, "the list of bricks");
    }
    return 0;
}

void host_ledger_free(struct host_ledger *ledger)
{
    free(ledger->bits);
    free(ledger->job);
    memset(ledger, 0, sizeof *ledger);
}

uint32_t host_ledger_open(struct host_ledger *ledger, uint32_t node,
                          uint32_t first, uint32_t last)
{
    struct host_job *job = &ledger->job[node];
    job->epoch = ++ledger->epoch;
    job->first = first;
    job->last = last;
    job->committed = 0;
    job->finished = false;
    return job->epoch;
}

bool host_ledger_current(const struct host_ledger *ledger, uint32_t node,
                         uint32_t epoch)
{
    return node < ledger->nodes && epoch != 0 &&
           ledger->job[node].epoch == epoch && !ledger->job[node].finished;
}

bool host_ledger_committed(const struct host_ledger *ledger, uint32_t brick)
{
    return (ledger->bits[brick / 64] >> (brick % 64) & 1) != 0;
}

int host_ledger_commit(struct host_ledger *ledger, uint32_t node,
                       uint32_t brick)
{
    struct host_job *job = &ledger->job[node];
    if (brick < job->first || brick >= job->last ||
        host_ledger_committed(ledger, brick)) {
        return -1;
    }
    ledger->bits[brick / 64] |= UINT64_C(1) << (brick % 64);
    ledger->committed++;
    job->committed++;
    return 0;
}

int host_ledger_finish(struct host_ledger *ledger, uint32_t node)
{
    struct host_job *job = &ledger->job[node];
    if (job->committed != job->last - job->first) {
        return -1;
    }
    job->finished = true;
    return 0;
}

/* The brick that owns a tetrahedron. */
static uint32_t owner(const struct host_order *order, const uint32_t v[4])
{
    uint32_t smallest = v[0];
    double low[3], other[3];
    host_vertex(order, v[0], low);
    for (int i = 1; i < 4; i++) {
        host_vertex(order, v[i], other);
        if (incode_lexicographic(other, low) < 0) {
            smallest = v[i];
            memcpy(low, other, sizeof low);
        }
    }
    return smallest / INCODE_BRICK_POINTS;
}

uint64_t host_ledger_abandon(struct host_ledger *ledger, uint32_t node,
                             const struct host_order *order,
                             struct host_tetrahedra *tets)
{
    struct host_job *job = &ledger->job[node];
    uint64_t kept = 0, count = tets->count;
    for (uint64_t i = 0; i < count; i++) {
        uint32_t brick = owner(order, tets->v[i]);
        bool lost = brick >= job->first && brick < job->last &&
                    !host_ledger_committed(ledger, brick);
        if (!lost) {
            memmove(tets->v[kept], tets->v[i], sizeof tets->v[0]);
            kept++;
        }
    }
    host_tetrahedra_cut(tets, kept);
    job->epoch = 0;
    return count - kept;
}
