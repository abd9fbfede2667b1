/* Point sets made from a seed, the same on every machine: no function of the C
 * library's mathematics but sqrt takes part.
 *
 * Work: O(n). */
#ifndef HOST_GEN_H
#define HOST_GEN_H

#include "points.h"

enum { HOST_GEN_MIN = 4 };

/* As many as are triangulated: 2^32 - 2^16. */
static const uint64_t host_gen_max = (UINT64_C(1) << 32) - (1 << 16);

/* Kinds: uniform (the unit cube), bubbles (spheres of points, dense shells),
 * bluntfin (a curvilinear grid like NASA's Blunt Fin), sphere (the unit
 * sphere's surface), grid (a cubic lattice), rotated (the same out of its
 * axes), hub (one point amid n-1 on a sphere), shell (a sphere's, of thickness
 * 0.001), cylinder and torus (their surfaces), terrain (whole heights above a
 * square grid), scales (coordinates from 2^-1000 to 2^1000), lines (two that do
 * not meet).  HOST_USAGE for another kind, fewer than 4 points, or more than
 * host_gen_max. */
int host_gen(const char *kind, uint64_t n, uint64_t seed,
             struct host_points *points, struct host_error *error);

/* The kinds, separated by commas. */
extern const char host_gen_kinds[];

#endif
