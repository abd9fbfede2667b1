#include "kd_build.h"

#include <math.h>
#include <string.h>

#include "host/base/memory.h"
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

/* --- Parts of what is put aside ------------------------------------------- */

enum { BLOCK_ITEMS = 512, SAMPLE_ITEMS = 1 << 12 };

/* Below the wall, or not: what is equal to it is above. */
struct wall {
    struct host_item item;
    int order[3];
};

struct parts {
    const struct host_item *items;
    struct host_item *to;
    size_t n, room; /* items that a thread has in memory */
    unsigned parts, threads;
    struct wall wall[HOST_KD_PARTS_MAX]; /* a heap, from 1 on */
    size_t (*count)[HOST_KD_PARTS_MAX];  /* [threads] then where they go */
    struct host_item *memory[HOST_THREADS_MAX];
    struct host_kd_part *part;
};

static unsigned part_of(const struct parts *p, const struct host_item *item) {
    unsigned k = 1;
    while (k < p->parts)
        k = 2 * k + !less(item, &p->wall[k].item, p->wall[k].order, 1);
    return k - p->parts;
}

/* Walls between so many samples, from number k of the heap on down. */
static void set_walls(struct parts *p, unsigned k, struct host_item *sample,
                      size_t n, const double lo[3], const double hi[3]) {
    if (k >= p->parts) {
        memcpy(p->part[k - p->parts].lo, lo, sizeof p->part->lo);
        memcpy(p->part[k - p->parts].hi, hi, sizeof p->part->hi);
        return;
    }
    double box[2][3], below[3], above[3];
    host_kd_box(sample, n, box[0], box[1]);
    int d = host_kd_longest(box[0], box[1]);
    struct wall *w = &p->wall[k];
    *w = (struct wall){.order = {d, d == 0 ? 1 : 0, d == 2 ? 1 : 2}};
    host_kd_rank(sample, n, n / 2, d, 0);
    w->item = sample[n / 2];
    for (size_t i = n / 2; i < n; i++)
        if (less(&sample[i], &w->item, w->order, 1))
            w->item = sample[i];
    memcpy(below, hi, sizeof below);
    memcpy(above, lo, sizeof above);
    below[d] = above[d] = w->item.c[d];
    set_walls(p, 2 * k, sample, n / 2, lo, below);
    set_walls(p, 2 * k + 1, sample + n / 2, n - n / 2, above, hi);
}

static size_t items_first(const struct parts *p, unsigned thread) {
    return thread == p->threads ? p->n : p->n / p->threads * thread;
}

static size_t fetch_items(const struct parts *p, struct host_item *to, size_t i,
                          size_t last) {
    size_t n = last - i > BLOCK_ITEMS ? BLOCK_ITEMS : last - i;
    host_fetch(to, p->items + i, n * sizeof *to);
    return n;
}

static void count_items(void *context, unsigned thread) {
    struct parts *p = context;
    struct host_item block[BLOCK_ITEMS];
    size_t i = items_first(p, thread), last = items_first(p, thread + 1);
    for (size_t n = 0; i < last && !host_call_cancelled(); i += n) {
        n = fetch_items(p, block, i, last);
        for (size_t k = 0; k < n; k++)
            p->count[thread][part_of(p, &block[k])]++;
    }
}

/* In their order: the items of a thread before those of the next. */
static void place_items(struct parts *p) {
    size_t at = 0;
    for (unsigned k = 0; k < p->parts; k++) {
        size_t before = at;
        for (unsigned t = 0; t < p->threads; t++) {
            size_t count = p->count[t][k];
            p->count[t][k] = at;
            at += count;
        }
        p->part[k].n = at - before;
    }
}

static void send_items(struct parts *p, unsigned thread, unsigned k,
                       const struct host_item *from, size_t n) {
    host_store(p->to + p->count[thread][k], from, n * sizeof *from);
    p->count[thread][k] += n;
}

static void spread_items(void *context, unsigned thread) {
    struct parts *p = context;
    struct host_item block[BLOCK_ITEMS], *bucket = p->memory[thread];
    size_t room = p->room / p->parts, used[HOST_KD_PARTS_MAX] = {0};
    size_t i = items_first(p, thread), last = items_first(p, thread + 1);
    for (size_t n = 0; i < last && !host_call_cancelled(); i += n) {
        n = fetch_items(p, block, i, last);
        for (size_t m = 0; m < n; m++) {
            unsigned k = part_of(p, &block[m]);
            bucket[k * room + used[k]++] = block[m];
            if (used[k] == room) {
                send_items(p, thread, k, bucket + k * room, room);
                used[k] = 0;
            }
        }
    }
    for (unsigned k = 0; k < p->parts && !host_call_cancelled(); k++)
        send_items(p, thread, k, bucket + k * room, used[k]);
}

static bool spread(struct parts *p, const double lo[3], const double hi[3]) {
    size_t samples = (size_t)p->parts * SAMPLE_ITEMS;
    samples = samples < p->room ? samples : p->room;
    for (unsigned t = 0; t < p->threads; t++) {
        p->memory[t] = host_map_resident(p->room * sizeof *p->to);
        if (p->memory[t] == NULL)
            return false;
    }
    uint64_t state = p->n;
    for (size_t i = 0; i < samples; i++) {
        size_t stretch = p->n / samples;
        state = state * 6364136223846793005u + 1442695040888963407u;
        host_fetch(p->memory[0] + i,
                   p->items + i * stretch + (size_t)(state >> 33) % stretch,
                   sizeof *p->items);
    }
    set_walls(p, 1, p->memory[0], samples, lo, hi);
    p->to = host_map(p->n * sizeof *p->to);
    if (p->to == NULL)
        return false;
    host_fork_all(p->threads, count_items, p);
    place_items(p);
    host_fork_all(p->threads, spread_items, p);
    return true;
}

bool host_kd_spread(struct host_item **items, size_t n, unsigned parts,
                    const double lo[3], const double hi[3],
                    struct host_kd_part part[HOST_KD_PARTS_MAX]) {
    struct parts p = {.items = *items,
                      .n = n,
                      .parts = parts,
                      .threads = host_threads(),
                      .room = host_call_share() / sizeof *p.to,
                      .part = part};
    size_t counts = p.threads * sizeof *p.count;
    if (n < p.room)
        return false;
    p.count = host_map_resident(counts);
    bool done = p.count != NULL && spread(&p, lo, hi);
    for (unsigned t = 0; t < p.threads; t++)
        host_unmap(p.memory[t], p.room * sizeof *p.to);
    host_unmap(p.count, counts);
    if (done) {
        host_unmap(*items, n * sizeof **items);
        *items = p.to;
    }
    return done;
}
