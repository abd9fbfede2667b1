#include "ledger.h"

#include <stdlib.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"

int host_ledger_init(struct host_ledger *ledger, uint32_t bricks,
                     uint32_t nodes, struct host_error *error) {
    memset(ledger, 0, sizeof *ledger);
    ledger->bricks = bricks;
    ledger->nodes = nodes;
    ledger->piece_max = bricks;
    ledger->open = host_map(bricks);
    ledger->by = host_map((size_t)bricks * sizeof *ledger->by);
    ledger->job = calloc(nodes, sizeof *ledger->job);
    if (ledger->open == NULL || ledger->by == NULL || ledger->job == NULL) {
        host_ledger_free(ledger);
        return host_fail_memory(error, "the list of bricks");
    }
    for (uint32_t b = 0; b < bricks; b++) {
        host_call_trim(sizeof *ledger->open + sizeof *ledger->by);
        ledger->open[b] = UINT8_MAX;
        ledger->by[b] = UINT16_MAX;
    }
    return 0;
}

void host_ledger_free(struct host_ledger *ledger) {
    host_unmap(ledger->open, ledger->bricks);
    host_unmap(ledger->by, (size_t)ledger->bricks * sizeof *ledger->by);
    free(ledger->job);
    host_unmap(ledger->found, ledger->runs_max * sizeof *ledger->found);
    memset(ledger, 0, sizeof *ledger);
}

/* The end of the region that a brick is in. */
static uint32_t region_end(const struct host_order *order, uint32_t brick) {
    uint32_t low = 0, high = order->regions;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (order->region[middle].first <= brick)
            low = middle;
        else
            high = middle;
    }
    return order->region[low].last;
}

bool host_ledger_next(struct host_ledger *ledger,
                      const struct host_order *order, uint32_t *first,
                      uint32_t *last) {
    uint32_t at = ledger->cursor;
    for (; at < ledger->bricks && host_ledger_committed(ledger, at); at++)
        host_call_trim(sizeof *ledger->open);
    *first = at;
    if (at < ledger->bricks) {
        uint32_t end = region_end(order, at);
        for (; at < end && at - *first < ledger->piece_max &&
               !host_ledger_committed(ledger, at);
             at++)
            host_call_trim(sizeof *ledger->open);
    }
    *last = at;
    ledger->cursor = at;
    return *first < *last;
}

uint32_t host_ledger_open(struct host_ledger *ledger, uint32_t node,
                          uint32_t first, uint32_t last) {
    struct host_job *job = &ledger->job[node];
    job->epoch = ++ledger->epoch;
    job->first = first;
    job->last = last;
    job->committed = 0;
    job->rows = 0;
    job->rows_max = HOST_LEDGER_ROWS_MIN + (uint64_t)(last - first) *
                                               INCODE_BRICK_POINTS *
                                               HOST_LEDGER_ROWS_A_POINT;
    return job->epoch;
}

bool host_ledger_current(const struct host_ledger *ledger, uint32_t node,
                         uint32_t epoch) {
    return node < ledger->nodes && epoch != 0 &&
           ledger->job[node].epoch == epoch;
}

int host_ledger_commit(struct host_ledger *ledger, uint32_t node,
                       uint32_t brick) {
    struct host_job *job = &ledger->job[node];
    if (job->epoch == 0 || brick < job->first || brick >= job->last ||
        host_ledger_committed(ledger, brick))
        return -1;
    ledger->open[brick] = 0;
    ledger->by[brick] =
        (uint16_t)(node | (ledger->alone ? HOST_LEDGER_ALONE : 0));
    ledger->committed++;
    job->committed++;
    return 0;
}

void host_ledger_restore(struct host_ledger *ledger, uint32_t brick,
                         uint32_t by) {
    assert(brick < ledger->bricks && !host_ledger_committed(ledger, brick));
    ledger->open[brick] = 0;
    ledger->by[brick] = (uint16_t)(by | HOST_LEDGER_ALONE);
    ledger->committed++;
}

int host_ledger_finish(struct host_ledger *ledger, uint32_t node) {
    struct host_job *job = &ledger->job[node];
    if (job->epoch == 0 || job->committed != job->last - job->first)
        return -1;
    job->epoch = 0;
    return 0;
}

uint32_t host_ledger_owner(const struct host_ledger *ledger,
                           const struct host_order *order,
                           const uint32_t v[4]) {
    double at[4][3];
    host_call_trim((size_t)4 * HOST_CALL_AROUND);
    for (int i = 0; i < 4; i++)
        host_vertex(order, v[i], at[i]);
    const double *const p[4] = {at[0], at[1], at[2], at[3]};
    return v[incode_owner(ledger->owner_rule, v, p)] / INCODE_BRICK_POINTS;
}

int host_ledger_found(struct host_ledger *ledger, uint32_t node, uint64_t count,
                      struct host_error *error) {
    size_t runs = ledger->runs;
    uint64_t before = runs == 0 ? 0 : ledger->found[runs - 1].end;
    if (count == 0)
        return 0;
    if (runs > 0 && ledger->found[runs - 1].node == node) {
        ledger->found[runs - 1].end = before + count;
        return 0;
    }
    if (runs == ledger->runs_max) {
        size_t more = runs == 0 ? 64 : 2 * runs;
        void *moved = host_remap(ledger->found, runs * sizeof *ledger->found,
                                 more * sizeof *ledger->found);
        if (moved == NULL)
            return host_fail_memory(error, "the list of finders");
        ledger->found = moved;
        ledger->runs_max = more;
    }
    ledger->found[ledger->runs++] = (struct host_found){before + count, node};
    return 0;
}

uint32_t host_ledger_finder(const struct host_ledger *ledger, uint64_t i) {
    size_t low = 0, high = ledger->runs;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (ledger->found[middle].end <= i)
            low = middle + 1;
        else
            high = middle;
    }
    assert(low < ledger->runs);
    return ledger->found[low].node;
}

void host_ledger_reopen(struct host_ledger *ledger, uint32_t brick) {
    assert(brick < ledger->bricks && host_ledger_committed(ledger, brick));
    ledger->open[brick] = UINT8_MAX;
    ledger->committed--;
}

/* Keeps the tetrahedra of committed bricks, in their order, and their finders.
 * The number of runs never grows. */
static uint64_t keep_committed(struct host_ledger *ledger,
                               const struct host_order *order,
                               struct host_tetrahedra *tets) {
    uint64_t kept = 0, i = 0;
    size_t runs = 0;
    for (size_t r = 0; r < ledger->runs; r++) {
        struct host_found run = ledger->found[r];
        uint64_t before = kept;
        for (; i < run.end; i++) {
            if (host_ledger_committed(
                    ledger, host_ledger_owner(ledger, order, tets->v[i]))) {
                memmove(tets->v[kept], tets->v[i], sizeof tets->v[0]);
                kept++;
            }
        }
        if (kept == before)
            continue;
        if (runs > 0 && ledger->found[runs - 1].node == run.node)
            runs--;
        ledger->found[runs++] = (struct host_found){kept, run.node};
    }
    assert(i == tets->count);
    ledger->runs = runs;
    return kept;
}

uint64_t host_ledger_abandon(struct host_ledger *ledger, uint32_t pieces,
                             const struct host_order *order,
                             struct host_tetrahedra *tets) {
    uint64_t count = tets->count;
    uint32_t left = ledger->bricks - ledger->committed;
    if (left > 0)
        host_tetrahedra_cut(tets, keep_committed(ledger, order, tets));
    for (uint32_t i = 0; i < ledger->nodes; i++)
        ledger->job[i].epoch = 0;
    ledger->cursor = 0;
    ledger->piece_max = left / pieces + 1;
    return count - tets->count;
}
