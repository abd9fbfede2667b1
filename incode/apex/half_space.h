/* Half-spaces that hold every point, and what they tell of a face that lies in
 * the hull's side up to rounding.  Points coplanar up to rounding are all in
 * doubt about such a face, and a sphere through it says nothing of where its
 * apex can be; but no point rises above the half-space, so the points that beat
 * the best so far lie in a ball (incode_near_degenerate_lessen).
 *
 * Memory: the structs.  Work: constant.
 *
 *     degenerate.half_spaces = half_spaces, degenerate.count = 8;
 *     incode_near_degenerate_lessen(&degenerate, tetrahedron, scale);
 */
#ifndef INCODE_HALF_SPACE_H
#define INCODE_HALF_SPACE_H

#include <stdbool.h>
#include <stdint.h>

#include "sphere.h"

/* n . ((x - p) scale) <= most for every point x. */
struct incode_half_space {
    double n[3], p[3], scale;
    double most[2]; /* high and low part */
};

/* Relative to v and scaled. */
struct incode_ball {
    double centre[3], radius;
};

/* A face among points coplanar up to rounding. */
struct incode_near_degenerate {
    bool known;
    bool regular; /* the face is not thin, and c0 is set */
    double c0[3]; /* centre of its circle, relative to v and scaled, right to
                     1e-9 */
    struct incode_ball ball;   /* the least so far; infinite at first */
    struct incode_fine sphere; /* through the last point asked */
    double spread;  /* its error over that of |r| + |r|^2; 0: it is not set */
    double lengths; /* product of those of its three edges at v */
    const struct incode_half_space *half_spaces;
    uint32_t count;
};

/* Whether a half-space faces as a direction does. */
bool incode_half_space_faces(const struct incode_half_space *half_space,
                             const double n[3]);

enum { INCODE_LESSEN_UNITS = 64 }; /* of work (incode/predicates/pause.h) */

/* Lessens degenerate->ball: no point outside it comes before p[3] in Delaunay
 * distance from the face (p[0], p[1], p[2]).  Nothing changes where neither the
 * face's circle nor a half-space tells, and what holds for one point holds for
 * all that come before it. */
void incode_near_degenerate_lessen(struct incode_near_degenerate *degenerate,
                                   const double *const p[4], double scale);

/* Sets the sphere alone. */
void incode_near_degenerate_sphere(struct incode_near_degenerate *degenerate,
                                   const double *const p[4], double scale);

/* Whether a point is certainly outside the sphere of the last one asked: the
 * predicates would say so at several times the cost. */
bool incode_near_degenerate_outside(
    const struct incode_near_degenerate *degenerate, const double pv[3],
    const double p[3], double scale);

/* n . ((x - p) scale) */
struct incode_dd
incode_half_space_height(const struct incode_half_space *half_space,
                         const double x[3]);

#endif
