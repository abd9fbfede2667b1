/* The last stage of the predicates: their polynomials, summed without rounding
 * for all finite doubles.
 *
 * Every monomial is a product of at most three coordinates, so of at most 159
 * bits; it is added into one long fixed-point number that spans the exponents
 * actually present (Kulisch's accumulator).  Differences are never formed, so
 * nothing can overflow, underflow or be rounded.  in_sphere is a sum of squares
 * of coordinates times orient3d, first with the highest limbs only.
 *
 * Memory: at most 6 KB of stack (INCODE_EXACT_STACK).  Work: 24 (orient3d), 12
 * (compare_distance) or 18 (collinear) monomials; in_sphere 5 times orient3d
 * and, with the widest exponents, up to 15 products of 5 limbs and 200 limbs, 8
 * in half of the calls; it yields. */
#ifndef INCODE_EXACT_H
#define INCODE_EXACT_H

#include <stdbool.h>
#include <stdint.h>

#include "yield.h"

/* Stack of the deepest call here, bytes, on any of the machines built for. */
#define INCODE_EXACT_STACK 6144

/* Sign of the determinant with rows p1-p0, p2-p0, p3-p0. */
int incode_exact_orient3d(const double *const p[4]);

/* +1: p4 inside the sphere through p0..p3, 0: on it, -1: outside, where
 * orient3d(p0..p3) > 0; antisymmetric in all five points. */
int incode_exact_in_sphere(const double *const p[5],
                           struct incode_yield *yield);

/* Sign of |p1-p0|^2 - |p2-p0|^2. */
int incode_exact_compare_distance(const double *const p[3]);

/* Whether (p1-p0) x (p2-p0) = 0. */
bool incode_exact_collinear(const double *const p[3]);

/* The predicates on integers: coordinate differences written as multiples of
 * one common power of two, which is possible for data with similar exponents
 * (floats, grids, and doubles at most 60 binary places below the largest
 * difference).  Zeros cost no more here than other signs.
 *
 * Memory: under 1 KB of stack.  Work: 12 (orient3d) or 44 to 72 (in_sphere)
 * products of 64-bit words. */

/* d[i] = (p[i] - origin) * 2^k for some k, exactly, with |d[i][j]| <= 2^61;
 * count <= 4, most = the largest |p[i][j] - origin[j]| as rounded.  False
 * where there is no such k: d is then undefined. */
bool incode_fixed_differences(int64_t d[][3], const double *const p[],
                              int count, const double origin[3], double most);

/* Sign of det(d), exact for |d[i][j]| <= 2^61. */
int incode_fixed_orient3d(const int64_t d[3][3]);

/* Sign of -det with rows (d[i], |d[i]|^2), exact for |d[i][j]| <= 2^61, never
 * 0: in_sphere of the origin, ties broken as in tie.h.  Precondition: the four
 * points and the origin are distinct, orient3d of the four is positive.
 * `near_zero`: the caller knows |det| to be below 2^-41 times the fifth power
 * of the largest |d[i][j]|, as it is where the static filter failed; one word
 * then holds what otherwise takes two. */
int incode_fixed_in_sphere(const int64_t d[4][3], bool near_zero);

/* Sign of |d[0]|^2 - |d[1]|^2, exact for |d[i][j]| <= 2^61. */
int incode_fixed_compare_norm(const int64_t d[2][3]);

/* Whether d[0] x d[1] = 0, exact for |d[i][j]| <= 2^61. */
bool incode_fixed_parallel(const int64_t d[2][3]);

/* The first two from 32-bit words alone, for processors without a 128-bit
 * product; on the others they are there for comparison. */
int incode_fixed_orient3d_portable(const int64_t d[3][3]);
int incode_fixed_in_sphere_portable(const int64_t d[4][3]);

/* The predicates in double-double arithmetic, each number the sum of two
 * doubles, for points whose coordinates span too many binary places to be
 * integers of one word.  They decide every sign except zeros and values close
 * to zero.
 *
 * Memory: under 1 KB of stack.  Work: some 1,000 (orient3d) or 3,000
 * (in_sphere) operations at most, without branches. */

/* True: *sign is that of incode_exact_orient3d, and not 0.  most = the largest
 * |p[i][k] - p[0][k]| as rounded. */
bool incode_pair_orient3d(const double *const p[4], double most, int *sign);

/* True: *sign is that of incode_exact_in_sphere, and not 0.  most = the
 * largest |p[i][k] - p[4][k]| as rounded. */
bool incode_pair_in_sphere(const double *const p[5], double most, int *sign);

/* The predicates in doubles, for points with coordinates of very different
 * exponents: axes and rows are scaled by powers of two, and the bound of the
 * error is that of the terms themselves.
 *
 * Memory: under 1 KB of stack.  Work: up to 4 times 150 (orient3d) or 5 times
 * 400 (in_sphere) operations.
 *
 * True: *sign is that of the exact predicate, as above. */
bool incode_scaled_orient3d(const double *const p[4], double most, int *sign);
bool incode_scaled_in_sphere(const double *const p[5], double most, int *sign);

#endif
