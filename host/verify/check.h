/* The exact check that tetrahedra are a whole triangulation of points, at two
 * depths.  Exact arithmetic decides; faults are located.
 *
 * Tiling: every tetrahedron is positive, every distinct point is a vertex, and
 * the facets that no second tetrahedron meets form one closed surface, wound
 * once and convex at every edge.  Then every place of the convex hull lies in
 * one tetrahedron, and tetrahedra meet facet to facet (see check.c).  Facets
 * are summed at their vertices by hashes under a random key: without the key, a
 * wrong result cannot be made to pass, and any wrong result passes with a
 * probability below 2^-50 (see sums.c).
 * Delaunay: in addition, no vertex lies inside the sphere of a neighbour under
 * the tie rule.  Then this is the one Delaunay triangulation.  This depth pairs
 * all facets one by one, and relies on no hash.
 *
 * Memory: on T <= 4 threads 8 T + 2 bytes a vertex number; 80 a facet of the
 * hull; and 8 a tetrahedron for the Delaunay depth, or for tiling 12 for each
 * tetrahedron whose lowest or second vertex is the lowest of a facet of the
 * hull.  Work: O(n) on all threads for vertices of bounded degree. */
#ifndef HOST_CHECK_H
#define HOST_CHECK_H

#include "host/mesh/tetrahedra.h"
#include "host/mesh/order.h"
#include "host/mesh/points.h"

/* What vertex numbers stand for: vertices of an order (order != NULL), or rows
 * of points (xyz and lowest). */
struct host_sites {
    const struct host_order *order;
    const double *xyz;      /* [3 * count] */
    const uint32_t *lowest; /* [count] lowest row of the same point */
    uint64_t count;         /* vertex numbers are below it */
};

static inline struct host_sites
host_sites_of_order(const struct host_order *order) {
    return (struct host_sites){
        .order = order, .count = (uint64_t)order->bricks * INCODE_BRICK_POINTS};
}

/* Whether v < count is a vertex: not an unused slot, not a repeated row. */
static inline bool host_site_is_vertex(const struct host_sites *sites,
                                       uint32_t v) {
    return sites->order == NULL
               ? sites->lowest[v] == v
               : v % INCODE_BRICK_POINTS <
                     sites->order->fill[v / INCODE_BRICK_POINTS];
}

static inline void host_site(const struct host_sites *sites, uint32_t v,
                             double xyz[3]) {
    if (sites->order != NULL) {
        host_vertex(sites->order, v, xyz);
        return;
    }
    for (int d = 0; d < 3; d++)
        xyz[d] = sites->xyz[3 * (size_t)v + (size_t)d];
}

enum host_check_depth { HOST_CHECK_TILING, HOST_CHECK_DELAUNAY };

/* Receives the faults: called on the calling thread when all are found, for at
 * most `faults_max` of them; the report counts all.  tets: the 0 to 2
 * tetrahedra that meet at the fault (indices into tets->v).  vertices: 0 to 5
 * at the fault, with those of the tetrahedra at a facet.
 *
 * If a tetrahedron of the true triangulation is missing, each of its vertices
 * is named, unless the tetrahedra around that vertex are complete.  (Then they
 * tile, and the Delaunay depth names those whose spheres are not empty.) */
struct host_check_listener {
    void *context;
    uint64_t faults_max;
    void (*fault)(void *context, const uint64_t *tets, int tet_count,
                  const uint32_t *vertices, int count, const char *what);
};

/* The counts, and the first faults, one a line, by rows of the input. */
struct host_check_report {
    uint64_t points;   /* vertex numbers that stand for points */
    uint64_t distinct; /* vertices that there should be */
    uint64_t tetrahedra, hull_facets, hull_vertices;
    uint64_t paired; /* tetrahedra whose facets were paired one by one */
    uint64_t faults; /* found in all */
    char text[2048]; /* the first eight of them, a line each */
};

/* 0; HOST_UNVERIFIED with report->text and error set; another code where the
 * check itself could not be done.  listener: NULL is allowed. */
int host_check(const struct host_sites *sites,
               const struct host_tetrahedra *tets, enum host_check_depth depth,
               const struct host_check_listener *listener,
               struct host_check_report *report, struct host_error *error);

/* The exact check (check.h) of tetrahedra whose vertices are rows of points.
 *
 * Memory: 4 bytes a point beyond that of the check.  Tetrahedra that are put
 * aside (host/base/scratch.h) are checked in an order of the points in space:
 * 28 bytes a point and 32 a tetrahedron more on the disk.
 *
 *     if (host_verify(&points, &tets, HOST_CHECK_DELAUNAY, &report, &error) ==
 * HOST_UNVERIFIED) fputs(report.text, stderr); */

/* Whether tets are the Delaunay triangulation of points under the tie rule, or
 * (HOST_CHECK_TILING) any; of equal points only the lowest row counts.  0: they
 * are; HOST_UNVERIFIED: they are not; another code: the check could not be
 * done. */
int host_verify(const struct host_points *points,
                const struct host_tetrahedra *tets, enum host_check_depth depth,
                struct host_check_report *report, struct host_error *error);

#endif
