/* Facets of the convex hull, counted without a table of facets.  Each facet of
 * a tetrahedron has a number that changes its sign with the orientation, added
 * at its three vertices: facets that two tetrahedra share cancel, and what is
 * not zero is a vertex of the hull.  The hull is a triangulated sphere, so V
 * vertices make 2 V - 4 facets.
 *
 * Memory: 8 bytes a vertex number.  Work: about 20 ns a tetrahedron, if their
 * vertices lie close in number; wrong once in 2^64 / V.
 *
 *     uint64_t facets;
 *     if (host_hull_facets(&tets, rows, &facets, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_FACETS_H
#define HOST_FACETS_H

#include "tetrahedra.h"

/* tets: a whole triangulation, all rows of positive orientation, vertices below
 * `vertices`. */
int host_hull_facets(const struct host_tetrahedra *tets, uint64_t vertices,
                     uint64_t *facets, struct host_error *error);

#endif
