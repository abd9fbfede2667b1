/* Exact 3D Delaunay triangulation: points in memory to tetrahedra in memory.
 *
 * The result is a function of the points alone: not of their order, of the
 * threads, or of the processor. Cospherical points are told apart by a rule
 * (Devillers and Teillaud, Computational Geometry 44:160-168, 2011), and every
 * decision is exact for all finite doubles, so no tetrahedron is flat.
 *
 * There is no global state: calls from several threads at once are
 * independent.  Nothing is printed, nothing exits, no signal is touched.
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
    INCODE_NO_MEMORY,    /* none, none within memory_max, or no thread */
    INCODE_BAD_ARGUMENT, /* NULL, an unknown flag, reserved that is not NULL */
    INCODE_NOT_FINITE,   /* a coordinate is NaN or infinite, of row out->at */
    INCODE_TOO_FEW,      /* fewer than four distinct points */
    INCODE_FLAT,         /* all points on one plane or line */
    INCODE_TOO_MANY,     /* points, or tetrahedra to be joined: see below */
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
    unsigned threads;   /* 0: one a processor that this process may use */
    unsigned flags;     /* what else is wanted */
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
    /* [count] rows of xyz.  orient(v0, v1, v2, v3) > 0: the sign of the
     * determinant with rows v1 - v0, v2 - v0, v3 - v0.  The smallest row first,
     * then the even permutation whose second is smallest; tetrahedra by their
     * rows sorted ascending (with INCODE_ANY_ORDER, in no order). */
    uint32_t (*vertex)[4];
    /* [count] the tetrahedron opposite vertex i; INCODE_NONE64 on the hull;
     * NULL unless asked for. */
    uint64_t (*neighbor)[4];
    uint64_t hull_count;
    /* [hull_count] facets seen counter-clockwise from outside; NULL unless
     * asked for. */
    uint32_t (*hull)[3];
    uint64_t duplicate_count;
    uint32_t (*duplicate)[2]; /* a row, and the lower row with the same point */
    uint64_t at;              /* of INCODE_NOT_FINITE: the row */
    void *reserved[4];
};

/* Triangulates xyz[3 * points]: x, y, z of each row, read and not written.
 * `out` need not be initialised.  On an error it holds `at` alone and owns
 * nothing.  At most 2^32 - 2 points, less what bricks leave empty; with
 * neighbours or hull at most 2^32 - 2 tetrahedra.  The caller's rounding mode
 * and flush-to-zero are set aside and restored.
 *
 * Memory: about 170 bytes a point at most, 108 of which are the result's.
 * Work: O(n log n) for points in a volume; the count of tetrahedra may grow
 * with n^2 (skew curves). */
enum incode_status
incode_delaunay(const double *xyz /* [3 * points] */, uint64_t points,
                const struct incode_options *options, /* or NULL */
                struct incode_tetrahedra *out);

/* Gives back what a result owns and clears it.  NULL is accepted. */
void incode_tetrahedra_free(struct incode_tetrahedra *t);

/* A sentence without its period, static; also for a status that is none. */
const char *incode_status_text(enum incode_status status);

/* "MAJOR.MINOR.PATCH", static. */
const char *incode_version(void);

#ifdef __cplusplus
}
#endif

#endif
