/* Point location: queries are put in an order along which neighbours are close,
 * in blocks, and each thread walks along a stretch of it. */
#include <math.h>
#include <string.h>

#include "host/base/memory.h"
#include "walk.h"

enum {
    BLOCK = 1 << 20,       /* queries that are in order at a time */
    FEW = 32,              /* queries that need no memory of the call */
    THREAD_QUERIES = 2000, /* fewer a thread take longer than on one */
    LEAF = 8,              /* queries whose order does not matter */
    SAMPLE = 25,           /* odd; so many choose where a stretch is cut */
    SAMPLE_MOST = 255      /* where threads share what is cut */
};

struct locate {
    struct library_call call;
    struct library_mesh mesh;
    const double *query;
    uint64_t queries;
    uint64_t *found, *at;

    uint64_t begin, count;       /* the block */
    struct library_query *block; /* [count] */
    struct library_walker *walker;
    unsigned threads;
    _Atomic uint64_t infinite; /* the lowest query of these */
    _Atomic uint64_t answered; /* of all */
    _Atomic unsigned status;   /* the first that is not INCODE_OK */

    struct library_query few[FEW]; /* the block and walker of few queries */
    struct library_walker one;
};

/* --- order ---------------------------------------------------------------- */

static void swap(struct library_query *a, struct library_query *b) {
    struct library_query c = *a;
    *a = *b;
    *b = c;
}

static void sort(double *v, unsigned n) {
    for (unsigned i = 1; i < n; i++) {
        double x = v[i];
        unsigned j = i;
        for (; j > 0 && v[j - 1] > x; j--)
            v[j] = v[j - 1];
        v[j] = x;
    }
}

/* The median of a sample along its widest axis. */
static double cut_at(const struct library_query *q, uint64_t n, unsigned sample,
                     unsigned *axis) {
    double v[SAMPLE_MOST], lower[3], upper[3];
    for (unsigned k = 0; k < 3; k++)
        lower[k] = upper[k] = q[0].at[k];
    for (uint64_t i = 1; i < sample; i++) {
        for (unsigned k = 0; k < 3; k++) {
            double x = q[i * n / sample].at[k];
            lower[k] = x < lower[k] ? x : lower[k];
            upper[k] = x > upper[k] ? x : upper[k];
        }
    }
    *axis = 0;
    for (unsigned k = 1; k < 3; k++)
        if (upper[k] / 2 - lower[k] / 2 > upper[*axis] / 2 - lower[*axis] / 2)
            *axis = k;
    for (uint64_t i = 0; i < sample; i++)
        v[i] = q[i * n / sample].at[*axis];
    sort(v, sample);
    return v[sample / 2];
}

/* Brings those below the cut, or with `equal` at it, to the front (backwards:
 * to the end).  Returns how many stand in front. */
static uint64_t part(struct library_query *q, uint64_t n, unsigned axis,
                     double cut, bool equal, bool backwards) {
    uint64_t i = 0, j = n;
    for (;;) {
        while (i < j && (equal ? q[i].at[axis] <= cut : q[i].at[axis] < cut) !=
                            backwards)
            i++;
        while (i < j && (equal ? q[j - 1].at[axis] <= cut
                               : q[j - 1].at[axis] < cut) == backwards)
            j--;
        if (i >= j)
            return i;
        swap(&q[i++], &q[--j]);
    }
}

/* Cuts n queries in two; 0: all are equal along the axis. */
static uint64_t halve(struct library_query *q, uint64_t n, unsigned sample,
                      bool backwards) {
    unsigned axis;
    double cut = cut_at(q, n, sample, &axis);
    uint64_t first = part(q, n, axis, cut, false, backwards);
    if (first == 0 || first == n)
        first = part(q, n, axis, cut, true, backwards);
    return first == n ? 0 : first;
}

/* A k-d order, every second part backwards as in Gray's code: what follows
 * begins where what was before has ended.  depth: cuts, one beneath the other;
 * queries that are hard to cut may stay as they are. */
static void order(struct library_query *q, uint64_t n, bool backwards,
                  unsigned depth) {
    while (n > LEAF && depth > 0) {
        uint64_t first =
            halve(q, n, n < 4 * (uint64_t)SAMPLE ? 5 : SAMPLE, backwards);
        if (first == 0)
            return;
        depth--;
        order(q, first, false, depth);
        q += first;
        n -= first;
        backwards = true;
    }
}

/* --- threads -------------------------------------------------------------- */

static void fail(struct locate *l, enum incode_status status) {
    unsigned none = INCODE_OK;
    (void)atomic_compare_exchange_strong(&l->status, &none, (unsigned)status);
}

/* A stretch that so many threads share, from `thread` on. */
struct stretch {
    struct locate *locate;
    struct library_query *query;
    uint64_t count;
    unsigned thread, threads;
    bool backwards;
};

static void answer(void *argument) {
    struct stretch *s = argument;
    struct locate *l = s->locate;
    if (s->threads > 1 && s->count > SAMPLE_MOST) {
        uint64_t first = halve(s->query, s->count, SAMPLE_MOST, s->backwards);
        first = first == 0 ? s->count / 2 : first;
        struct stretch a = *s, b = *s;
        a.count = first;
        a.threads = s->threads / 2;
        a.backwards = false;
        b.query += first;
        b.count -= first;
        b.thread += a.threads;
        b.threads -= a.threads;
        b.backwards = true;
        struct host_fork fork;
        host_fork_start(&fork, answer, &a);
        answer(&b);
        host_fork_join(&fork);
        return;
    }
    order(s->query, s->count, s->backwards, 60);
    enum incode_status status = library_walk(&l->walker[s->thread], &l->mesh,
                                             s->query, s->count, l->found);
    if (status != INCODE_OK)
        fail(l, status);
    atomic_fetch_add(&l->answered, s->count);
}

/* Copies a part of the block. */
static void copy(void *context, unsigned number) {
    struct locate *l = context;
    uint64_t i = l->count * number / l->threads;
    uint64_t end = l->count * (number + 1) / l->threads;
    for (; i < end; i++) {
        struct library_query *q = &l->block[i];
        q->number = l->begin + i;
        memcpy(q->at, l->query + 3 * q->number, sizeof q->at);
        if (isfinite(q->at[0]) && isfinite(q->at[1]) && isfinite(q->at[2]))
            continue;
        uint64_t lowest = l->infinite;
        while (q->number < lowest && !atomic_compare_exchange_weak(
                                         &l->infinite, &lowest, q->number)) {
        }
        return;
    }
}

static enum incode_status answer_all(struct locate *l) {
    for (; l->begin < l->queries; l->begin += l->count) {
        uint64_t left = l->queries - l->begin;
        l->count = left < BLOCK ? left : BLOCK;
        host_fork_all(l->threads, copy, l);
        if (l->infinite != UINT64_MAX) {
            if (l->at != NULL)
                *l->at = l->infinite;
            return INCODE_NOT_FINITE;
        }
        answer(&(struct stretch){.locate = l,
                                 .query = l->block,
                                 .count = l->count,
                                 .threads = l->threads});
        if (host_call_cancelled())
            return INCODE_CANCELLED;
        if (l->status != INCODE_OK)
            return (enum incode_status)l->status;
    }
    return INCODE_OK;
}

/* --- the call ------------------------------------------------------------- */

static enum incode_status locate_few(struct locate *l) {
    l->block = l->few;
    l->walker = &l->one;
    l->threads = 1;
    library_walker_begin(&l->one, &l->mesh);
    enum incode_status status = answer_all(l);
    library_walker_end(&l->one);
    return status;
}

static enum incode_status locate(struct library_call *call) {
    struct locate *l = (struct locate *)call;
    if (l->queries <= FEW)
        return locate_few(l);
    size_t block = (l->queries < BLOCK ? l->queries : BLOCK) * sizeof *l->block;
    size_t walkers = (size_t)host_threads() * sizeof *l->walker;
    enum incode_status status = INCODE_NO_MEMORY;
    l->threads = host_threads();
    l->block = host_map(block);
    l->walker = host_map(walkers);
    if (l->block != NULL && l->walker != NULL) {
        for (unsigned i = 0; i < l->threads; i++)
            library_walker_begin(&l->walker[i], &l->mesh);
        status = answer_all(l);
        for (unsigned i = 0; i < l->threads; i++)
            library_walker_end(&l->walker[i]);
    }
    host_unmap(l->block, block);
    host_unmap(l->walker, walkers);
    return status;
}

static double done(struct library_call *call) {
    struct locate *l = (struct locate *)call;
    return l->queries == 0 ? 1 : (double)l->answered / (double)l->queries;
}

enum incode_status incode_locate(const double *xyz, uint64_t points,
                                 const struct incode_tetrahedra *t,
                                 const double *query, uint64_t queries,
                                 const struct incode_options *options,
                                 uint64_t *found, uint64_t *at) {
    if (t == NULL || xyz == NULL || t->vertex == NULL || t->neighbor == NULL ||
        t->count == 0 || t->count >= UINT32_MAX || points >= UINT32_MAX ||
        (queries > 0 && (query == NULL || found == NULL)) ||
        !library_options(&options, 0))
        return INCODE_BAD_ARGUMENT;
    struct locate l = {.call = {.work = locate, .done = done},
                       .mesh = {xyz, points, t},
                       .query = query,
                       .queries = queries,
                       .infinite = UINT64_MAX};
    l.found = found;
    l.at = at;
    return library_call(&l.call, options, 1 + queries / THREAD_QUERIES);
}
