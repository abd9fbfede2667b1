/* Each tetrahedron by itself, and the sums of facets at vertices.
 *
 * Each vertex has a mark, a word made of its number and a random key.  The hash
 * of a facet is made of its three vertices' marks.  It is positive if the
 * facet, seen from outside its tetrahedron, has its vertices in an even order,
 * else negative.  So the two sides of a facet cancel, and at a vertex inside a
 * triangulation the sum is 0.  Sums are taken modulo 2^63.
 *
 * A wrong result is missed only if a facet that does not cancel has a vertex
 * whose sum is 0 all the same.  Without the key, hashes are as good as random
 * words.  A sum of such words with factors below 2^k, not all 0, is 0 once in
 * 2^(63 - k).  The factors count the tetrahedra at one facet, which are few; so
 * for three vertices that is less than once in 2^60. */
#include <stdbool.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "parts.h"

enum { BLOCK = 64 }; /* tetrahedra at a time: a word of `bad` */

/* A well-mixed word (the finaliser of Steele, Lea and Flood's SplitMix64). */
static uint64_t mix(uint64_t x)
{
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

/* --- Marks ------------------------------------------------------------ */

static void make_marks(void *context, unsigned part)
{
    (void)part;
    struct check *c = context;
    uint64_t count = c->sites->count, i, distinct = 0;
    while ((i = check_take(c, CHECK_VERTICES, count)) < count) {
        uint64_t end = check_end(i, CHECK_VERTICES, count);
        for (; i < end; i++) {
            if (host_site_is_vertex(c->sites, (uint32_t)i)) {
                c->mark[i] = mix(mix(c->key[0] + i) ^ c->key[1]) | 1;
                distinct++;
            }
        }
    }
    (void)__atomic_fetch_add(&c->report->distinct, distinct, __ATOMIC_RELAXED);
}

/* --- A block of tetrahedra -------------------------------------------- */

struct block {
    const struct check *c;
    uint64_t first;
    uint32_t n;
    const uint32_t (*v)[4];
    uint32_t kept[BLOCK][4]; /* vertex 0 instead of numbers out of range */
    uint64_t bad;            /* a bit each */
    double p[4][3][BLOCK];
    int64_t mark[4][BLOCK], sum[4][BLOCK], sure[BLOCK];
    struct incode_tally tally;
};

static void leave_out(struct block *b, uint32_t i, const char *what)
{
    uint64_t tet = b->first + i;
    check_fault((struct check *)b->c, "tetrahedron", what, &tet, 1,
                b->c->tets->v[tet], 4);
    b->bad |= UINT64_C(1) << i;
}

/* Numbers out of range must not be looked up. */
static void check_range(struct block *b)
{
    uint64_t count = b->c->sites->count;
    uint32_t last = (uint32_t)(count - 1), over = count == 0;
    for (uint32_t i = 0; i < b->n; i++) {
        for (int k = 0; k < 4; k++) {
            over |= b->v[i][k] > last;
        }
    }
    if (over == 0) {
        return;
    }
    memcpy(b->kept, b->v, b->n * sizeof *b->v);
    b->v = (const uint32_t(*)[4])b->kept;
    for (uint32_t i = 0; i < b->n; i++) {
        uint32_t *t = b->kept[i];
        if (count == 0 || t[0] > last || t[1] > last || t[2] > last ||
            t[3] > last) {
            leave_out(b, i, "has a vertex that is no row of the points");
            memset(t, 0, sizeof b->kept[i]);
        }
    }
}

static void gather_marks(struct block *b)
{
    const uint64_t *mark = b->c->mark;
    int64_t none = 0;
    for (uint32_t i = 0; i < b->n; i++) {
        for (int k = 0; k < 4; k++) {
            b->mark[k][i] = (int64_t)mark[b->v[i][k]];
        }
    }
    for (int k = 0; k < 4; k++) {
        for (uint32_t i = 0; i < b->n; i++) {
            none |= b->mark[k][i] == 0;
        }
    }
    for (uint32_t i = 0; i < b->n && none != 0; i++) {
        if ((b->bad >> i & 1) == 0 &&
            (b->mark[0][i] == 0 || b->mark[1][i] == 0 || b->mark[2][i] == 0 ||
             b->mark[3][i] == 0)) {
            leave_out(b, i,
                      b->c->sites->order == NULL
                          ? "uses a row that repeats an earlier one"
                          : "has a vertex that is no point");
        }
    }
}

static void gather_points(struct block *b)
{
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

static inline double magnitude(double a)
{
    return a < 0 ? -a : a;
}

static inline double larger(double a, double b)
{
    return a > b ? a : b;
}

/* sure[i]: not 0 where tetrahedron i is positive by the static filter of
 * incode_orient3d. */
static void filter_orientation(struct block *b)
{
    for (uint32_t i = 0; i < BLOCK; i++) {
        double d[3][3], m[3];
        for (int k = 0; k < 3; k++) {
            for (int j = 0; j < 3; j++) {
                d[j][k] = b->p[j + 1][k][i] - b->p[0][k][i];
            }
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

static void check_orientation(struct block *b)
{
    int64_t sure = 1;
    gather_points(b);
    filter_orientation(b);
    for (uint32_t i = 0; i < b->n; i++) {
        sure &= b->sure[i];
    }
    for (uint32_t i = 0; i < b->n && sure == 0; i++) {
        if (b->sure[i] != 0 || (b->bad >> i & 1) != 0) {
            continue;
        }
        double p[4][3];
        for (int k = 0; k < 4; k++) {
            host_site(b->c->sites, b->v[i][k], p[k]);
        }
        int s = incode_orient3d(&b->tally, p[0], p[1], p[2], p[3]);
        if (s <= 0) {
            leave_out(b, i,
                      s == 0 ? "has no volume" : "is of negative orientation");
        }
    }
}

static inline int64_t facet_hash(int64_t a, int64_t b, int64_t c)
{
    uint64_t x = (uint64_t)a + (uint64_t)b + (uint64_t)c;
    x = (x ^ x >> 32) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 29) * UINT64_C(0x94d049bb133111eb);
    return (int64_t)x;
}

/* odd: 0, or -1 to change the sign. */
static inline int64_t signed_hash(int64_t hash, int64_t odd)
{
    return (int64_t)((uint64_t)(hash ^ odd) - (uint64_t)odd);
}

/* What the facets at each vertex add to its sum: of the four facets (1 2 3),
 * (0 3 2), (0 1 3), (0 2 1), all but the one opposite. */
static void sum_facets(struct block *b)
{
    for (uint32_t i = 0; i < BLOCK; i++) {
        int64_t v0 = b->mark[0][i], v1 = b->mark[1][i], v2 = b->mark[2][i],
                v3 = b->mark[3][i];
        int64_t below01 = -(int64_t)(v0 < v1), below02 = -(int64_t)(v0 < v2),
                below03 = -(int64_t)(v0 < v3), below12 = -(int64_t)(v1 < v2),
                below13 = -(int64_t)(v1 < v3), below23 = -(int64_t)(v2 < v3);
        uint64_t f[4], all;
        f[0] = (uint64_t)signed_hash(facet_hash(v1, v2, v3),
                                     below12 ^ below23 ^ below13);
        f[1] = (uint64_t)signed_hash(facet_hash(v0, v2, v3),
                                     ~(below02 ^ below23 ^ below03));
        f[2] = (uint64_t)signed_hash(facet_hash(v0, v1, v3),
                                     below01 ^ below13 ^ below03);
        f[3] = (uint64_t)signed_hash(facet_hash(v0, v1, v2),
                                     ~(below01 ^ below12 ^ below02));
        all = f[0] + f[1] + f[2] + f[3];
        for (int k = 0; k < 4; k++) {
            b->sum[k][i] = (int64_t)((all - f[k]) << 1);
        }
    }
}

static void add_sums(const struct block *b, uint64_t *sum)
{
    for (uint32_t i = 0; i < b->n; i++) {
        if ((b->bad >> i & 1) == 0) {
            for (int k = 0; k < 4; k++) {
                uint64_t *s = &sum[b->v[i][k]];
                *s = (*s + (uint64_t)b->sum[k][i]) | 1;
            }
        }
    }
}

static void sum_part(void *context, unsigned number)
{
    struct check *c = context;
    const struct check_part *part = &c->part[number];
    struct block b = {.c = c};
    for (uint64_t i = part->first; i < part->last; i += BLOCK) {
        b.first = i;
        b.n = (uint32_t)(check_end(i, BLOCK, part->last) - i);
        b.v = (const uint32_t(*)[4])c->tets->v + i;
        b.bad = 0;
        check_range(&b);
        gather_marks(&b);
        check_orientation(&b);
        sum_facets(&b);
        add_sums(&b, part->sum);
        if (b.bad != 0) {
            c->bad[i / BLOCK] = b.bad;
            __atomic_store_n(&c->any_bad, true, __ATOMIC_RELAXED);
        }
    }
}

/* --- Hot vertices, and their tetrahedra ------------------------------- */

static void find_hot(void *context, unsigned number)
{
    (void)number;
    struct check *c = context;
    uint64_t count = c->sites->count, i;
    while ((i = check_take(c, CHECK_VERTICES, count)) < count) {
        uint64_t end = check_end(i, CHECK_VERTICES, count);
        for (; i < end; i++) {
            uint64_t sum = 0, used = 0;
            for (unsigned k = 0; k < c->parts; k++) {
                sum += c->part[k].sum[i] & ~UINT64_C(1);
                used |= c->part[k].sum[i];
            }
            c->hot[i] = sum != 0;
            if ((used & 1) == 0 && c->mark[i] != 0) {
                uint32_t v = (uint32_t)i;
                check_fault(c, "point", "is a vertex of no tetrahedron", NULL,
                            0, &v, 1);
                __atomic_store_n(&c->any_unused, true, __ATOMIC_RELAXED);
            }
        }
    }
}

static void list_part(void *context, unsigned number)
{
    struct check *c = context;
    struct check_part *part = &c->part[number];
    const uint8_t *hot = c->hot;
    for (uint64_t i = part->first; i < part->last; i++) {
        const uint32_t *t = c->tets->v[i];
        if (check_is_bad(c, i) || (hot[t[0]] | hot[t[1]]) == 0) {
            continue; /* at most two are hot: most */
        }
        if (hot[t[0]] + hot[t[1]] + hot[t[2]] + hot[t[3]] >= 3) {
            part->list[part->listed++] = (uint32_t)(i - part->first);
        }
    }
}

/* --- All together ----------------------------------------------------- */

static bool make_room(struct check *c)
{
    size_t count = (size_t)c->sites->count;
    bool enough = true;
    c->mark = host_map(count * sizeof *c->mark);
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
    return enough && c->mark != NULL && c->hot != NULL && c->bad != NULL;
}

static void run(struct check *c, unsigned threads,
                void (*function)(void *, unsigned))
{
    c->next = 0;
    host_fork_all(threads, function, c);
}

int check_sums(struct check *c)
{
    size_t bytes = (size_t)c->sites->count * sizeof(uint64_t);
    if (make_room(c)) {
        run(c, host_threads(), make_marks);
        run(c, c->parts, sum_part);
        run(c, host_threads(), find_hot);
        if (c->depth == HOST_CHECK_TILING) {
            run(c, c->parts, list_part);
        }
    } else {
        host_fail_memory(c->error, "the check");
    }
    for (unsigned i = 0; i < c->parts; i++) {
        host_unmap(c->part[i].sum, bytes);
        c->part[i].sum = NULL;
    }
    host_unmap(c->mark, bytes);
    c->mark = NULL;
    return c->error->code;
}
