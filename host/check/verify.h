/* The exact check (check.h) of tetrahedra whose vertices are rows of points.
 *
 * Memory: 4 bytes a point beyond that of the check.  Work: that of the check.
 *
 *     if (host_verify(&points, &tets, &report, &error) == HOST_UNVERIFIED)
 *         fputs(report.text, stderr);
 */
#ifndef HOST_VERIFY_H
#define HOST_VERIFY_H

#include "check.h"
#include "host/mesh/points.h"

/* Whether tets are the Delaunay triangulation of points under the tie rule; a
 * duplicated point stands for its lowest row.  0, HOST_UNVERIFIED or another
 * code. */
int host_verify(const struct host_points *points,
                const struct host_tetrahedra *tets,
                struct host_check_report *report, struct host_error *error);

#endif
