/* A triangulation without a cube: the triangulator alone, with all memory, all
 * pages at once and nobody in between.  What a cube computes is held against
 * it.
 *
 * Memory: a few times the points.  Work: that of the triangulator.
 *
 *     if (host_reference(&points, &tets, &error) == 0)
 *         host_digest(&tets, &digest);
 */
#ifndef HOST_SIM_REFERENCE_H
#define HOST_SIM_REFERENCE_H

#include "host/mesh/points.h"
#include "host/mesh/tetrahedra.h"

/* 0, or the error; HOST_BROKEN where the triangulator breaks. */
int host_reference(const struct host_points *points,
                   struct host_tetrahedra *tets, struct host_error *error);

#endif
