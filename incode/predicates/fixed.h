/* The predicates on integers: coordinate differences written as multiples of
 * one common power of two, which exact data of like exponents are (floats,
 * grids, and doubles at most 60 binary places below the largest difference).
 * True zeros cost here no more than other signs.
 *
 * Memory: under 1 KB of stack.  Work: 12 (orient3d) or 44 to 72 (in_sphere)
 * products of 64-bit words.
 *
 *     int64_t d[3][3];
 *     if (incode_fixed_differences(d, p + 1, 3, p[0], most))
 *         sign = incode_fixed_orient3d(d);
 */
#ifndef INCODE_FIXED_H
#define INCODE_FIXED_H

#include <stdbool.h>
#include <stdint.h>

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

#endif
