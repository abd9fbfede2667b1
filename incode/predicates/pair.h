/* The predicates in twice the precision, each number the sum of two doubles:
 * for points whose coordinates span too many binary places to be integers of
 * one word.  They tell all but true zeros and what is nearly one.
 *
 * Memory: under 1 KB of stack.  Work: some 1,000 (orient3d) or 3,000
 * (in_sphere) operations at most, without branches.
 *
 *     if (incode_pair_in_sphere(p, most, &sign))
 *         return sign;
 */
#ifndef INCODE_PAIR_H
#define INCODE_PAIR_H

#include <stdbool.h>

/* True: *sign is that of incode_exact_orient3d, and not 0.  most = the largest
 * |p[i][k] - p[0][k]| as rounded. */
bool incode_pair_orient3d(const double *const p[4], double most, int *sign);

/* True: *sign is that of incode_exact_in_sphere, and not 0.  most = the
 * largest |p[i][k] - p[4][k]| as rounded. */
bool incode_pair_in_sphere(const double *const p[5], double most, int *sign);

#endif
