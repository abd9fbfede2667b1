/* The edges of a result: of each vertex, those to higher vertices first. */
#include <stdlib.h>
#include <string.h>

#include "call.h"
#include "host/base/memory.h"

enum {
    POLL_ROWS = 1 << 16,
    THREAD_POINTS = 20000, /* fewer a thread take longer than on one */
    SHORT = 96             /* ends that are sorted one by one */
};

struct edges {
    struct library_call call;
    uint64_t points;
    const struct incode_tetrahedra *t;
    struct incode_adjacency *out;

    uint64_t *first; /* [points + 1] of the ends of each vertex, the higher */
    uint32_t *end;   /* [6 * t->count]; of each vertex `up`, once they are */
    uint32_t *up;    /* [points] sorted, each once */
    unsigned parts;
    _Atomic unsigned phase; /* of PHASES that are done */
};

enum { PHASES = 5 };

static const uint8_t pair[6][2] = {{0, 1}, {0, 2}, {0, 3},
                                   {1, 2}, {1, 3}, {2, 3}};

static uint32_t lower(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

static uint32_t higher(uint32_t a, uint32_t b) {
    return a < b ? b : a;
}

/* Lists the higher ends of each vertex.  false: the result is damaged. */
static bool list_ends(struct edges *e) {
    const struct incode_tetrahedra *t = e->t;
    for (uint64_t n = 0; n < t->count; n++) {
        if (n % POLL_ROWS == 0 && host_call_cancelled())
            return true;
        const uint32_t *v = t->vertex[n];
        for (unsigned i = 0; i < 4; i++)
            if (v[i] >= e->points)
                return false;
        for (unsigned i = 0; i < 6; i++) {
            uint32_t a = v[pair[i][0]], b = v[pair[i][1]];
            if (a == b)
                return false;
            e->first[lower(a, b)]++;
        }
    }
    e->phase++;
    /* To the end of each, then down to its beginning. */
    for (uint64_t p = 1; p <= e->points; p++)
        e->first[p] += e->first[p - 1];
    for (uint64_t n = 0; n < t->count; n++) {
        if (n % POLL_ROWS == 0 && host_call_cancelled())
            return true;
        for (unsigned i = 0; i < 6; i++) {
            uint32_t a = t->vertex[n][pair[i][0]];
            uint32_t b = t->vertex[n][pair[i][1]];
            e->end[--e->first[lower(a, b)]] = higher(a, b);
        }
    }
    e->phase++;
    return true;
}

static int compare(const void *p, const void *q) {
    const uint32_t *a = p, *b = q;
    return (*a > *b) - (*a < *b);
}

/* Sorts, each once; returns how many there are. */
static uint32_t sort_once(uint32_t *v, uint64_t count) {
    uint32_t n = 0;
    if (count > SHORT) {
        qsort(v, count, sizeof *v, compare);
        for (uint64_t i = 0; i < count; i++)
            if (n == 0 || v[n - 1] != v[i])
                v[n++] = v[i];
        return n;
    }
    for (uint64_t i = 0; i < count; i++) {
        uint32_t x = v[i], j = n;
        while (j > 0 && v[j - 1] > x)
            j--;
        if (j > 0 && v[j - 1] == x)
            continue;
        memmove(v + j + 1, v + j, (n - j) * sizeof *v);
        v[j] = x;
        n++;
    }
    return n;
}

static void sort_part(void *context, unsigned part) {
    struct edges *e = context;
    uint64_t p = e->points * part / e->parts;
    uint64_t last = e->points * (part + 1) / e->parts;
    for (; p < last && !host_call_cancelled(); p++)
        e->up[p] =
            sort_once(e->end + e->first[p], e->first[p + 1] - e->first[p]);
}

/* Both ways: vertices in ascending order give their numbers to higher ones,
 * which have got all of the lower ones when it is their turn. */
static bool join(struct edges *e) {
    struct incode_adjacency *out = e->out;
    out->points = e->points;
    out->first = host_map((e->points + 1) * sizeof *out->first);
    if (out->first == NULL)
        return false;
    for (uint64_t p = 0; p < e->points; p++) {
        out->first[p] += e->up[p];
        for (uint32_t i = 0; i < e->up[p]; i++)
            out->first[e->end[e->first[p] + i]]++;
    }
    uint64_t sum = 0;
    for (uint64_t p = 0; p <= e->points; p++) {
        uint64_t count = out->first[p];
        out->first[p] = sum;
        sum += count;
    }
    out->to = host_map(sum * sizeof *out->to);
    e->phase++;
    if (out->to == NULL)
        return false;
    for (uint64_t p = 0; p < e->points && !host_call_cancelled(); p++) {
        for (uint32_t i = 0; i < e->up[p]; i++) {
            uint32_t high = e->end[e->first[p] + i];
            out->to[out->first[p]++] = high;
            out->to[out->first[high]++] = (uint32_t)p;
        }
    }
    if (host_call_cancelled())
        return true; /* first[points] is still the length of `to` */
    memmove(out->first + 1, out->first, e->points * sizeof *out->first);
    out->first[0] = 0;
    return true;
}

static enum incode_status find_edges(struct library_call *call) {
    struct edges *e = (struct edges *)call;
    size_t first = (e->points + 1) * sizeof *e->first;
    size_t end = 6 * e->t->count * sizeof *e->end;
    size_t up = e->points * sizeof *e->up;
    enum incode_status status = INCODE_NO_MEMORY;
    e->first = host_map(first);
    e->end = host_map(end);
    e->up = host_map(up);
    e->parts = host_threads();
    if (e->first != NULL && e->end != NULL && e->up != NULL) {
        status = list_ends(e) ? INCODE_OK : INCODE_BAD_ARGUMENT;
        if (status == INCODE_OK && !host_call_cancelled())
            host_fork_all(e->parts, sort_part, e);
        e->phase++;
        if (status == INCODE_OK && !host_call_cancelled())
            status = join(e) ? INCODE_OK : INCODE_NO_MEMORY;
    }
    host_unmap(e->first, first);
    host_unmap(e->end, end);
    host_unmap(e->up, up);
    if (host_call_cancelled())
        status = INCODE_CANCELLED;
    if (status != INCODE_OK)
        incode_adjacency_free(e->out);
    return status;
}

static double done(struct library_call *call) {
    return ((struct edges *)call)->phase / (double)PHASES;
}

static void drop(struct library_call *call) {
    incode_adjacency_free(((struct edges *)call)->out);
}

enum incode_status incode_adjacency(uint64_t points,
                                    const struct incode_tetrahedra *t,
                                    const struct incode_options *options,
                                    struct incode_adjacency *out) {
    if (out == NULL)
        return INCODE_BAD_ARGUMENT;
    *out = (struct incode_adjacency){0};
    if (t == NULL || (t->vertex == NULL && t->count > 0) ||
        points >= UINT32_MAX || !library_options(&options, 0))
        return INCODE_BAD_ARGUMENT;
    struct edges e = {.call = {.work = find_edges, .done = done, .drop = drop},
                      .points = points,
                      .t = t,
                      .out = out};
    return library_call(&e.call, options, 1 + points / THREAD_POINTS);
}

void incode_adjacency_free(struct incode_adjacency *a) {
    if (a == NULL)
        return;
    if (a->to != NULL)
        host_unmap(a->to, a->first[a->points] * sizeof *a->to);
    host_unmap(a->first, (a->points + 1) * sizeof *a->first);
    *a = (struct incode_adjacency){0};
}
