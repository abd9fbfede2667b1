/* The canonical order: rows sorted in place by their ascending vertices, most
 * significant byte first (American flag sort: McIlroy, Bostic and McIlroy,
 * Computing Systems 6:5-27, 1993), small groups by insertion. */
#include <stdbool.h>
#include <string.h>

#include "host/base/parallel.h"
#include "tetrahedra.h"

enum {
    BUCKETS = 256,
    INSERTION_MAX = 40,
    FORK_ROWS = 1 << 16,
    SAMPLE = 63,
    AHEAD = 8 /* rows */
};

typedef uint32_t row_t[4];

static void canonical(row_t r)
{
    uint32_t a = r[0], b = r[1], c = r[2], d = r[3];
    /* Even permutations only: two exchanges, or a rotation of three. */
    if (b < a && b < c && b < d) {
        uint32_t t = a;
        a = b, b = t, t = c, c = d, d = t;
    } else if (c < a && c < d) {
        uint32_t t = a;
        a = c, c = t, t = b, b = d, d = t;
    } else if (d < a) {
        uint32_t t = a;
        a = d, d = t, t = b, b = c, c = t;
    }
    if (c < b && c < d) {
        uint32_t t = b;
        b = c, c = d, d = t;
    } else if (d < b) {
        uint32_t t = b;
        b = d, d = c, c = t;
    }
    r[0] = a, r[1] = b, r[2] = c, r[3] = d;
}

/* Word w of the sorting key of a canonical row. */
static uint32_t word(const row_t r, int w)
{
    switch (w) {
    case 2:
        return r[2] < r[3] ? r[2] : r[3];
    case 3:
        return r[2] < r[3] ? r[3] : r[2];
    default:
        return r[w];
    }
}

static bool less(const row_t p, const row_t q)
{
    uint64_t a = (uint64_t)p[0] << 32 | p[1], b = (uint64_t)q[0] << 32 | q[1];
    if (a != b) {
        return a < b;
    }
    a = (uint64_t)word(p, 2) << 32 | word(p, 3);
    b = (uint64_t)word(q, 2) << 32 | word(q, 3);
    return a != b ? a < b : p[2] < q[2];
}

static void insertion_sort(row_t *v, size_t n)
{
    for (size_t i = 1; i < n; i++) {
        row_t t;
        memcpy(t, v[i], sizeof t);
        size_t j = i;
        for (; j > 0 && less(t, v[j - 1]); j--) {
            memcpy(v[j], v[j - 1], sizeof t);
        }
        memcpy(v[j], t, sizeof t);
    }
}

/* Sorts by byte `shift` of word w and goes on below it.  Depth: at most 16. */
static void flag_sort(row_t *v, size_t n, int w, int shift)
{
    size_t end[BUCKETS] = {0}, next[BUCKETS];
    for (size_t i = 0; i < n; i++) {
        end[(word(v[i], w) >> shift) & (BUCKETS - 1)]++;
    }
    size_t sum = 0;
    for (size_t b = 0; b < BUCKETS; b++) {
        next[b] = sum;
        sum += end[b];
        end[b] = sum;
    }
    for (size_t b = 0; b < BUCKETS; b++) {
        while (next[b] < end[b]) {
            row_t t;
            memcpy(t, v[next[b]], sizeof t);
            size_t to = (word(t, w) >> shift) & (BUCKETS - 1);
            while (to != b) {
                row_t u;
                memcpy(u, v[next[to]], sizeof u);
                memcpy(v[next[to]++], t, sizeof t);
                /* 256 streams are more than the processor foresees. */
                __builtin_prefetch(&v[next[to] + AHEAD], 1);
                memcpy(t, u, sizeof t);
                to = (word(t, w) >> shift) & (BUCKETS - 1);
            }
            memcpy(v[next[b]++], t, sizeof t);
        }
    }
    if (shift == 0) {
        shift = 32;
        w++;
    }
    for (size_t b = 0, first = 0; b < BUCKETS; first = end[b++]) {
        size_t m = end[b] - first;
        if (m <= INSERTION_MAX || w > 3) {
            insertion_sort(v + first, w > 3 ? 0 : m);
        } else {
            flag_sort(v + first, m, w, shift - 8);
        }
    }
}

struct sort {
    row_t *v;
    size_t n;
    unsigned threads;
};

/* A first word with about half of the rows below it. */
static uint32_t middle(row_t *v, size_t n)
{
    uint32_t key[SAMPLE] = {0};
    for (size_t i = 0; i < SAMPLE; i++) {
        uint32_t k = v[n / SAMPLE * i][0];
        size_t j = i;
        for (; j > 0 && k < key[j - 1]; j--) {
            key[j] = key[j - 1];
        }
        key[j] = k;
    }
    return key[SAMPLE / 2];
}

static void sort_rows(void *argument)
{
    struct sort *s = argument;
    if (s->threads > 1 && s->n >= FORK_ROWS) {
        uint32_t pivot = middle(s->v, s->n);
        size_t below = 0;
        for (size_t i = 0; i < s->n; i++) {
            row_t t;
            memcpy(t, s->v[i], sizeof t);
            memcpy(s->v[i], s->v[below], sizeof t);
            memcpy(s->v[below], t, sizeof t);
            below += t[0] < pivot;
        }
        struct sort lower = {s->v, below, s->threads / 2};
        struct sort upper = {s->v + below, s->n - below,
                             s->threads - s->threads / 2};
        struct host_fork fork;
        host_fork_start(&fork, sort_rows, &lower);
        sort_rows(&upper);
        host_fork_join(&fork);
        return;
    }
    uint32_t top = 0;
    for (size_t i = 0; i < s->n; i++) {
        top |= s->v[i][0];
    }
    int shift = 24;
    while (shift > 0 && top >> shift == 0) {
        shift -= 8;
    }
    if (s->n <= INSERTION_MAX) {
        insertion_sort(s->v, s->n);
    } else {
        flag_sort(s->v, s->n, 0, shift);
    }
}

struct canon {
    struct host_tetrahedra *tets;
    unsigned parts;
    bool disordered[16];
};

static void canonical_part(void *context, unsigned part)
{
    struct canon *c = context;
    uint64_t each = c->tets->count / c->parts, first = each * part;
    uint64_t last = part + 1 == c->parts ? c->tets->count : first + each;
    bool disordered = false;
    for (uint64_t i = first; i < last; i++) {
        canonical(c->tets->v[i]);
        disordered =
            disordered || (i > first && less(c->tets->v[i], c->tets->v[i - 1]));
    }
    c->disordered[part] = disordered;
}

void host_tetrahedra_sort(struct host_tetrahedra *tets)
{
    struct canon c = {tets, host_threads(), {false}};
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
