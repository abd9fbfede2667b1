/* Half-spaces that hold every point, and what they tell of a face that lies in
 * the hull's side up to rounding.  Points flat up to rounding are all in doubt
 * about such a face, and a sphere through it says nothing of where its apex can
 * be; but no point rises above the half-space, so the points that beat the best
 * so far lie in a ball (incode_flat_lessen).
 *
 * Memory: the structs.  Work: constant.
 *
 *     flat.supports = supports, flat.count = 8;
 *     incode_flat_lessen(&flat, p, scale);
 */
#ifndef INCODE_SUPPORT_H
#define INCODE_SUPPORT_H

#include <stdbool.h>
#include <stdint.h>

#include "sphere.h"

/* n . ((x - p) scale) <= most for every point x. */
struct incode_support {
    double n[3], p[3], scale;
    double most[2]; /* high and low part */
};

/* Relative to v and scaled. */
struct incode_ball {
    double centre[3], radius;
};

/* A face among points flat up to rounding. */
struct incode_flat {
    bool known;
    bool regular; /* the face is not thin, and c0 is set */
    double c0[3]; /* centre of its circle, relative to v and scaled, right to
                     1e-9 */
    struct incode_ball ball;   /* the least so far; infinite at first */
    struct incode_fine sphere; /* through the last point asked */
    double spread;  /* its error over that of |r| + |r|^2; 0: it is not set */
    double lengths; /* product of those of its three edges at v */
    const struct incode_support *supports;
    uint32_t count;
};

/* Whether a support faces as a direction does. */
bool incode_support_faces(const struct incode_support *support,
                          const double n[3]);

/* Lessens flat->ball: no point outside it comes before p[3] in Delaunay
 * distance from the face (p[0], p[1], p[2]).  Nothing changes where neither the
 * face's circle nor a support tells, and what holds for one point holds for all
 * that come before it. */
void incode_flat_lessen(struct incode_flat *flat, const double *const p[4],
                        double scale);

/* Sets the sphere alone. */
void incode_flat_sphere(struct incode_flat *flat, const double *const p[4],
                        double scale);

/* Whether a point is certainly outside the sphere of the last one asked: the
 * predicates would say so at several times the cost. */
bool incode_flat_outside(const struct incode_flat *flat, const double pv[3],
                         const double p[3], double scale);

/* n . ((x - p) scale) */
struct incode_dd incode_support_height(const struct incode_support *support,
                                       const double x[3]);

#endif
