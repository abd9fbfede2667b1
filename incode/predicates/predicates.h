/* Exact geometric predicates on finite doubles, with ties broken so that a
 * point set has one Delaunay triangulation.
 *
 * Work: bounded for any finite input, denormals and 2^1023 included.
 *
 *     struct incode_tally tally = {0};
 *     if (incode_orient3d(&tally, a, b, c, d) > 0)
 *         inside = incode_in_sphere(&tally, a, b, c, d, e) > 0;
 */
#ifndef INCODE_PREDICATES_H
#define INCODE_PREDICATES_H

#include <stdbool.h>
#include <stdint.h>

#include "yield.h"

/* Calls that the static filter could not decide, and the function that long
 * work yields to.  Exact stages increment the counters; filters do not. */
struct incode_tally {
    uint64_t exact_orient3d;
    uint64_t exact_in_sphere;
    struct incode_yield yield;
};

/* Static filters of Devillers and Pion: the sign of the rounded determinant, as
 * predicates.c computes it, is right if its absolute value exceeds BOUND times
 * the product of the largest differences of each coordinate (in_sphere: also
 * times the square of the largest of these).  The smallest of these differences
 * must exceed LEAST and the largest must be below MOST. */
#define INCODE_ORIENT3D_BOUND 5.1107127829973299e-15
#define INCODE_ORIENT3D_LEAST 1e-97
#define INCODE_ORIENT3D_MOST 1e102
#define INCODE_IN_SPHERE_BOUND 1.2466136531027298e-13
#define INCODE_IN_SPHERE_LEAST 1e-58
#define INCODE_IN_SPHERE_MOST 1e61

/* Sign of the determinant with rows b-a, c-a, d-a: +1, 0 or -1, exact. */
int incode_orient3d(struct incode_tally *tally, const double a[3],
                    const double b[3], const double c[3], const double d[3]);

/* +1: e lies inside the sphere through a, b, c, d; -1: outside.  Never 0: ties
 * of five cospherical points are broken by the symbolic perturbation of
 * Devillers and Teillaud (CGTA 44:160-168, 2011).  Precondition: the five
 * points are distinct and orient3d(a,b,c,d) > 0. */
int incode_in_sphere(struct incode_tally *tally, const double a[3],
                     const double b[3], const double c[3], const double d[3],
                     const double e[3]);

/* Sign of a - b in the lexicographic order of (x, y, z). */
int incode_lexicographic(const double a[3], const double b[3]);

/* Sign of |a-p|^2 - |b-p|^2, exact. */
int incode_compare_distance(const double p[3], const double a[3],
                            const double b[3]);

/* Whether a, b, c lie on one line, exact. */
bool incode_collinear(const double a[3], const double b[3], const double c[3]);

/* NULL if the arithmetic of this machine is sound.  Otherwise a message:
 * products fused into sums, denormals flushed, rounding not to nearest even,
 * words not little-endian.  A program must then refuse to run. */
const char *incode_arithmetic_fault(void);

#endif
