/* The last resort of the predicates: their polynomials, summed without any
 * rounding for all finite doubles.
 *
 * Every monomial is a product of at most three coordinates, so of at most 159
 * bits; it is added into one long fixed-point number that spans the exponents
 * actually present (Kulisch's accumulator).  Differences are never formed, so
 * nothing can overflow, underflow or be rounded.  in_sphere is a sum of squares
 * of coordinates times orient3d, of which first only the highest limbs count.
 *
 * Memory: at most 6 KB of stack (INCODE_EXACT_STACK).  Work: 24 (orient3d), 12
 * (compare_distance) or 18 (collinear) monomials; in_sphere 5 times orient3d
 * and, of the widest exponents, up to 15 products of 5 limbs and 200, as often
 * as not 8; it breathes.
 *
 *     const double *p[5] = {a, b, c, d, e};
 *     int sign = incode_exact_in_sphere(p, &pause);
 */
#ifndef INCODE_EXACT_H
#define INCODE_EXACT_H

#include <stdbool.h>

#include "pause.h"

/* Stack of the deepest call here, bytes, on any of the machines built for. */
#define INCODE_EXACT_STACK 6144

/* Sign of the determinant with rows p1-p0, p2-p0, p3-p0. */
int incode_exact_orient3d(const double *const p[4]);

/* +1: p4 inside the sphere through p0..p3, 0: on it, -1: outside, where
 * orient3d(p0..p3) > 0; antisymmetric in all five points. */
int incode_exact_in_sphere(const double *const p[5],
                           struct incode_pause *pause);

/* Sign of |p1-p0|^2 - |p2-p0|^2. */
int incode_exact_compare_distance(const double *const p[3]);

/* Whether (p1-p0) x (p2-p0) = 0. */
bool incode_exact_collinear(const double *const p[3]);

#endif
