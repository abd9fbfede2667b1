/* Point sets made from a seed, the same on every machine: no function of the C
 * library's mathematics but sqrt takes part.
 *
 * Memory: the points.  Work: O(n).
 *
 *     host_gen("uniform", 20000, 1, &points, &error);
 *     host_points_write("u.npy", &points, &error);
 *     host_points_free(&points);
 */
#ifndef HOST_GEN_H
#define HOST_GEN_H

#include "points.h"

/* Kinds: uniform (the unit cube), bubbles (spheres of points, dense shells),
 * bluntfin (a curvilinear grid like NASA's Blunt Fin), sphere (the unit
 * sphere's surface), grid (a cubic lattice), rotated (the same out of its
 * axes), hub (one point amid n-1 on a sphere).  HOST_USAGE for another kind or
 * fewer than 4 points. */
int host_gen(const char *kind, uint64_t n, uint64_t seed,
             struct host_points *points, struct host_error *error);

/* The kinds, separated by commas. */
extern const char host_gen_kinds[];

#endif
