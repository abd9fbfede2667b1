/* Facets of the convex hull, counted without a table of facets.  Every vertex
 * has a point of a plane, drawn by its number.  The triangles that are opposite
 * a vertex in its tetrahedra make a closed surface about it, whose areas in
 * that plane, with their signs, are 0 together; about a vertex of the hull it
 * is open, and they are not.  The hull is a triangulated sphere, so V vertices
 * make 2 V - 4 facets.
 *
 * Memory: 16 bytes a vertex number.  Work: about 10 ns a tetrahedron on each of
 * two threads, if their vertices lie close in number; wrong once in 2^60 / V.
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
