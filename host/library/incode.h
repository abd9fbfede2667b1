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
    INCODE_BAD_ARGUMENT, /* NULL, an unknown flag, reserved that is not NULL,
                            or tetrahedra that are not of these points */
    INCODE_NOT_FINITE,   /* row out->at has a NaN or infinite coordinate */
    INCODE_TOO_FEW,      /* fewer than four distinct points */
    INCODE_FLAT,         /* all points on one plane or line */
    INCODE_TOO_MANY,     /* too many points or tetrahedra: see below */
    INCODE_IO,           /* of streams */
    INCODE_CANCELLED,    /* `progress` returned false */
    INCODE_INTERNAL      /* a defect: please report */
};

enum {
    INCODE_NEIGHBORS = 1, /* fill `neighbor` */
    INCODE_HULL = 2,      /* fill `hull` */
    INCODE_ANY_ORDER = 4  /* rows need not be sorted, which saves time */
};

struct incode_options { /* all zero: the defaults */
    /* 0: one a processor that this process may use, at most one for 6,000
     * points. */
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

/* Which tetrahedron holds each query.  found[i] is the lowest number of a
 * tetrahedron that contains query[3 * i ..], or INCODE_NONE64 where none does.
 * Tetrahedra are closed: facets, edges and vertices belong to them.  `t` is a
 * result for the same xyz with INCODE_NEIGHBORS, in any order.  Exact, and
 * independent of the threads and of the order of queries.  options->flags is 0.
 * On an error, `found` has no meaning; INCODE_NOT_FINITE: *at is the lowest
 * number of a query with a NaN or infinite coordinate.
 *
 * Memory: 32 bytes a query, at most 32 MB; and for each thread 3 KB, and up to
 * 24 bytes for each tetrahedron of the largest star of a vertex that a query
 * is on.  Up to 32 queries take memory for a star of more than 128 tetrahedra
 * alone.
 * Work of a query, where points are spread evenly: O(log queries) to put them
 * in order, and O(1 + (points / queries)^(1/3)) steps; O(points^(1/3)) for a
 * query alone. */
enum incode_status
incode_locate(const double *xyz /* [3 * points] */, uint64_t points,
              const struct incode_tetrahedra *t,
              const double *query /* [3 * queries] */, uint64_t queries,
              const struct incode_options *options, /* or NULL */
              uint64_t *found /* [queries] */, uint64_t *at /* or NULL */);

/* The edges of a result: the neighbours of vertex p are to[first[p]] up to, not
 * including, to[first[p + 1]], ascending, each once.  Rows that are duplicates
 * have none. */
struct incode_adjacency {
    uint64_t points;
    uint64_t *first; /* [points + 1] */
    uint32_t *to;    /* [first[points]] */
    void *reserved[4];
};

/* `t` need not have neighbours.  `out` need not be initialised, and owns no
 * memory on an error.  options->flags is 0.
 *
 * Memory: 24 bytes a tetrahedron and 12 a point, the result apart.  Work:
 * O(tetrahedra) where no vertex has many neighbours. */
enum incode_status
incode_adjacency(uint64_t points, const struct incode_tetrahedra *t,
                 const struct incode_options *options, /* or NULL */
                 struct incode_adjacency *out);

/* Frees the memory and clears it.  NULL is accepted. */
void incode_adjacency_free(struct incode_adjacency *a);

/* A sentence without its period, in static memory, also for a value that is not
 * a status. */
const char *incode_status_text(enum incode_status status);

/* "MAJOR.MINOR.PATCH", in static memory. */
const char *incode_version(void);

#ifdef __cplusplus
}
#endif

#endif
