/* How many distinct edges tetrahedra have: the E of Euler's relation.
 *
 * Memory: 8 bytes a vertex and 4 a tetrahedron (more only where one vertex has
 * more tetrahedra than that).  Work: about ten sweeps over the tetrahedra, and
 * a sort at each vertex; all threads.
 *
 *     uint64_t edges;
 *     if (host_edges_count(&tets, rows, &edges, &error) != 0)
 *         return error.code;
 *     int64_t euler = (int64_t)(vertices - edges + facets - tets.count);
 */
#ifndef HOST_EDGES_H
#define HOST_EDGES_H

#include "host/mesh/tetrahedra.h"

/* Tetrahedra canonical and sorted, every vertex below `vertices`. */
int host_edges_count(const struct host_tetrahedra *tets, uint32_t vertices,
                     uint64_t *edges, struct host_error *error);

#endif
