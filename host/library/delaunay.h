/* The library's way as `incode run` takes it: the tetrahedra of points that are
 * in order, by a triangulator of the core for each thread, without messages.
 *
 * Each thread takes region after region, copies pages straight from the order,
 * and appends tetrahedra to a list of its own.  A region is triangulated alone.
 * What another region's points may change is not kept: the points of such
 * tetrahedra, the seam, are triangulated once more when all regions are done,
 * and the lists are put together. */
#ifndef HOST_DELAUNAY_H
#define HOST_DELAUNAY_H

#include "host/base/parallel.h"
#include "host/mesh/order.h"
#include "host/mesh/tetrahedra.h"
#include "incode/triangulator.h"

enum host_direct {
    HOST_DIRECT_DONE,
    HOST_DIRECT_CANCELLED,
    HOST_DIRECT_MEMORY,
    HOST_DIRECT_UNKEPT, /* by struct host_direct_store */
    HOST_DIRECT_BROKEN  /* an invariant failed */
};

/* What one thread has done. */
struct host_direct_part {
    struct incode_statistics statistics; /* of all its regions */
    uint64_t faces_spilled;
    uint64_t poured; /* tetrahedra that went to the sink */
    double cpu_s, wall_s;
    size_t arena; /* bytes */
};

/* A region that was triangulated alone. */
struct host_direct_region {
    uint64_t key; /* of its order (order.h) */
    unsigned
        level; /* 0: of the points; 1: of their seam; 2: of the seam's ... */
    uint32_t number, regions;
    /* Lists to which its tetrahedra of vertex numbers are appended, and the
     * rows of other regions in them: those that are final, and the rest. */
    struct host_tetrahedra *tets, *left;
    uint64_t tets_before, left_before;
    uint8_t *mark; /* [marks] of its vertices, or 0 */
    uint64_t marks;
};

/* Keeps regions, so that another run of the same points has them.  Called from
 * any thread. */
struct host_direct_store {
    /* Into how many regions an earlier run has cut that level; 0: unknown. */
    uint32_t (*regions)(void *context, unsigned level);
    /* Appends what an earlier run has kept; false: it has not, and the lists
     * are as before. */
    bool (*load)(void *context, struct host_direct_region *region);
    /* 0, or error->code: the run ends. */
    int (*keep)(void *context, const struct host_direct_region *region,
                struct host_error *error);
    void *context;
};

struct host_direct_sums {
    const struct host_direct_store *store; /* or NULL */
    /* NULL, or called on the calling thread with the number of bricks that are
     * done. */
    void (*committed)(uint32_t bricks);
    _Atomic uint32_t bricks;
    bool by_vertex; /* vertex numbers of the order, not rows of the input */
    /* Takes the tetrahedra as regions are done, and of the seam at last, in
     * place of the list.  put: NULL for none. */
    struct host_sink sink;
    unsigned threads;
    struct host_direct_part part[HOST_THREADS_MAX];
};

/* Regions for so many threads and points: a power of two, at least one a
 * thread. */
uint32_t host_direct_regions(unsigned threads, uint64_t points);

/* Appends the tetrahedra of all regions to an empty list, as rows of the input
 * (unless sums->by_vertex) in no order.  sums: NULL, or what each thread has
 * done.  The calling thread's host_call, if there is one, limits threads and
 * memory, may be cancelled, and counts bricks. */
enum host_direct host_direct_run(const struct host_order *order,
                                 struct host_tetrahedra *tets,
                                 struct host_direct_sums *sums,
                                 struct host_error *error);

/* The same from points to tetrahedra that are sorted: 0, or error->code. */
int host_delaunay(const double *xyz /* [3 * count] */, uint64_t count,
                  struct host_tetrahedra *tets, struct host_error *error);

#endif
