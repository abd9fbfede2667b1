/* Exact 3D Delaunay triangulation: points in memory to tetrahedra in memory.
 *
 * The result is a function of the points alone: not of their order, of the
 * threads, or of the processor. Ties among cospherical points are broken by a
 * rule (Devillers and Teillaud, Computational Geometry 44:160-168, 2011), and
 * every decision is exact for all finite doubles, so no tetrahedron is flat.
 *
 * There is no global state: calls from several threads at once are independent.
 * Nothing is printed, nothing exits, no signal is touched.
 *
 *     struct incode_tetrahedra t;
 *     if (incode_delaunay(xyz, 1000, NULL, &t) == INCODE_OK)
 *         count = t.count;
 *     incode_tetrahedra_free(&t);
 */
#ifndef INCODE_H
#define INCODE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* incode_status_text(status) explains each. */
enum incode_status {
    INCODE_OK = 0,
    INCODE_NO_MEMORY,    /* memory or memory_max too small, or no thread */
    INCODE_BAD_ARGUMENT, /* NULL, an unknown flag, `reserved` that is not NULL,
                            or tetrahedra that are not of these points */
    INCODE_NOT_FINITE,   /* row `at` has a NaN or infinite coordinate */
    INCODE_TOO_FEW,      /* fewer than four distinct points */
    INCODE_FLAT,         /* all points on one plane or line */
    INCODE_TOO_MANY,     /* too many points or tetrahedra: see below */
    INCODE_IO,           /* incode_stream: the scratch folder's disk failed */
    INCODE_CANCELLED,    /* `progress` or another callback returned false */
    INCODE_INTERNAL      /* a defect: please report */
};

enum {
    INCODE_NEIGHBORS = 1, /* fill `neighbor` */
    INCODE_HULL = 2,      /* fill `hull` */
    INCODE_ANY_ORDER = 4  /* rows need not be sorted, which saves time */
};

struct incode_options { /* all zero: the defaults */
    /* 0: one for each processor that this process may use, but no more than
     * the work has use for (incode_delaunay: one for 6,000 points). */
    unsigned threads;
    unsigned flags; /* what else is wanted */
    /* Called from the calling thread, at least ten times a second and once at
     * the end; false cancels.  No exception or longjmp may leave it. */
    bool (*progress)(void *context, double done /* 0 to 1 */);
    void *context;
    size_t memory_max; /* bytes that the call may allocate, result included,
                          stacks of threads apart; 0: no limit */
    void *reserved[4]; /* NULL */
};

#define INCODE_NONE64 UINT64_MAX

struct incode_tetrahedra {
    uint64_t count;
    /* [count] rows of xyz.  Orientation is positive: the determinant with rows
     * v1 - v0, v2 - v0, v3 - v0 is above 0.  The smallest vertex is first; of
     * the even permutations that remain, the one with the smallest second
     * vertex is taken.  Tetrahedra are sorted in ascending order (with
     * INCODE_ANY_ORDER they are not sorted). */
    uint32_t (*vertex)[4];
    /* [count] the tetrahedron opposite vertex i, or INCODE_NONE64 on the hull.
     * NULL without INCODE_NEIGHBORS. */
    uint64_t (*neighbor)[4];
    uint64_t hull_count;
    /* [hull_count] facets, counter-clockwise from outside.  NULL without
     * INCODE_HULL. */
    uint32_t (*hull)[3];
    uint64_t duplicate_count;
    uint32_t (*duplicate)[2]; /* a row, and the lower row with the same point */
    uint64_t at;              /* of INCODE_NOT_FINITE: the row */
    void *reserved[4];
};

/* Triangulates xyz[3 * points]: x, y, z of each row, read and not written.
 * `out` need not be initialised.  On an error only `at` has a meaning, and
 * `out` owns no memory.  At most 2^32 - 2 rows, and at most 2^32 - 2^16
 * distinct points, less the empty slots of bricks.  With neighbours or hull, at
 * most 2^32 - 2 tetrahedra.  The caller's rounding mode and flush-to-zero are
 * restored.
 *
 * Memory: about 170 bytes a point at most, 108 of which are the result's.
 * Work: O(n log n) for points in a volume; the count of tetrahedra may grow
 * with n^2 (skew curves). */
enum incode_status
incode_delaunay(const double *xyz /* [3 * points] */, uint64_t points,
                const struct incode_options *options, /* or NULL */
                struct incode_tetrahedra *out);

/* Frees the memory of a result and clears it.  NULL is accepted. */
void incode_tetrahedra_free(struct incode_tetrahedra *t);

/* Finds the tetrahedron that contains each query.  found[i] is its number, or
 * INCODE_NONE64 if query i, query[3 * i ..], is outside the hull.  Tetrahedra
 * are closed: facets, edges and vertices belong to them.  If several contain a
 * query, the lowest number is taken.  The answer is exact, and depends neither
 * on the threads nor on the order of the queries.
 *
 * `t` is the result for the same xyz with INCODE_NEIGHBORS, in any order.
 * options->flags must be 0.  On an error `found` has no meaning.  On
 * INCODE_NOT_FINITE *at is the lowest number of a query with a NaN or infinite
 * coordinate.
 *
 * Memory: 32 bytes a query, at most 32 MB.  Each thread takes 3 KB, and up to
 * 24 bytes for each tetrahedron of the largest star of a vertex on which a
 * query lies.  A call with up to 32 queries allocates memory only for a star of
 * more than 128 tetrahedra. Work of a query, if the points are spread evenly:
 * O(log queries) to sort it, and O(1 + (points / queries)^(1/3)) steps of its
 * walk, which are O(points^(1/3)) for a single query. */
enum incode_status
incode_locate(const double *xyz /* [3 * points] */, uint64_t points,
              const struct incode_tetrahedra *t,
              const double *query /* [3 * queries] */, uint64_t queries,
              const struct incode_options *options, /* or NULL */
              uint64_t *found /* [queries] */, uint64_t *at /* or NULL */);

/* The edges of a result: the neighbours of vertex p are to[i] for i from
 * first[p] to first[p + 1] - 1, ascending, each once.  A row that repeats a
 * point has no neighbours. */
struct incode_adjacency {
    uint64_t points;
    uint64_t *first; /* [points + 1] */
    uint32_t *to;    /* [first[points]] */
    void *reserved[4];
};

/* Lists the edges of a result.  `t` need not have neighbours.  `out` need not
 * be initialised.  On an error `out` owns no memory.  options->flags must be 0.
 *
 * Memory: 24 bytes a tetrahedron and 12 a point, the result apart.  Work:
 * O(tetrahedra) if no vertex has many neighbours. */
enum incode_status
incode_adjacency(uint64_t points, const struct incode_tetrahedra *t,
                 const struct incode_options *options, /* or NULL */
                 struct incode_adjacency *out);

/* Frees the lists and clears `a`.  NULL is accepted. */
void incode_adjacency_free(struct incode_adjacency *a);

/* Where incode_stream gets points and puts tetrahedra.  The call calls one of
 * these at a time, from the calling thread or from another thread of the call,
 * which blocks all signals.  If one returns false, the call ends with
 * INCODE_CANCELLED, and calls none of them again.  The calling thread may call
 * options->progress meanwhile.  No exception or longjmp may
 * leave them. */
struct incode_callbacks {
    /* Writes x, y, z of the next points, at most `room`, to xyz[3 * room], and
     * how many to *count; 0: there are no more.  Points have the row numbers 0,
     * 1, ... as they come. */
    bool (*points)(void *context, double *xyz, size_t room, size_t *count);
    /* Takes `count` tetrahedra.  The array is valid until it returns. */
    bool (*tetrahedra)(void *context, const uint32_t (*vertex)[4],
                       size_t count);
    /* Takes rows that repeat a point, each with the lowest row of that point.
     * NULL: they are counted only. */
    bool (*duplicates)(void *context, const uint32_t (*duplicate)[2],
                       size_t count);
    void *context;
    const char *scratch; /* folder of what is put aside; NULL: /tmp */
    void *reserved[4];   /* NULL */
};

struct incode_totals {
    uint64_t points;
    uint64_t count; /* tetrahedra */
    uint64_t duplicate_count;
    uint64_t scratch_max; /* bytes that were put aside at a time, at most */
    uint64_t at;          /* of INCODE_NOT_FINITE: the row */
    int error;            /* of INCODE_IO: the errno of the file system */
    void *reserved[4];
};

/* Triangulates points that come from a callback, and gives the tetrahedra to
 * another as they are found: blocks of at most 4,096, in no order, each
 * tetrahedron once.  Together, and sorted, they are the rows of
 * incode_delaunay, and each row is oriented and rotated as there.  If the call
 * fails, the tetrahedra that were given are some of the result's.
 *
 * options->memory_max: bytes that the call has resident at most, stacks of
 * threads and what the callbacks use apart; 16 MiB or more (less:
 * INCODE_NO_MEMORY).  The rest is put aside in files without a name in the
 * scratch folder, which are gone when the call ends, however it ends.  Each
 * thread takes 16 MiB of the limit, so there may be fewer than
 * options->threads.  The limit is of this call alone: other memory of the
 * process, and other calls at the same time, which each have a limit of their
 * own, do not count.  The kernel's cache of files does not count either.
 * 0: no limit, and nothing is put aside.  options->flags must be 0.
 *
 * `out` need not be initialised; it owns no memory.  On an error only `at` and
 * `error` in it have a meaning.  Limits as of incode_delaunay.
 *
 * A full disk is INCODE_IO.  A disk that loses what it took raises SIGBUS in
 * the process, as of every file that is mapped.
 *
 * Memory without a limit: about 110 bytes a point, and 180 MB a thread. Scratch
 * with one: 100 to 160 bytes a point and a quarter of the limit, in 12 files
 * and up to 4 for each thread, which are open at once. Work: as of
 * incode_delaunay, without the sort. */
enum incode_status
incode_stream(const struct incode_callbacks *callbacks,
              const struct incode_options *options, /* or NULL */
              struct incode_totals *out /* or NULL */);

/* A sentence without its period, in static memory, also for a value that is not
 * a status. */
const char *incode_status_text(enum incode_status status);

/* "MAJOR.MINOR.PATCH", in static memory. */
const char *incode_version(void);

#ifdef __cplusplus
}
#endif

#endif
