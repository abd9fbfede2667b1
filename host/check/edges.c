#include "edges.h"

#include <stdbool.h>
#include <stdlib.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"

enum {
    FEW_MAX = 64,        /* distinct ends found by looking at each */
    CHUNK = 1 << 10,     /* vertices a turn of a thread */
    WINDOW_MIN = 1 << 16 /* ends */
};

/* Edges are listed at their lower end, as many vertices at a time as the list
 * has room for: [first, last). */
struct edges {
    const struct host_tetrahedra *tets;
    uint32_t vertices, first, last;
    uint64_t *start; /* [vertices + 1] where the ends at a vertex begin */
    uint32_t *end;   /* [room] higher ends of the window's vertices */
    uint64_t room;
    uint32_t next; /* first vertex of the window that no thread has taken */
    uint64_t count;
};

/* Calls for each of the six edges of each tetrahedron whose lower end is in
 * the window.  Rows are sorted by lowest vertex, so those past the window's
 * last need no look. */
static void list_ends(struct edges *e)
{
    uint64_t base = e->start[e->first];
    for (uint64_t i = 0; i < e->tets->count; i++) {
        const uint32_t *v = e->tets->v[i];
        if (v[0] >= e->last) {
            return;
        }
        for (int a = 0; a < 3; a++) {
            for (int b = a + 1; b < 4; b++) {
                uint32_t low = v[a] < v[b] ? v[a] : v[b];
                uint32_t high = v[a] < v[b] ? v[b] : v[a];
                if (low >= e->first && low < e->last) {
                    e->end[e->start[low]++ - base] = high;
                }
            }
        }
    }
}

static void count_ends(struct edges *e)
{
    for (uint64_t i = 0; i < e->tets->count; i++) {
        const uint32_t *v = e->tets->v[i];
        e->start[v[0] + 1] += 3; /* the lowest first, then the second */
        e->start[v[1] + 1] += 2;
        e->start[(v[2] < v[3] ? v[2] : v[3]) + 1] += 1;
    }
    for (uint32_t p = 0; p < e->vertices; p++) {
        e->start[p + 1] += e->start[p];
    }
}

static int compare(const void *p, const void *q)
{
    const uint32_t *a = p, *b = q;
    return *a < *b ? -1 : *a > *b;
}

static uint64_t distinct(uint32_t *end, uint64_t n)
{
    uint32_t few[FEW_MAX];
    uint64_t count = 0, i = 0;
    for (; i < n && count < FEW_MAX; i++) {
        uint64_t k = 0;
        while (k < count && few[k] != end[i]) {
            k++;
        }
        if (k == count) {
            few[count++] = end[i];
        }
    }
    if (i == n) {
        return count;
    }
    qsort(end, (size_t)n, sizeof *end, compare);
    count = 1;
    for (i = 1; i < n; i++) {
        count += end[i] != end[i - 1];
    }
    return count;
}

static void count_part(void *context, unsigned part)
{
    (void)part;
    struct edges *e = context;
    uint64_t count = 0, base = e->first == 0 ? 0 : e->start[e->first - 1];
    for (;;) {
        uint32_t p = __atomic_fetch_add(&e->next, CHUNK, __ATOMIC_RELAXED);
        if (p >= e->last) {
            break;
        }
        uint32_t stop = e->last - p < CHUNK ? e->last : p + CHUNK;
        for (; p < stop; p++) {
            /* listing has moved each start to the next vertex's */
            uint64_t from = p == 0 ? 0 : e->start[p - 1];
            if (e->start[p] > from) {
                count += distinct(e->end + (from - base), e->start[p] - from);
            }
        }
    }
    (void)__atomic_fetch_add(&e->count, count, __ATOMIC_RELAXED);
}

/* The window from `first` on that the list has room for, one vertex at least;
 * a vertex with more makes the list grow. */
static bool open_window(struct edges *e)
{
    uint64_t base = e->start[e->first];
    e->last = e->first + 1;
    uint64_t needed = e->start[e->last] - base;
    if (needed > e->room) {
        host_unmap(e->end, e->room * sizeof *e->end);
        e->end = host_map(needed * sizeof *e->end);
        e->room = e->end == NULL ? 0 : needed;
    }
    while (e->last < e->vertices && e->start[e->last + 1] - base <= e->room) {
        e->last++;
    }
    return e->end != NULL;
}

int host_edges_count(const struct host_tetrahedra *tets, uint32_t vertices,
                     uint64_t *edges, struct host_error *error)
{
    size_t bytes = ((size_t)vertices + 1) * sizeof(uint64_t);
    struct edges e = {.tets = tets, .vertices = vertices};
    e.room = tets->count > WINDOW_MIN ? tets->count : WINDOW_MIN;
    e.start = host_map(bytes);
    e.end = host_map(e.room * sizeof *e.end);
    bool enough = e.start != NULL && e.end != NULL;
    if (enough) {
        count_ends(&e);
    }
    for (; enough && e.first < vertices; e.first = e.last) {
        enough = open_window(&e);
        if (enough) {
            list_ends(&e);
            e.next = e.first;
            host_fork_all(host_threads(), count_part, &e);
        }
    }
    host_unmap(e.start, bytes);
    host_unmap(e.end, e.room * sizeof *e.end);
    *edges = e.count;
    return enough ? 0 : host_fail_memory(error, "the edges");
}
