#include "kd_build.h"

#include <math.h>
#include <string.h>

#include "host/base/parallel.h"
#include "incode/pages/pages.h"

enum {
    SAMPLE_MAX = 128,     /* items looked at to choose a pivot */
    SORT_MAX = 16,        /* fewer items than this are sorted by insertion */
    AROUND = 1 << 16,     /* bytes that one item far from others touches */
    FORK_ITEMS = 1 << 13, /* fewer items than this are not worth a thread */
    POLL_ITEMS = 1 << 11  /* between two polls of whether it is cancelled */
};

void host_kd_box(const struct host_item *items, size_t n, double lo[3],
                 double hi[3]) {
    double l0 = INFINITY, l1 = INFINITY, l2 = INFINITY;
    double h0 = -INFINITY, h1 = -INFINITY, h2 = -INFINITY;
    for (size_t i = 0; i < n;) {
        size_t end = n - i > POLL_ITEMS ? i + POLL_ITEMS : n;
        host_call_trim((end - i) * sizeof *items);
        for (; i < end; i++) {
            const double *c = items[i].c;
            l0 = c[0] < l0 ? c[0] : l0;
            l1 = c[1] < l1 ? c[1] : l1;
            l2 = c[2] < l2 ? c[2] : l2;
            h0 = c[0] > h0 ? c[0] : h0;
            h1 = c[1] > h1 ? c[1] : h1;
            h2 = c[2] > h2 ? c[2] : h2;
        }
    }
    lo[0] = l0, lo[1] = l1, lo[2] = l2;
    hi[0] = h0, hi[1] = h1, hi[2] = h2;
}

int host_kd_longest(const double lo[3], const double hi[3]) {
    int longest = 0;
    double best = -1;
    for (int d = 0; d < 3; d++) {
        /* Halves first: the difference of two finite numbers may overflow. */
        double extent = 0.5 * hi[d] - 0.5 * lo[d];
        if (extent > best) {
            best = extent;
            longest = d;
        }
    }
    return longest;
}

/* As a whole, in as few registers as hold it: what is stored in parts is not
 * there for the next load of it. */
static inline void exchange(struct host_item *p, struct host_item *q) {
    typedef uint64_t item
        __attribute__((vector_size(sizeof(struct host_item))));
    item a, b;
    memcpy(&a, p, sizeof a);
    memcpy(&b, q, sizeof b);
    memcpy(p, &b, sizeof b);
    memcpy(q, &a, sizeof a);
}

/* Both partitions move by an unconditional exchange, since the outcome of the
 * comparison is a coin toss that no branch predictor learns. */
static size_t partition_less(struct host_item *a, size_t n, int d, double sign,
                             double pivot) {
    size_t m = 0;
    for (size_t i = 0; i < n && !host_call_cancelled();) {
        size_t end = n - i > POLL_ITEMS ? i + POLL_ITEMS : n;
        host_call_trim(2 * (end - i) * sizeof *a);
        for (; i < end; i++) {
            double key = sign * a[i].c[d];
            exchange(&a[i], &a[m]);
            m += key < pivot;
        }
    }
    return m;
}

static size_t partition_not_greater(struct host_item *a, size_t n, int d,
                                    double sign, double pivot) {
    size_t m = 0;
    for (size_t i = 0; i < n;) {
        size_t end = n - i > POLL_ITEMS ? i + POLL_ITEMS : n;
        host_call_trim(2 * (end - i) * sizeof *a);
        for (; i < end; i++) {
            double key = sign * a[i].c[d];
            exchange(&a[i], &a[m]);
            m += key <= pivot;
        }
    }
    return m;
}

size_t host_kd_below(struct host_item *items, size_t n, int d, double wall) {
    return partition_less(items, n, d, 1, wall);
}

static int less(const struct host_item *a, const struct host_item *b,
                const int order[3], double sign) {
    for (int i = 0; i < 3; i++) {
        double p = sign * a->c[order[i]], q = sign * b->c[order[i]];
        if (p != q)
            return p < q;
    }
    return 0;
}

static void insertion_sort(struct host_item *a, size_t n, const int order[3],
                           double sign) {
    for (size_t i = 1; i < n; i++) {
        struct host_item t = a[i];
        size_t j = i;
        while (j > 0 && less(&t, &a[j - 1], order, sign)) {
            a[j] = a[j - 1];
            j--;
        }
        a[j] = t;
    }
}

static void sort_keys(double *key, size_t n) {
    for (size_t gap = n < 24    ? 1
                      : n < 120 ? 10
                                : 57;
         ; gap = gap > 23   ? 23
                 : gap > 10 ? 10
                 : gap > 4  ? 4
                            : 1) {
        for (size_t i = gap; i < n; i++) {
            double t = key[i];
            size_t j = i;
            for (; j >= gap && t < key[j - gap]; j -= gap)
                key[j] = key[j - gap];
            key[j] = t;
        }
        if (gap == 1)
            return;
    }
}

/* A key whose rank is near k, on the far side of it from the nearer end, so
 * that the larger part falls away at once: the median of the sample is taken
 * with a margin of its standard deviation. */
static double choose_pivot(const struct host_item *a, size_t n, size_t k, int d,
                           double sign, uint64_t *state) {
    double key[SAMPLE_MAX];
    size_t s = n / 64;
    s = s < 5 ? 5 : s > SAMPLE_MAX ? SAMPLE_MAX : s;
    for (size_t i = 0; i < s; i++) {
        *state = *state * 6364136223846793005u + 1442695040888963407u;
        size_t stretch = n / s;
        size_t at = i * stretch + (size_t)(*state >> 33) % stretch;
        key[i] = sign * a[at].c[d];
        host_call_trim(s == SAMPLE_MAX ? AROUND : 0);
    }
    sort_keys(key, s);
    size_t margin = s >= 64 ? s / 20 : s >= 16 ? 1 : 0;
    size_t rank = (size_t)((double)k / (double)n * (double)s);
    if (2 * k < n)
        rank += margin;
    else
        rank = rank > margin ? rank - margin : 0;
    return key[rank >= s ? s - 1 : rank];
}

void host_kd_rank(struct host_item *a, size_t n, size_t k, int d,
                  int from_above) {
    int order[3] = {d, d == 0 ? 1 : 0, d == 2 ? 1 : 2};
    double sign = from_above ? -1 : 1;
    uint64_t state = n;
    int level = 0; /* keys order[0..level) are equal in all that is left */
    while (k > 0 && k < n && level < 3 && !host_call_cancelled()) {
        if (n <= SORT_MAX) {
            insertion_sort(a, n, order, sign);
            return;
        }
        int e = order[level];
        double pivot = choose_pivot(a, n, k, e, sign, &state);
        size_t below = partition_less(a, n, e, sign, pivot);
        if (k <= below) {
            n = below;
            continue;
        }
        a += below, n -= below, k -= below;
        size_t equal = partition_not_greater(a, n, e, sign, pivot);
        if (k <= equal) {
            n = equal;
            level++;
        } else {
            a += equal, n -= equal, k -= equal;
        }
    }
}

/* Cuts n > 8 items into leaves of 8: the first part is a multiple of 8. */
static void build_leaves(struct host_item *a, size_t n) {
    while (n > INCODE_LEAF_POINTS) {
        double lo[3], hi[3];
        host_kd_box(a, n, lo, hi);
        size_t leaves = (n + INCODE_LEAF_POINTS - 1) / INCODE_LEAF_POINTS;
        size_t k = (leaves / 2) * INCODE_LEAF_POINTS;
        host_kd_rank(a, n, k, host_kd_longest(lo, hi), 0);
        build_leaves(a, k);
        a += k, n -= k;
    }
}

struct task {
    struct host_item *items;
    size_t n;
    uint32_t first_brick;
    unsigned threads;
    unsigned from_above; /* bit d: along d the upper part comes first */
    host_brick_sink *sink;
    void *context;
};

static void build(void *argument) {
    struct task *t = argument;
    if (host_call_cancelled())
        return;
    if (t->n <= INCODE_BRICK_POINTS) {
        build_leaves(t->items, t->n);
        t->sink(t->context, t->first_brick, t->items, t->n);
        return;
    }
    double lo[3], hi[3];
    host_kd_box(t->items, t->n, lo, hi);
    int d = host_kd_longest(lo, hi);
    size_t bricks = (t->n + INCODE_BRICK_POINTS - 1) / INCODE_BRICK_POINTS;
    uint32_t cut = incode_bricks_cut(t->first_brick, (uint32_t)bricks);
    size_t k = (size_t)cut * INCODE_BRICK_POINTS;
    host_kd_rank(t->items, t->n, k, d, (int)(t->from_above >> d & 1));
    struct task first = *t, second = *t;
    first.n = k;
    second.items += k;
    second.n -= k;
    second.first_brick += cut;
    /* As in a reflected Gray code the second part is walked backwards, mirrored
     * at the wall: where the first part ends the second begins. */
    second.from_above ^= 7u & ~(1u << d);
    if (t->threads > 1 && t->n >= FORK_ITEMS) {
        struct host_fork fork;
        first.threads = t->threads / 2;
        second.threads = t->threads - first.threads;
        host_fork_start(&fork, build, &first);
        build(&second);
        host_fork_join(&fork);
    } else {
        build(&first);
        build(&second);
    }
}

void host_kd_bricks(struct host_item *items, size_t n, uint32_t first_brick,
                    unsigned threads, host_brick_sink *sink, void *context) {
    struct task task = {items, n, first_brick, threads, 0, sink, context};
    if (n > 0)
        build(&task);
}
