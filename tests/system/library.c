/* A user of the library, for tests/system/library.sh:
 *
 *     library rows FILE.xyz THREADS OUT.npy   triangulates, checks neighbours,
 *                             hull and duplicates, and writes the rows
 *     library twice FILE.xyz  two calls at once, with 1 and 2 threads
 *     library cancel FILE.xyz cancels after one call of progress more and more
 *                             often; prints the longest wait in ms
 *     library failing FILE.xyz  each mapping and each thread fails in turn
 *     library locate FILE.xyz THREADS  finds each point in the lowest of its
 *                             tetrahedra, and as many edges as Euler says
 *     library arguments       wrong ones
 */
#include "host/library/incode.h"

#include <errno.h>
#include <fenv.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

#define demand(condition)                                                      \
    ((condition) ? (void)0                                                     \
                 : (fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, \
                            #condition),                                       \
                    exit(1)))

static double *xyz;
static uint64_t points;

static void read_points(const char *path) {
    FILE *f = fopen(path, "r");
    size_t room = 0;
    char line[512];
    demand(f != NULL);
    while (fgets(line, sizeof line, f) != NULL) {
        char *at = line, *end;
        double p[3];
        int d = 0;
        for (; d < 3; d++, at = end) {
            p[d] = strtod(at, &end);
            if (end == at)
                break;
        }
        if (d < 3)
            continue;
        if (points == room) {
            room = 2 * room + 1024;
            double *grown = realloc(xyz, room * 3 * sizeof *xyz);
            demand(grown != NULL);
            xyz = grown;
        }
        memcpy(xyz + 3 * points++, p, sizeof p);
    }
    demand(fclose(f) == 0);
}

/* --- mappings and threads that fail --------------------------------------- */

static _Atomic long calls, failing; /* of 1 on; 0: none */
static _Atomic long mapped;         /* bytes */

static long pages(size_t bytes) {
    return (long)((bytes + 4095) / 4096 * 4096);
}
static bool fails(void) {
    return ++calls == failing;
}
void *__real_mmap(void *, size_t, int, int, int, off_t);
void *__wrap_mmap(void *, size_t, int, int, int, off_t);
void *__wrap_mmap(void *at, size_t size, int protection, int flags, int file,
                  off_t offset) {
    if (fails()) {
        errno = ENOMEM;
        return MAP_FAILED;
    }
    void *p = __real_mmap(at, size, protection, flags, file, offset);
    mapped += p == MAP_FAILED ? 0 : pages(size);
    return p;
}
int __real_munmap(void *, size_t);
int __wrap_munmap(void *, size_t);
int __wrap_munmap(void *at, size_t size) {
    mapped -= pages(size);
    return __real_munmap(at, size);
}
void *__real_mremap(void *, size_t, size_t, int, void *);
void *__wrap_mremap(void *, size_t, size_t, int, void *);
void *__wrap_mremap(void *old, size_t from, size_t to, int flags, void *at) {
    if (fails()) {
        errno = ENOMEM;
        return MAP_FAILED;
    }
    /* What is mapped where it is to go is replaced. */
    bool replaces = (flags & MREMAP_FIXED) != 0 && msync(at, 1, MS_ASYNC) == 0;
    void *p = __real_mremap(old, from, to, flags, at);
    if (p != MAP_FAILED)
        mapped += pages(to) - (replaces ? pages(to) : 0) -
                  ((flags & MREMAP_DONTUNMAP) != 0 ? 0 : pages(from));
    return p;
}
int __real_pthread_create(pthread_t *, const pthread_attr_t *,
                          void *(*)(void *), void *);
int __wrap_pthread_create(pthread_t *, const pthread_attr_t *,
                          void *(*)(void *), void *);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument) {
    return fails() ? EAGAIN
                   : __real_pthread_create(thread, attributes, start, argument);
}

/* --- checks of a result --------------------------------------------------- */

static void check(const struct incode_tetrahedra *t) {
    uint64_t open = 0;
    for (uint64_t i = 0; i < t->count; i++) {
        const uint32_t *v = t->vertex[i];
        demand(v[0] < v[1] && v[1] < v[2] && v[1] < v[3] && v[2] != v[3]);
        for (int k = 0; k < 4; k++) {
            uint64_t n = t->neighbor[i][k];
            demand(v[k] < points);
            if (n == INCODE_NONE64) {
                open++;
                continue;
            }
            demand(n < t->count && n != i);
            int back = 0, common = 0;
            for (int j = 0; j < 4; j++) {
                back += t->neighbor[n][j] == i;
                for (int l = 0; l < 4; l++)
                    common += l != k && t->vertex[n][j] == v[l];
            }
            demand(back == 1 && common == 3);
        }
    }
    demand(open == t->hull_count && open >= 4 && open % 2 == 0);
    for (uint64_t i = 0; i < t->duplicate_count; i++) {
        const uint32_t *d = t->duplicate[i];
        demand(d[1] < d[0] && (i == 0 || t->duplicate[i - 1][0] < d[0]));
        for (size_t k = 0; k < 3; k++)
            demand(xyz[3 * (size_t)d[0] + k] == xyz[3 * (size_t)d[1] + k]);
    }
}

static bool count_calls(void *context, double done) {
    demand(done >= 0 && done <= 1);
    ++*(unsigned *)context;
    return true;
}

static void rows(unsigned threads, const char *out) {
    struct incode_tetrahedra t, plain;
    unsigned shown = 0;
    struct incode_options o = {.threads = threads,
                               .flags = INCODE_NEIGHBORS | INCODE_HULL,
                               .progress = count_calls,
                               .context = &shown};
    demand(fesetround(FE_UPWARD) == 0);
    enum incode_status status = incode_delaunay(xyz, points, &o, &t);
    demand(fegetround() == FE_UPWARD && fesetround(FE_TONEAREST) == 0);
    if (status != INCODE_OK) {
        fprintf(stderr, "%s\n", incode_status_text(status));
        exit(3);
    }
    demand(shown >= 1);
    check(&t);
    o = (struct incode_options){.threads = threads};
    demand(incode_delaunay(xyz, points, &o, &plain) == INCODE_OK);
    demand(plain.count == t.count && plain.neighbor == NULL &&
           plain.hull == NULL &&
           memcmp(plain.vertex, t.vertex, t.count * sizeof *t.vertex) == 0);
    incode_tetrahedra_free(&plain);
    char head[128];
    int n = snprintf(head, sizeof head,
                     "{'descr': '<u4', 'fortran_order': False, 'shape': "
                     "(%llu, 4), }",
                     (unsigned long long)t.count);
    memset(head + n, ' ', sizeof head - (size_t)n);
    head[117] = '\n';
    FILE *f = fopen(out, "wb");
    demand(f != NULL && fwrite("\x93NUMPY\x01\x00\x76\x00", 1, 10, f) == 10 &&
           fwrite(head, 1, 118, f) == 118 &&
           fwrite(t.vertex, sizeof *t.vertex, t.count, f) == t.count &&
           fclose(f) == 0);
    incode_tetrahedra_free(&t);
    incode_tetrahedra_free(&t);
}

static struct incode_tetrahedra result[2];
static void *one(void *argument) {
    unsigned k = *(unsigned *)argument;
    struct incode_options o = {.threads = k + 1};
    demand(incode_delaunay(xyz, points, &o, &result[k]) == INCODE_OK);
    return NULL;
}

static void twice(void) {
    pthread_t thread[2];
    unsigned k[2] = {0, 1};
    for (int i = 0; i < 2; i++)
        demand(pthread_create(&thread[i], NULL, one, &k[i]) == 0);
    for (int i = 0; i < 2; i++)
        demand(pthread_join(thread[i], NULL) == 0);
    demand(result[0].count == result[1].count &&
           memcmp(result[0].vertex, result[1].vertex,
                  result[0].count * sizeof *result[0].vertex) == 0);
    for (int i = 0; i < 2; i++)
        incode_tetrahedra_free(&result[i]);
}

static double now_ms(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t); /* clock: printed, judged by nobody */
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

struct watch {
    unsigned left;
    double cancelled_ms;
};
static bool cancel(void *context, double done) {
    struct watch *w = context;
    (void)done;
    if (w->left-- > 0)
        return true;
    w->cancelled_ms = now_ms();
    return false;
}

static void cancelling(void) {
    double longest = 0;
    for (unsigned calls_before = 0;; calls_before++) {
        struct incode_tetrahedra t;
        struct watch w = {calls_before, 0};
        struct incode_options o = {
            .flags = INCODE_NEIGHBORS, .progress = cancel, .context = &w};
        enum incode_status status = incode_delaunay(xyz, points, &o, &t);
        if (status == INCODE_OK) {
            incode_tetrahedra_free(&t);
            break;
        }
        demand(status == INCODE_CANCELLED && t.vertex == NULL && t.count == 0);
        demand(mapped == 0);
        longest = fmax(longest, now_ms() - w.cancelled_ms);
    }
    printf("%.0f\n", longest);
}

/* --- point location and edges --------------------------------------------- */

static void triangulate(struct incode_tetrahedra *t) {
    struct incode_options o = {.threads = 1,
                               .flags = INCODE_NEIGHBORS | INCODE_HULL};
    demand(incode_delaunay(xyz, points, &o, t) == INCODE_OK);
}

/* The points, and some outside. */
static double *make_queries(uint64_t *count) {
    *count = points + 6;
    double *query = malloc(3 * *count * sizeof *query);
    demand(query != NULL);
    memcpy(query, xyz, 3 * points * sizeof *query);
    memset(query + 3 * points, 0, (size_t)18 * sizeof *query);
    for (size_t i = 0; i < 6; i++)
        query[3 * (points + i) + i / 2] = i % 2 == 0 ? 0x1p1023 : -0x1p1023;
    return query;
}

static void check_found(const struct incode_tetrahedra *t,
                        const uint64_t *found) {
    uint64_t *lowest = malloc(points * sizeof *lowest);
    demand(lowest != NULL);
    for (uint64_t i = 0; i < points; i++)
        lowest[i] = INCODE_NONE64;
    for (uint64_t i = t->count; i-- > 0;)
        for (int k = 0; k < 4; k++)
            lowest[t->vertex[i][k]] = i;
    for (uint64_t i = 0; i < t->duplicate_count; i++)
        lowest[t->duplicate[i][0]] = lowest[t->duplicate[i][1]];
    for (uint64_t i = 0; i < points; i++)
        demand(found[i] == lowest[i] && found[i] != INCODE_NONE64);
    for (uint64_t i = points; i < points + 6; i++)
        demand(found[i] == INCODE_NONE64);
    free(lowest);
}

/* vertices - edges + facets - tetrahedra = 1 */
static void check_edges(const struct incode_tetrahedra *t,
                        const struct incode_adjacency *a) {
    uint64_t facets = (4 * t->count + t->hull_count) / 2;
    uint64_t vertices = points - t->duplicate_count;
    demand(a->first[points] == 2 * (vertices + facets - t->count - 1));
    for (uint64_t p = 0; p < points; p++)
        for (uint64_t i = a->first[p]; i < a->first[p + 1]; i++)
            demand(a->to[i] < points && a->to[i] != p &&
                   (i == a->first[p] || a->to[i - 1] < a->to[i]));
    for (uint64_t i = 0; i < t->duplicate_count; i++) {
        uint64_t p = t->duplicate[i][0];
        demand(a->first[p] == a->first[p + 1]);
    }
}

static void locate(unsigned threads) {
    struct incode_tetrahedra t;
    struct incode_adjacency a;
    struct incode_options o = {.threads = threads};
    uint64_t queries, at;
    triangulate(&t);
    long before = mapped;
    double *query = make_queries(&queries);
    uint64_t *found = malloc(queries * sizeof *found);
    demand(found != NULL);
    demand(incode_locate(xyz, points, &t, query, queries, &o, found, &at) ==
           INCODE_OK);
    check_found(&t, found);
    demand(mapped == before);
    demand(incode_adjacency(points, &t, &o, &a) == INCODE_OK);
    check_edges(&t, &a);
    incode_adjacency_free(&a);
    demand(mapped == before);
    incode_tetrahedra_free(&t);
    free(found);
    free(query);
}

/* Each mapping and each thread fails in turn. */
static void locate_failing(unsigned threads, bool progress) {
    struct incode_tetrahedra t;
    struct incode_adjacency a;
    unsigned shown = 0;
    struct incode_options o = {.threads = threads,
                               .progress = progress ? count_calls : NULL,
                               .context = &shown};
    uint64_t queries;
    triangulate(&t);
    long before = mapped;
    double *query = make_queries(&queries);
    uint64_t *found = malloc(queries * sizeof *found);
    demand(found != NULL);
    for (failing = 1;; failing++) {
        calls = 0;
        enum incode_status status =
            incode_locate(xyz, points, &t, query, queries, &o, found, NULL);
        demand(status == INCODE_OK || status == INCODE_NO_MEMORY);
        if (status == INCODE_OK)
            check_found(&t, found);
        demand(mapped == before);
        status = incode_adjacency(points, &t, &o, &a);
        demand(status == INCODE_OK || status == INCODE_NO_MEMORY);
        if (status == INCODE_OK)
            check_edges(&t, &a);
        demand(status == INCODE_OK || a.first == NULL);
        incode_adjacency_free(&a);
        demand(mapped == before);
        if (calls < failing)
            break;
    }
    demand(failing > 7);
    failing = 0;
    incode_tetrahedra_free(&t);
    free(found);
    free(query);
}

static void run_failing(unsigned threads, bool progress) {
    for (failing = 1;; failing++) {
        struct incode_tetrahedra t;
        unsigned shown = 0;
        struct incode_options o = {.threads = threads,
                                   .flags = INCODE_NEIGHBORS | INCODE_HULL,
                                   .progress = progress ? count_calls : NULL,
                                   .context = &shown};
        calls = 0;
        enum incode_status status = incode_delaunay(xyz, points, &o, &t);
        demand(status == INCODE_OK || status == INCODE_NO_MEMORY);
        if (status == INCODE_OK)
            check(&t);
        else
            demand(t.vertex == NULL && t.count == 0 && t.neighbor == NULL);
        incode_tetrahedra_free(&t);
        demand(mapped == 0);
        if (calls < failing)
            break;
    }
    printf("%ld\n", failing - 1);
    failing = 0;
}

static void limits(void) {
    struct incode_options o = {.threads = 2};
    struct incode_tetrahedra t;
    enum incode_status status = INCODE_NO_MEMORY;
    for (o.memory_max = 1; status == INCODE_NO_MEMORY; o.memory_max *= 2) {
        status = incode_delaunay(xyz, points, &o, &t);
        demand(status == INCODE_OK || status == INCODE_NO_MEMORY);
    }
    incode_tetrahedra_free(&t);
    demand(mapped == 0);
}

static enum incode_status of(const double *p, uint64_t n) {
    struct incode_tetrahedra t;
    enum incode_status status = incode_delaunay(p, n, NULL, &t);
    demand(status != INCODE_NOT_FINITE || t.at == 3);
    incode_tetrahedra_free(&t);
    return status;
}

static void arguments(void) {
    const double flat[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 1, 0};
    const double bad[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, NAN, 1, 1, 1, 1};
    const double few[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, -0.0, 0};
    struct incode_tetrahedra t;
    struct incode_options o = {.flags = 8};
    demand(of(flat, 5) == INCODE_FLAT && of(bad, 5) == INCODE_NOT_FINITE);
    demand(of(few, 5) == INCODE_TOO_FEW && of(flat, 0) == INCODE_TOO_FEW);
    demand(of(NULL, 0) == INCODE_TOO_FEW && of(NULL, 1) == INCODE_BAD_ARGUMENT);
    demand(of(flat, UINT64_MAX) == INCODE_TOO_MANY);
    demand(of(flat, UINT32_MAX) == INCODE_TOO_MANY);
    demand(incode_delaunay(flat, 5, &o, &t) == INCODE_BAD_ARGUMENT);
    o = (struct incode_options){.reserved = {NULL, &t}};
    demand(incode_delaunay(flat, 5, &o, &t) == INCODE_BAD_ARGUMENT);
    demand(incode_delaunay(flat, 5, NULL, NULL) == INCODE_BAD_ARGUMENT);
    incode_tetrahedra_free(NULL);
    for (int s = -1; s < 12; s++)
        demand(strlen(incode_status_text((enum incode_status)s)) > 10);
    demand(strchr(incode_version(), '.') != NULL);
}

int main(int count, char **word) {
    demand(count >= 2);
    if (count > 2)
        read_points(word[2]);
    if (strcmp(word[1], "rows") == 0 && count == 5) {
        rows((unsigned)atoi(word[3]), word[4]);
    } else if (strcmp(word[1], "locate") == 0 && count == 4) {
        locate((unsigned)atoi(word[3]));
    } else if (strcmp(word[1], "twice") == 0) {
        twice();
    } else if (strcmp(word[1], "cancel") == 0) {
        cancelling();
    } else if (strcmp(word[1], "failing") == 0) {
        run_failing(1, false);
        run_failing(3, true);
        locate_failing(1, false);
        locate_failing(3, true);
        limits();
    } else {
        demand(strcmp(word[1], "arguments") == 0);
        arguments();
    }
    free(xyz);
    return 0;
}
