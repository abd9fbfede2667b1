/* A plane section through tetrahedra: each that the plane cuts gives a triangle
 * or a convex quadrilateral.  Points on the plane count as above it, so that
 * the cells cover the section once, also where the plane goes through vertices
 * or along faces; it is then the limit of planes that come from below.
 *
 * Memory: a bit a point and 40 bytes a cell.  Work: two passes over the
 * tetrahedra, 5 ns each, and 300 ns a cell. */
#ifndef HOST_SECTION_H
#define HOST_SECTION_H

#include "host/mesh/points.h"
#include "host/mesh/tetrahedra.h"

/* All points whose coordinate `axis` (0: x, 1: y, 2: z) is `at`. */
struct host_plane {
    unsigned axis;
    double at;
};

/* Corners in their order around the cell, as parts of the section's longer
 * side; size: of its tetrahedron, the logarithm of the mean of its edges. */
struct host_cell {
    float corner[4][2];
    float size;
    uint32_t corners; /* 3 or 4 */
};

struct host_section {
    struct host_cell *cells;
    uint64_t count;
    double size_mean;     /* of the cells' sizes */
    double extent[2];     /* of the section, in the points' unit, and */
    double proportion[2]; /* as parts of the longer side */
};

/* The middle of the points along the axis in which they extend least, z where
 * they do in no other: so one sees most. */
struct host_plane host_plane_through_middle(const struct host_points *points);

/* The middle along an axis that is given. */
double host_plane_middle(const struct host_points *points, unsigned axis);

/* Rows of tets are rows of points.  The two directions of the cells are the
 * other two axes in their order.  HOST_INPUT where the plane passes beside the
 * tetrahedra, or only touches them. */
int host_section_make(struct host_section *section,
                      const struct host_points *points,
                      const struct host_tetrahedra *tets,
                      struct host_plane plane, struct host_error *error);

void host_section_free(struct host_section *section);

#endif
