/* Each tetrahedron by itself, and the sums of facets at vertices.
 *
 * Each vertex v has a mark m(v), an odd word made of its number and a random
 * key.  A facet with the vertices a < b < c is summed at a, by m(b) m(c) modulo
 * 2^63.  The sign is that of the permutation in which the facet has its
 * vertices, seen from outside its tetrahedron.  So the two sides of a facet
 * cancel, and where all facets have two sides each sum is 0.
 *
 * A wrong result is missed only if facets do not cancel and the sum at their
 * lowest vertex is 0 all the same.  Such a sum is a polynomial of two factors a
 * term.  Without the key, marks are as good as random odd words.  The factor
 * c of one mark, itself a sum of marks, ends in j zeros once in 2^j, and then
 * c m + d is 0 once in 2^(62 - j).  Together that is less than 62 in 2^62, and
 * 2^k times as much if one facet is there 2^k times: below 2^-50 for any number
 * of repeats that a run lets through. */
#include <stdbool.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "parts.h"

enum { TOUCHED = 1 << 16 }; /* bytes that a block may touch, far from others */
enum { NO_ORDER = 16 };     /* times as many where vertices lie in no order */
enum { BLOCK = 64 };        /* tetrahedra at a time: a word of `bad` */

/* The mark of a vertex: the finaliser of Steele, Lea and Flood's SplitMix64,
 * with a second key between its two steps. */
static inline uint64_t mark_of(uint32_t vertex, const uint64_t key[2]) {
    uint64_t x = key[0] + vertex;
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9) ^ key[1];
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return (x ^ x >> 31) | 1;
}

/* --- A block of tetrahedra ------------------------------------------------ */

struct block {
    const struct check *c;
    uint64_t first;
    uint32_t n;
    const uint32_t (*v)[4];
    uint32_t kept[BLOCK][4];   /* vertex 0 instead of numbers out of range */
    uint64_t bad;              /* a bit each */
    uint32_t sorted[4][BLOCK]; /* its vertices, lowest first */
    uint32_t odd[BLOCK];       /* 1: that is an odd permutation, else 0 */
    uint64_t sum[2][BLOCK];    /* at the lowest vertex, and at the second */
    double p[4][3][BLOCK];
    int64_t sure[BLOCK];
    struct incode_tally tally;
};

static void leave_out(struct block *b, uint32_t i, const char *what) {
    uint64_t tet = b->first + i;
    check_fault((struct check *)b->c, "tetrahedron", what, &tet, 1,
                b->c->tets->v[tet], 4);
    b->bad |= UINT64_C(1) << i;
}

/* What is wrong with a vertex number; NULL: it is a vertex. */
static const char *vertex_fault(const struct host_sites *sites, uint32_t v) {
    if (v >= sites->count)
        return "has a vertex that is no row of the points";
    return host_site_is_vertex(sites, v) ? NULL
           : sites->order == NULL ? "uses a row that repeats an earlier one"
                                  : "has a vertex that is no point";
}

/* Leaves out tetrahedra whose numbers must not be looked up. */
static void check_vertices(struct block *b) {
    memcpy(b->kept, b->v, b->n * sizeof *b->v);
    b->v = (const uint32_t(*)[4])b->kept;
    for (uint32_t i = 0; i < b->n; i++) {
        const char *what = NULL;
        for (int k = 0; k < 4 && what == NULL; k++)
            what = vertex_fault(b->c->sites, b->kept[i][k]);
        if (what != NULL) {
            leave_out(b, i, what);
            memset(b->kept[i], 0, sizeof b->kept[i]);
        }
    }
}

static inline void order_two(uint32_t *a, uint32_t *b, uint32_t *odd) {
    uint32_t low = *a < *b ? *a : *b, high = *a < *b ? *b : *a;
    *odd ^= *a > *b;
    *a = low;
    *b = high;
}

/* Sorts the vertices of each tetrahedron, and checks their numbers: those out
 * of range at once, other wrong ones once any is known to be there. */
static void sort_vertices(struct block *b) {
    uint32_t most = 0;
    for (uint32_t i = 0; i < b->n; i++)
        for (int k = 0; k < 4; k++)
            b->sorted[k][i] = b->v[i][k];
    for (uint32_t i = 0; i < BLOCK; i++) {
        uint32_t v0 = b->sorted[0][i], v1 = b->sorted[1][i];
        uint32_t v2 = b->sorted[2][i], v3 = b->sorted[3][i], odd = 0;
        order_two(&v0, &v1, &odd);
        order_two(&v2, &v3, &odd);
        order_two(&v0, &v2, &odd);
        order_two(&v1, &v3, &odd);
        order_two(&v1, &v2, &odd);
        b->sorted[0][i] = v0;
        b->sorted[1][i] = v1;
        b->sorted[2][i] = v2;
        b->sorted[3][i] = v3;
        b->odd[i] = odd;
        most = v3 > most ? v3 : most;
    }
    if (most >= b->c->sites->count || b->c->careful)
        check_vertices(b);
}

static void gather_points(struct block *b) {
    const struct host_sites *sites = b->c->sites;
    for (uint32_t i = 0; i < b->n; i++) {
        for (int k = 0; k < 4; k++) {
            double xyz[3];
            host_site(sites, b->v[i][k], xyz);
            b->p[k][0][i] = xyz[0];
            b->p[k][1][i] = xyz[1];
            b->p[k][2][i] = xyz[2];
        }
    }
}

static inline double magnitude(double a) {
    return a < 0 ? -a : a;
}

static inline double larger(double a, double b) {
    return a > b ? a : b;
}

/* sure[i]: not 0 where tetrahedron i is positive by the static filter of
 * incode_orient3d. */
static void filter_orientation(struct block *b) {
    for (uint32_t i = 0; i < BLOCK; i++) {
        double d[3][3], m[3];
        for (int k = 0; k < 3; k++) {
            for (int j = 0; j < 3; j++)
                d[j][k] = b->p[j + 1][k][i] - b->p[0][k][i];
            m[k] = larger(magnitude(d[0][k]),
                          larger(magnitude(d[1][k]), magnitude(d[2][k])));
        }
        double det = (d[0][0] * d[1][1] - d[0][1] * d[1][0]) * d[2][2] +
                     (d[0][1] * d[1][2] - d[0][2] * d[1][1]) * d[2][0] +
                     (d[0][2] * d[1][0] - d[0][0] * d[1][2]) * d[2][1];
        double most = larger(m[0], larger(m[1], m[2]));
        double least = m[0] < m[1] ? m[0] : m[1];
        least = least < m[2] ? least : m[2];
        b->sure[i] = (least > INCODE_ORIENT3D_LEAST) &
                     (most < INCODE_ORIENT3D_MOST) &
                     (det > INCODE_ORIENT3D_BOUND * m[0] * m[1] * m[2]);
    }
}

static void check_orientation(struct block *b) {
    int64_t sure = 1;
    gather_points(b);
    filter_orientation(b);
    for (uint32_t i = 0; i < b->n; i++)
        sure &= b->sure[i];
    for (uint32_t i = 0; i < b->n && sure == 0; i++) {
        if (b->sure[i] != 0 || (b->bad >> i & 1) != 0)
            continue;
        double p[4][3];
        for (int k = 0; k < 4; k++)
            host_site(b->c->sites, b->v[i][k], p[k]);
        int s = incode_orient3d(&b->tally, p[0], p[1], p[2], p[3]);
        if (s <= 0) {
            leave_out(b, i,
                      s == 0 ? "has no volume" : "is of negative orientation");
        }
    }
}

/* x, or -x if odd is 1. */
static inline uint64_t with_sign(uint64_t x, uint32_t odd) {
    uint64_t all = (uint64_t)0 - odd;
    return (x ^ all) - all;
}

/* What the facets of a, b, c, d (sorted) add: -bc + bd - cd at a, and cd at b,
 * negated for an odd permutation. */
static void sum_facets(struct block *b) {
    const uint64_t *key = b->c->key;
    for (uint32_t i = 0; i < BLOCK; i++) {
        uint64_t m1 = mark_of(b->sorted[1][i], key);
        uint64_t m2 = mark_of(b->sorted[2][i], key);
        uint64_t m3 = mark_of(b->sorted[3][i], key);
        uint64_t last = m2 * m3;
        b->sum[0][i] = with_sign(m1 * (m3 - m2) - last, b->odd[i]) << 1;
        b->sum[1][i] = with_sign(last, b->odd[i]) << 1;
    }
}

/* Bit 0 of a sum: the vertex is used.  The other two vertices' bytes say so. */
static inline void
add_one(const struct block *b, uint32_t i, uint64_t *sum,
        uint8_t *used /* NOLINT(readability-non-const-parameter): atomic */) {
    uint64_t *low = &sum[b->sorted[0][i]], *second = &sum[b->sorted[1][i]];
    *low = (*low + b->sum[0][i]) | 1;
    *second = (*second + b->sum[1][i]) | 1;
    __atomic_store_n(&used[b->sorted[2][i]], 1, __ATOMIC_RELAXED);
    __atomic_store_n(&used[b->sorted[3][i]], 1, __ATOMIC_RELAXED);
}

/* A whole block in four places in turn: neighbours in the list often have the
 * same lowest vertex, and an addition waits for the one before. */
static void add_sums(const struct block *b, uint64_t *sum, uint8_t *used) {
    enum { TURNS = BLOCK / 4 };
    if (b->n == BLOCK && b->bad == 0) {
        for (uint32_t i = 0; i < TURNS; i++) {
            add_one(b, i, sum, used);
            add_one(b, i + TURNS, sum, used);
            add_one(b, i + 2 * TURNS, sum, used);
            add_one(b, i + 3 * TURNS, sum, used);
        }
        return;
    }
    for (uint32_t i = 0; i < b->n; i++)
        if ((b->bad >> i & 1) == 0)
            add_one(b, i, sum, used);
}

static void sum_part(void *context, unsigned number) {
    struct check *c = context;
    const struct check_part *part = &c->part[number];
    struct block b = {.c = c};
    for (uint64_t i = part->first; i < part->last; i += BLOCK) {
        b.first = i;
        b.n = (uint32_t)(check_end(i, BLOCK, part->last) - i);
        b.v = (const uint32_t(*)[4])c->tets->v + i;
#ifndef INCODE_PLANT_UNTRIMMED /* a fault for the simulation to find */
        host_call_trim(c->sites->order != NULL ? TOUCHED : NO_ORDER * TOUCHED);
#endif
        b.bad = 0;
        sort_vertices(&b);
        check_orientation(&b);
        sum_facets(&b);
        add_sums(&b, part->sum, c->used);
        if (b.bad != 0) {
            c->bad[i / BLOCK] = b.bad;
            __atomic_store_n(&c->any_bad, true, __ATOMIC_RELAXED);
        }
    }
}

/* --- Hot vertices, and their tetrahedra ----------------------------------- */

static void find_hot(void *context, unsigned number) {
    (void)number;
    struct check *c = context;
    uint64_t count = c->sites->count, i, distinct = 0;
    while ((i = check_take(c, CHECK_VERTICES, count)) < count) {
        uint64_t end = check_end(i, CHECK_VERTICES, count);
        host_call_trim(CHECK_VERTICES * c->parts * 2 * sizeof(uint64_t));
        for (; i < end; i++) {
            uint64_t sum = 0, used = c->used[i];
            uint32_t v = (uint32_t)i;
            bool is_vertex = host_site_is_vertex(c->sites, v);
            for (unsigned k = 0; k < c->parts; k++) {
                sum += c->part[k].sum[i] & ~UINT64_C(1);
                used |= c->part[k].sum[i];
            }
            c->hot[i] = sum != 0;
            distinct += is_vertex;
            if ((used & 1) != 0 && !is_vertex) {
                __atomic_store_n(&c->any_false, true, __ATOMIC_RELAXED);
            } else if ((used & 1) == 0 && is_vertex) {
                check_fault(c, "point", "is a vertex of no tetrahedron", NULL,
                            0, &v, 1);
                __atomic_store_n(&c->any_unused, true, __ATOMIC_RELAXED);
            }
        }
    }
    (void)__atomic_fetch_add(&c->report->distinct, distinct, __ATOMIC_RELAXED);
}

/* Out of line, so that the loop below stays short: a third of its time. */
static __attribute__((noinline)) bool is_candidate(const uint8_t *hot,
                                                   const uint32_t t[4]) {
    uint32_t low[2];
    check_lowest_two(t, low);
    return (hot[low[0]] | hot[low[1]]) != 0;
}

static void list_part(void *context, unsigned number) {
    struct check *c = context;
    struct check_part *part = &c->part[number];
    const uint8_t *hot = c->hot;
    uint64_t listed = 0;
    for (uint64_t i = part->first; i < part->last; i++) {
        const uint32_t *t = c->tets->v[i];
        if (i % BLOCK == 0)
            host_call_trim(BLOCK * 2 * sizeof *c->tets->v);
        if (check_is_bad(c, i) ||
            (hot[t[0]] | hot[t[1]] | hot[t[2]] | hot[t[3]]) == 0)
            continue; /* most */
        if (is_candidate(hot, t))
            part->list[listed++] = (uint32_t)(i - part->first);
    }
    part->listed = listed;
}

/* --- All together --------------------------------------------------------- */

static bool make_room(struct check *c) {
    size_t count = (size_t)c->sites->count;
    bool enough = true;
    c->used = host_map(count);
    c->hot = host_map(count);
    c->bad = host_map(((size_t)c->tets->count / 64 + 1) * sizeof *c->bad);
    for (unsigned i = 0; i < c->parts; i++) {
        struct check_part *part = &c->part[i];
        part->sum = host_map(count * sizeof *part->sum);
        enough = enough && part->sum != NULL;
        if (c->depth == HOST_CHECK_TILING) {
            part->list = host_map((size_t)(part->last - part->first) *
                                  sizeof *part->list);
            enough = enough && part->list != NULL;
        }
    }
    return enough && c->used != NULL && c->hot != NULL && c->bad != NULL;
}

static void run(struct check *c, unsigned threads,
                void (*function)(void *, unsigned)) {
    c->next = 0;
    host_fork_all(threads, function, c);
}

static void sum_all(struct check *c) {
    run(c, c->parts, sum_part);
    run(c, host_threads(), find_hot);
}

static void clear(void *array, size_t bytes) {
    for (size_t at = 0; at < bytes; at += TOUCHED) {
        host_call_trim(TOUCHED);
        memset((char *)array + at, 0,
               bytes - at < TOUCHED ? bytes - at : TOUCHED);
    }
}

/* Once more, with a look at each vertex. */
static void sum_carefully(struct check *c) {
    size_t count = (size_t)c->sites->count;
    for (unsigned i = 0; i < c->parts; i++)
        clear(c->part[i].sum, count * sizeof *c->part[i].sum);
    clear(c->used, count);
    clear(c->bad, ((size_t)c->tets->count / 64 + 1) * sizeof *c->bad);
    c->any_bad = c->any_unused = false;
    c->faults_kept = c->report->faults = c->report->distinct = 0;
    c->careful = true;
    sum_all(c);
}

int check_sums(struct check *c) {
    size_t count = (size_t)c->sites->count;
    if (make_room(c)) {
        sum_all(c);
        if (c->any_false)
            sum_carefully(c);
        if (c->depth == HOST_CHECK_TILING)
            run(c, c->parts, list_part);
    } else {
        host_fail_memory(c->error, "the check");
    }
    for (unsigned i = 0; i < c->parts; i++) {
        host_unmap(c->part[i].sum, count * sizeof *c->part[i].sum);
        c->part[i].sum = NULL;
    }
    host_unmap(c->used, count);
    c->used = NULL;
    return c->error->code;
}
