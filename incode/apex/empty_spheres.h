/* Empty spheres met before, and what they tell of a search among points that
 * lie on one sphere up to rounding: all of them are in doubt about a
 * candidate's sphere, and boxes say nothing.  But no point is inside the sphere
 * of a tetrahedron; so a point that beats the candidate lies, in power, nearer
 * to the candidate's sphere than to any of these, which is a half-space
 * (Aurenhammer, SIAM J. Comput. 16, 1987).  Near the face, it leaves a sliver
 * of the set.
 *
 * Memory: struct incode_empty_spheres, about 1 KB.  Work: constant.
 *
 *     incode_empty_spheres_add(&empty, tetrahedron, scale);
 *     incode_radical_bound_set(&c, &empty, tetrahedron, scale, n);
 *     if (incode_dot(c.g, r) > c.level + c.slack * sum)   // |x| + |y| + |z|
 *         outside = true;
 */
#ifndef INCODE_EMPTY_SPHERES_H
#define INCODE_EMPTY_SPHERES_H

#include <stdbool.h>
#include <stdint.h>

#include "sphere.h"

enum {
    INCODE_EMPTY_SPHERES = 8,
    INCODE_RADICAL_UNITS = 150 /* of work (incode/predicates/pause.h) */
};

/* The sphere of four points. */
struct incode_circum {
    double p[3], scale;        /* relative: (x - p) * scale, p the first */
    struct incode_dd twice[3]; /* the centre, doubled, relative */
    double error;              /* of each of these */
    double thickness;          /* of the tetrahedron */
};

struct incode_empty_spheres {
    struct incode_circum sphere[INCODE_EMPTY_SPHERES];
    uint32_t count, next;
};

/* Adds the sphere of a Delaunay tetrahedron; of several that are nearly the
 * same, that of the thickest is kept.  scale: a power of two by which it is of
 * size 1 about. */
void incode_empty_spheres_add(struct incode_empty_spheres *e,
                              const double *const p[4], double scale);

/* g . r > level + slack (|x| + |y| + |z|): r = (x, y, z), relative and scaled,
 * is outside. */
struct incode_radical_bound {
    bool set;
    double g[3], level, slack;
};

/* What is known to lie outside the sphere of four points, the first of which r
 * is relative to; n: the direction in which it matters. */
void incode_radical_bound_set(struct incode_radical_bound *c,
                              const struct incode_empty_spheres *e,
                              const double *const p[4], double scale,
                              const double n[3]);

#endif
