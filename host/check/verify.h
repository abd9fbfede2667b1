/* Exact and complete check that tetrahedra are the Delaunay triangulation of
 * points under the tie rule: every one positive, each facet met twice from
 * opposite sides or once on the convex hull, no vertex in a neighbour's sphere,
 * every distinct point a vertex, Euler's relation.
 *
 * Memory: 4 bytes a tetrahedron and 30 a point beyond the arguments.  Work:
 * O(tetrahedra) for vertices of bounded degree, two threads, about 1 us a
 * tetrahedron.
 *
 *     if (host_verify(&points, &tets, &report, &error) == HOST_UNVERIFIED)
 *         fputs(report.text, stderr);
 */
#ifndef HOST_VERIFY_H
#define HOST_VERIFY_H

#include "host/mesh/points.h"
#include "host/mesh/tetrahedra.h"

/* What was counted, and the first offenders, one a line. */
struct host_verify_report {
    uint64_t points, distinct, tetrahedra, hull_facets, hull_vertices, edges;
    uint64_t faults; /* offences found */
    char text[2048]; /* the first eight of them, a line each */
};

/* Sorts tets in place.  Vertices are rows of points; a duplicated point stands
 * for its lowest row.  0, HOST_UNVERIFIED or another code. */
int host_verify(const struct host_points *points, struct host_tetrahedra *tets,
                struct host_verify_report *report, struct host_error *error);

#endif
