#include <stdatomic.h>
#include <stdbool.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "tetrahedra.h"

/* The canonical order: rows sorted in place by their ascending vertices, most
 * significant digit first (American flag sort: McIlroy, Bostic and McIlroy,
 * Computing Systems 6:5-27, 1993), small groups by insertion. */

enum {
    DIGIT_BITS = 10,
    BUCKETS = 1 << DIGIT_BITS,
    ASIDE_BITS = 4, /* where not all rows are in memory */
    INSERTION_MAX = 40,
    FORK_ROWS = 1 << 16,
    SAMPLE = 63,
    AHEAD = 8,           /* rows */
    POLL_ROWS = 1 << 12, /* between two polls of whether it is cancelled */
    AROUND = 1 << 16     /* bytes that one row far from others touches */
};

typedef uint32_t row_t[4];

static void canonical(row_t r) {
    /* Ascending, by comparisons whose outcome no branch has to foresee; where
     * they are an odd number of exchanges, one more at the end. */
    uint32_t a = r[0], b = r[1], c = r[2], d = r[3];
    uint32_t ab = a < b ? a : b, ba = a < b ? b : a;
    uint32_t cd = c < d ? c : d, dc = c < d ? d : c;
    uint32_t least = ab < cd ? ab : cd, low = ab < cd ? cd : ab;
    uint32_t most = ba < dc ? dc : ba, high = ba < dc ? ba : dc;
    uint32_t second = low < high ? low : high, third = low < high ? high : low;
    bool odd = (a > b) ^ (c > d) ^ (ab > cd) ^ (ba > dc) ^ (high > low);
    r[0] = least, r[1] = second;
    r[2] = odd ? most : third, r[3] = odd ? third : most;
}

/* Word w of the sorting key of a canonical row. */
static uint32_t word(const row_t r, int w) {
    switch (w) {
    case 2:
        return r[2] < r[3] ? r[2] : r[3];
    case 3:
        return r[2] < r[3] ? r[3] : r[2];
    default:
        return r[w];
    }
}

static bool less(const row_t p, const row_t q) {
    uint64_t a = (uint64_t)p[0] << 32 | p[1], b = (uint64_t)q[0] << 32 | q[1];
    if (a != b)
        return a < b;
    a = (uint64_t)word(p, 2) << 32 | word(p, 3);
    b = (uint64_t)word(q, 2) << 32 | word(q, 3);
    return a != b ? a < b : p[2] < q[2];
}

static void insertion_sort(row_t *v, size_t n) {
    for (size_t i = 1; i < n; i++) {
        row_t t;
        memcpy(t, v[i], sizeof t);
        size_t j = i;
        for (; j > 0 && less(t, v[j - 1]); j--)
            memcpy(v[j], v[j - 1], sizeof t);
        memcpy(v[j], t, sizeof t);
    }
}

/* The same of at most INSERTION_MAX rows with one first word: mostly the second
 * and the third tell them apart. */
static void sort_star(row_t *v, size_t n) {
    uint64_t key[INSERTION_MAX];
    for (size_t i = 0; i < n; i++) {
        row_t t;
        memcpy(t, v[i], sizeof t);
        uint64_t k = (uint64_t)t[1] << 32 | word(t, 2);
        size_t j = i;
        for (; j > 0 &&
               (k < key[j - 1] || (k == key[j - 1] && less(t, v[j - 1])));
             j--) {
            key[j] = key[j - 1];
            memcpy(v[j], v[j - 1], sizeof t);
        }
        key[j] = k;
        memcpy(v[j], t, sizeof t);
    }
}

/* Bits of a word: those from `shift` on, as many as `mask` has. */
struct digit {
    int word, shift;
    uint32_t mask;
};

/* The digit below, of `bits` bits or what is left of the word; false: none. */
static bool go_down(struct digit *d, int bits) {
    if (d->shift == 0) {
        d->word++;
        d->shift = 32;
        bits = 8;
    }
    bits = bits < d->shift ? bits : d->shift;
    d->shift -= bits;
    d->mask = (1u << bits) - 1;
    return d->word < 4;
}

/* Moves rows to where their digits belong; end[b]: of those with digit b.
 * Inlined, so that it is made for the first word, which nearly all are of. */
static inline __attribute__((always_inline)) void
exchange_by(row_t *v, size_t n, int w, struct digit d, size_t end[BUCKETS]) {
    size_t next[BUCKETS], sum = 0, buckets = (size_t)d.mask + 1;
    memset(end, 0, buckets * sizeof *end);
    for (size_t i = 0; i < n && !host_call_cancelled();) {
        size_t to = n - i > POLL_ROWS ? i + POLL_ROWS : n;
        host_call_trim((to - i) * sizeof *v);
        for (; i < to; i++)
            end[word(v[i], w) >> d.shift & d.mask]++;
    }
    if (host_call_cancelled()) /* counts that are not whole lead astray */
        return;
    for (size_t b = 0; b < buckets; b++) {
        next[b] = sum;
        sum += end[b];
        end[b] = sum;
    }
    size_t moved = 0;
    for (size_t b = 0; b < buckets && !host_call_cancelled(); b++) {
        while (next[b] < end[b]) {
            if (moved >= POLL_ROWS) {
                host_call_trim(moved * sizeof *v);
                moved = 0;
            }
            moved++;
            row_t t;
            memcpy(t, v[next[b]], sizeof t);
            size_t to = word(t, w) >> d.shift & d.mask;
            while (to != b) {
                row_t u;
                memcpy(u, v[next[to]], sizeof u);
                memcpy(v[next[to]++], t, sizeof t);
                moved++;
                /* So many streams are more than the processor foresees. */
                __builtin_prefetch(&v[next[to] + AHEAD], 1);
                memcpy(t, u, sizeof t);
                to = word(t, w) >> d.shift & d.mask;
            }
            memcpy(v[next[b]++], t, sizeof t);
        }
    }
}

static void exchange(row_t *v, size_t n, struct digit d, size_t end[BUCKETS]) {
    if (d.word == 0)
        exchange_by(v, n, 0, d, end);
    else
        exchange_by(v, n, d.word, d, end);
}

/* Bits for so many rows.  Every bucket has a place of its own where rows are
 * read and written. */
static int bits_for(size_t n, int bits) {
    return n > host_call_share() / sizeof(row_t) && bits > ASIDE_BITS
               ? ASIDE_BITS
               : bits;
}

/* Sorts by a digit and goes on below it.  Depth: at most 16, or where arrays
 * are put aside 32. */
static void flag_sort(row_t *v, size_t n, struct digit digit, int bits) {
    size_t end[BUCKETS], first = 0, buckets = (size_t)digit.mask + 1;
    exchange(v, n, digit, end);
    if (host_call_cancelled())
        return;
    for (size_t b = 0; b < buckets; first = end[b++]) {
        size_t m = end[b] - first;
        struct digit below = digit;
        if (!go_down(&below, bits_for(m, bits)))
            return;
        if (m > INSERTION_MAX)
            flag_sort(v + first, m, below, bits);
        else if (below.word > 0)
            sort_star(v + first, m);
        else
            insertion_sort(v + first, m);
    }
}

struct sort {
    row_t *v;
    size_t n;
    unsigned threads;
};

/* A first word with about half of the rows below it. */
static uint32_t middle(row_t *v, size_t n) {
    uint32_t key[SAMPLE] = {0};
    for (size_t i = 0; i < SAMPLE; i++) {
        uint32_t k = v[n / SAMPLE * i][0];
        host_call_trim(AROUND);
        size_t j = i;
        for (; j > 0 && k < key[j - 1]; j--)
            key[j] = key[j - 1];
        key[j] = k;
    }
    return key[SAMPLE / 2];
}

static void sort_rows(void *argument) {
    struct sort *s = argument;
    if (s->threads > 1 && s->n >= FORK_ROWS) {
        uint32_t pivot = middle(s->v, s->n);
        size_t below = 0;
        for (size_t i = 0; i < s->n && !host_call_cancelled();) {
            size_t end = s->n - i > POLL_ROWS ? i + POLL_ROWS : s->n;
            host_call_trim(2 * (end - i) * sizeof *s->v);
            for (; i < end; i++) {
                row_t t;
                memcpy(t, s->v[i], sizeof t);
                memcpy(s->v[i], s->v[below], sizeof t);
                memcpy(s->v[below], t, sizeof t);
                below += t[0] < pivot;
            }
        }
        if (host_call_cancelled())
            return;
        struct sort lower = {s->v, below, s->threads / 2};
        struct sort upper = {s->v + below, s->n - below,
                             s->threads - s->threads / 2};
        struct host_fork fork;
        host_fork_start(&fork, sort_rows, &lower);
        sort_rows(&upper);
        host_fork_join(&fork);
        return;
    }
    if (s->n <= INSERTION_MAX) {
        insertion_sort(s->v, s->n);
        return;
    }
    uint32_t top = 1;
    for (size_t i = 0; i < s->n;) {
        size_t end = s->n - i > POLL_ROWS ? i + POLL_ROWS : s->n;
        host_call_trim((end - i) * sizeof *s->v);
        for (; i < end; i++)
            top |= s->v[i][0] ^ s->v[0][0];
    }
    /* What first words differ in, in as few digits as there may be, of equal
     * size. */
    int used = 32 - __builtin_clz(top);
    int digits = (used + DIGIT_BITS - 1) / DIGIT_BITS;
    int bits = (used + digits - 1) / digits;
    struct digit digit = {0, used, 0};
    (void)go_down(&digit, bits_for(s->n, bits));
    flag_sort(s->v, s->n, digit, bits);
}

void host_tetrahedra_canonical(uint32_t (*v)[4], uint64_t n) {
    for (uint64_t i = 0; i < n; i++)
        canonical(v[i]);
}

void host_tetrahedra_pour(struct host_tetrahedra *tets, const uint32_t *map,
                          struct host_sink *sink) {
    enum { BLOCK = 1 << 12, TOUCHED = 40 /* bytes a row */ };
    for (uint64_t i = 0; i < tets->count && !host_call_cancelled();) {
        row_t *v = tets->v + i;
        uint64_t n = tets->count - i < BLOCK ? tets->count - i : BLOCK;
        for (uint64_t k = 0; k < 4 * n && map != NULL; k++)
            v[k / 4][k % 4] = map[v[k / 4][k % 4]];
        host_tetrahedra_canonical(v, n);
        host_call_trim((size_t)n * TOUCHED);
        (void)pthread_mutex_lock(&sink->lock);
        if (!host_call_cancelled())
            sink->put(sink->context, (const uint32_t(*)[4])v, n);
        (void)pthread_mutex_unlock(&sink->lock);
        i += n;
    }
    host_tetrahedra_cut(tets, 0);
}

struct canon {
    struct host_tetrahedra *tets;
    bool as_is;
    unsigned parts;
    bool disordered[HOST_THREADS_MAX];
};

static void canonical_part(void *context, unsigned part) {
    struct canon *c = context;
    uint64_t each = c->tets->count / c->parts, first = each * part;
    uint64_t last = part + 1 == c->parts ? c->tets->count : first + each;
    bool disordered = false;
    for (uint64_t i = first; i < last && !host_call_cancelled();) {
        uint64_t end = last - i > POLL_ROWS ? i + POLL_ROWS : last;
        host_call_trim((size_t)(end - i) * sizeof *c->tets->v);
        for (; i < end; i++) {
            if (!c->as_is)
                canonical(c->tets->v[i]);
            disordered = disordered ||
                         (i > first && less(c->tets->v[i], c->tets->v[i - 1]));
        }
    }
    c->disordered[part] = disordered;
}

/* --- of rows that are put aside ------------------------------------------- */

/* Two passes through files: rows go to buckets by their first words, and each
 * bucket is sorted in memory.  How many rows each bucket has, is counted
 * before. */

enum { BINS = 1 << 12, PARTS_MAX = 1 << 10, BLOCK_ROWS = 1 << 12 };

/* Rows by their first words >> shift, which grows as it has to. */
struct count {
    uint64_t rows[BINS];
    int shift;
    bool disordered;
    row_t first, last; /* of the thread's rows */
};

struct spread {
    struct host_tetrahedra *tets;
    bool as_is; /* rows of other things */
    row_t *to;
    unsigned threads;
    size_t room;         /* rows that a thread has in memory */
    struct count *count; /* [threads] */
    row_t *memory[HOST_THREADS_MAX];
    unsigned buckets;
    uint16_t bucket[BINS]; /* of count[0] */
    uint64_t first[PARTS_MAX + 1];
    _Atomic uint64_t next[PARTS_MAX];
    _Atomic unsigned taken;
};

static void halve(struct count *c) {
    for (size_t i = 0; i < BINS; i++)
        c->rows[i] =
            i < BINS / 2 ? c->rows[2 * i] + c->rows[2 * i + 1] : UINT64_C(0);
    c->shift++;
}

static uint64_t part_first(const struct spread *s, unsigned part) {
    return part == s->threads ? s->tets->count
                              : s->tets->count / s->threads * part;
}

/* The next rows of [i, last), of tetrahedra in their canonical form. */
static size_t fetch_rows(const struct spread *s, row_t *to, uint64_t i,
                         uint64_t last) {
    size_t n = last - i > BLOCK_ROWS ? BLOCK_ROWS : (size_t)(last - i);
    host_fetch(to, s->tets->v[i], n * sizeof *to);
    for (size_t k = 0; k < n && !s->as_is; k++)
        canonical(to[k]);
    return n;
}

static void count_part(void *context, unsigned part) {
    struct spread *s = context;
    struct count *c = &s->count[part];
    row_t *row = s->memory[part];
    uint64_t i = part_first(s, part), last = part_first(s, part + 1);
    for (size_t n = 0; i < last && !host_call_cancelled(); i += n) {
        n = fetch_rows(s, row, i, last);
        if (i == part_first(s, part))
            memcpy(c->first, row[0], sizeof row[0]);
        else
            c->disordered = c->disordered || less(row[0], c->last);
        for (size_t k = 0; k < n; k++) {
            c->disordered =
                c->disordered || (k > 0 && less(row[k], row[k - 1]));
            while (row[k][0] >> c->shift >= BINS)
                halve(c);
            c->rows[row[k][0] >> c->shift]++;
        }
        memcpy(c->last, row[n - 1], sizeof c->last);
    }
}

/* All counts in the first; whether rows are in disorder. */
static bool add_counts(struct spread *s) {
    bool disordered = false;
    int shift = 0;
    for (unsigned t = 0; t < s->threads; t++)
        shift = s->count[t].shift > shift ? s->count[t].shift : shift;
    for (unsigned t = 0; t < s->threads; t++) {
        disordered = disordered || s->count[t].disordered ||
                     (t > 0 && less(s->count[t].first, s->count[t - 1].last));
        while (s->count[t].shift < shift)
            halve(&s->count[t]);
        for (size_t i = 0; t > 0 && i < BINS; i++)
            s->count[0].rows[i] += s->count[t].rows[i];
    }
    return disordered;
}

/* As many rows in each as a thread has in memory, where there are not too many
 * then; what is more is sorted as it stands. */
static void make_buckets(struct spread *s) {
    uint64_t most = s->tets->count / (PARTS_MAX / 2);
    most = most > s->room ? most : s->room;
    uint64_t rows = 0;
    unsigned b = 0;
    for (size_t i = 0; i < BINS; i++) {
        if (rows + s->count[0].rows[i] > most && rows > 0) {
            s->first[b + 1] = s->first[b] + rows;
            rows = 0;
            b++;
        }
        s->bucket[i] = (uint16_t)b;
        rows += s->count[0].rows[i];
    }
    s->first[b + 1] = s->first[b] + rows;
    s->buckets = b + 1;
    for (unsigned k = 0; k < s->buckets; k++)
        s->next[k] = s->first[k];
}

static void send_rows(struct spread *s, unsigned b, const row_t *row,
                      size_t n) {
    uint64_t at = atomic_fetch_add(&s->next[b], n);
    host_store(s->to[at], row, n * sizeof *row);
}

static void spread_part(void *context, unsigned part) {
    struct spread *s = context;
    row_t *row = s->memory[part], *bucket = row + BLOCK_ROWS;
    size_t room = (s->room - BLOCK_ROWS) / s->buckets;
    size_t used[PARTS_MAX] = {0};
    uint64_t i = part_first(s, part), last = part_first(s, part + 1);
    for (size_t n = 0; i < last && !host_call_cancelled(); i += n) {
        n = fetch_rows(s, row, i, last);
        for (size_t k = 0; k < n; k++) {
            unsigned b = s->bucket[row[k][0] >> s->count[0].shift];
            memcpy(bucket[b * room + used[b]++], row[k], sizeof row[k]);
            if (used[b] == room) {
                send_rows(s, b, bucket + b * room, room);
                used[b] = 0;
            }
        }
    }
    for (unsigned b = 0; b < s->buckets && !host_call_cancelled(); b++)
        send_rows(s, b, bucket + b * room, used[b]);
}

static void sort_part(void *context, unsigned part) {
    struct spread *s = context;
    unsigned b;
    while ((b = atomic_fetch_add(&s->taken, 1)) < s->buckets &&
           !host_call_cancelled()) {
        size_t n = (size_t)(s->first[b + 1] - s->first[b]);
        row_t *at = s->to + s->first[b];
        struct sort in_memory = {s->memory[part], n, 1}, in_place = {at, n, 1};
        if (n > s->room) {
            sort_rows(&in_place);
            continue;
        }
        host_fetch(s->memory[part], at, n * sizeof *at);
        sort_rows(&in_memory);
        host_store(at, s->memory[part], n * sizeof *at);
    }
}

static bool sort_by(struct spread *s) {
    for (unsigned t = 0; t < s->threads; t++) {
        s->memory[t] = host_map_resident(s->room * sizeof(row_t));
        if (s->memory[t] == NULL)
            return false;
    }
    host_fork_all(s->threads, count_part, s);
    if (host_call_cancelled() || !add_counts(s))
        return false;
    make_buckets(s);
    s->to = host_map((size_t)s->tets->count * sizeof *s->to);
    if (s->to == NULL)
        return false;
    host_fork_all(s->threads, spread_part, s);
    host_tetrahedra_free(s->tets);
    *s->tets = (struct host_tetrahedra){s->to, s->first[s->buckets],
                                        s->first[s->buckets]};
    host_fork_all(s->threads, sort_part, s);
    return true;
}

/* False: they stand in their order, or there is no room; nothing has changed.
 */
static bool sort_aside(struct host_tetrahedra *tets, bool as_is) {
    unsigned threads = host_threads();
    size_t counts = threads * sizeof(struct count);
    struct spread *s = host_map_resident(sizeof *s);
    struct count *count = host_map_resident(counts);
    bool done = false;
    if (s != NULL && count != NULL) {
        s->tets = tets;
        s->as_is = as_is;
        s->threads = threads;
        s->count = count;
        s->room = host_call_share() / sizeof(row_t);
        done = s->room > 2 * BLOCK_ROWS + PARTS_MAX && sort_by(s);
        for (unsigned t = 0; t < threads; t++)
            host_unmap(s->memory[t], s->room * sizeof(row_t));
    }
    host_unmap(count, counts);
    host_unmap(s, sizeof *s);
    return done;
}

static void sort_all(struct host_tetrahedra *tets, bool as_is) {
    struct canon c = {tets, as_is, host_threads(), {false}};
    if (tets->count > host_call_share() / sizeof *tets->v &&
        sort_aside(tets, as_is))
        return;
    host_fork_all(c.parts, canonical_part, &c);
    bool disordered = false;
    uint64_t each = tets->count / c.parts;
    for (unsigned p = 0; p < c.parts; p++) {
        disordered = disordered || c.disordered[p] ||
                     (p > 0 && each > 0 &&
                      less(tets->v[each * p], tets->v[each * p - 1]));
    }
    if (disordered) {
        struct sort s = {tets->v, (size_t)tets->count, c.parts};
        sort_rows(&s);
    }
}

void host_tetrahedra_sort(struct host_tetrahedra *tets) {
    sort_all(tets, false);
}

void host_rows_sort(struct host_tetrahedra *rows) {
    sort_all(rows, true);
}
