/* The sphere of a cell, or the half-space beyond the facet of an infinite one,
 * to tell it from boxes of points: what is told apart holds none of them, up to
 * every rounding; what is not may.
 *
 * Memory: struct incode_region, 112 bytes.  Work: constant.
 *
 *     if (!incode_region_set_sharp(&r, &x, cell, scale))
 *         incode_region_set_all(&r);
 *     incode_regions_set(&regions, 5, &r);
 *     may_hold = incode_regions_meeting(&regions, 1 << 5, lo, hi) != 0;
 */
#ifndef INCODE_REGION_H
#define INCODE_REGION_H

#include <stdalign.h>

#include "incode/complex/complex.h"
#include "incode/pages/boxes.h"

/* |p - o|^2 - X (p - o) < 0, or X (p - o) > 0, but for the errors of X. */
struct incode_region {
    double o[3], x[3], error[3];
    double centre[3], square; /* of a ball that holds the sphere */
    bool infinite;
};

/* As the cell keeps it; false: nothing is known. */
bool incode_region_set(struct incode_region *r, const struct incode_complex *x,
                       const struct incode_cell *c);

/* The same from its points, with bounds of the errors of each component; false:
 * nothing is known.  scale: 2^k, of relative coordinates. */
bool incode_region_set_sharp(struct incode_region *r,
                             const struct incode_complex *x,
                             const struct incode_cell *c, double scale);

/* All of space. */
void incode_region_set_all(struct incode_region *r);

/* Whether a box reaches to or beyond a facet's plane. */
bool incode_region_is_behind(const struct incode_region *r, const double lo[3],
                             const double hi[3]);

/* Some regions, side by side. */
enum { INCODE_REGIONS = 64 };

struct incode_regions {
    alignas(64) double o[3][INCODE_REGIONS];
    alignas(64) double x[3][INCODE_REGIONS];
    alignas(64) double error[3][INCODE_REGIONS];
    alignas(64) double centre[3][INCODE_REGIONS];
    alignas(64) double square[INCODE_REGIONS];
    alignas(64) double round[INCODE_REGIONS]; /* 1: a sphere, 0: half a space */
    uint64_t infinite;                        /* a bit each */
};

void incode_regions_set(struct incode_regions *regions, unsigned i,
                        const struct incode_region *r);

/* Those of some regions, a bit each, that may hold a point of a box along the
 * axes. */
uint64_t incode_regions_meeting(const struct incode_regions *regions,
                                uint64_t some, const double lo[3],
                                const double hi[3]);

/* The same of a lifted box of a page. */
uint64_t incode_regions_meeting_lifted(const struct incode_regions *regions,
                                       uint64_t some,
                                       const struct incode_boxes *boxes,
                                       const struct incode_lifted *lifted);

#endif
