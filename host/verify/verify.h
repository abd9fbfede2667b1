/* The exact check (check.h) of tetrahedra whose vertices are rows of points.
 *
 * Memory: 4 bytes a point beyond that of the check.  Work: that of the check.
 *
 *     if (host_verify(&points, &tets, HOST_CHECK_DELAUNAY, &report, &error) ==
 * HOST_UNVERIFIED) fputs(report.text, stderr);
 */
#ifndef HOST_VERIFY_H
#define HOST_VERIFY_H

#include "check.h"
#include "host/mesh/points.h"

/* Whether tets are the Delaunay triangulation of points under the tie rule, or
 * (HOST_CHECK_TILING) any; of equal points only the lowest row counts.  0: they
 * are; HOST_UNVERIFIED: they are not; another code: the check could not be
 * done. */
int host_verify(const struct host_points *points,
                const struct host_tetrahedra *tets, enum host_check_depth depth,
                struct host_check_report *report, struct host_error *error);

#endif
