/* The plane of a face and the sphere through it and an apex, in coordinates
 * relative to the face's first vertex v and scaled by a power of two, with
 * forward error bounds: a small multiple of the unit roundoff times bounds of
 * the terms from the maximum norms (Higham, Accuracy and Stability, chapter 3).
 *
 *   plane:  n . p > 0                  p lies on the unknown side
 *   sphere: m . p - det |p|^2 > 0      p lies inside */
#ifndef INCODE_SPHERE_H
#define INCODE_SPHERE_H

#include <stdbool.h>
#include <stdint.h>

#include "incode/predicates/double_double.h"

struct incode_sphere {
    double n[3], pn[3]; /* plane; |error of n[d] x| <= EPS pn[d] |x| */
    double m[3], pm[3]; /* sphere; likewise */
    double det, pdet;
    double lb, lc, bb, cc; /* of b and c: maximum norm, square */
    bool has_apex;
};

/* The line of spheres through a face's circle, in the same coordinates: the
 * centres are c0 + (t/2) n, n a unit vector. */
struct incode_pencil {
    double c0[3], n[3];
    double size; /* of the face, or how far c0 is */
};

/* Rounding of every step from the coordinates on stays below 20 units; what
 * underflows stays below the absolute term, for points within 2^200. */
#define INCODE_SPHERE_EPS 3.6e-15
#define INCODE_SPHERE_TINY 1e-250
/* Smaller determinants are left to the predicates. */
#define INCODE_SPHERE_LEAST 1e-100

static inline void incode_cross(double out[3], const double a[3],
                                const double b[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double incode_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline double incode_max_norm(const double a[3]) {
    /* The analyser forgets what another file's function filled.
     * NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage) */
    double x = __builtin_fabs(a[0]), y = __builtin_fabs(a[1]),
           z = __builtin_fabs(a[2]);
    double l = x > y ? x : y;
    return l > z ? l : z;
}

static inline double incode_dd_max_norm(const struct incode_dd a[3]) {
    const double hi[3] = {a[0].hi, a[1].hi, a[2].hi};
    return incode_max_norm(hi);
}

/* Of a nearer point, underflow may have left no direction. */
#define INCODE_PENCIL_LEAST 1e-240

/* The place of a point in the pencil; false: the point is not clearly beyond
 * the face. */
static inline bool incode_pencil_place(const struct incode_pencil *pencil,
                                       const double r[3], double *t) {
    double beyond = incode_dot(pencil->n, r), far = incode_max_norm(r);
    if (!(beyond >
          2e-3 * (far > INCODE_PENCIL_LEAST ? far : INCODE_PENCIL_LEAST)))
        return false;
    *t = (incode_dot(r, r) - 2 * incode_dot(pencil->c0, r)) / beyond;
    return true;
}

/* A place that is certainly not before that of a point placed at t. */
static inline double incode_pencil_later(const struct incode_pencil *pencil,
                                         double t) {
    return t + 1e-6 * (__builtin_fabs(t) + pencil->size);
}

void incode_sphere_plane(struct incode_sphere *s, const double b[3],
                         const double c[3]);
void incode_sphere_apex(struct incode_sphere *s, const double b[3],
                        const double c[3], const double a[3]);

/* Cancellation has left so little of n, of m or of det that their error bounds
 * would leave nearly every point in doubt (points on a line or plane up to
 * rounding). */
static inline bool
incode_plane_is_ill_conditioned(const struct incode_sphere *s) {
    return incode_max_norm(s->pn) > 1024 * incode_max_norm(s->n);
}

static inline bool
incode_sphere_is_ill_conditioned(const struct incode_sphere *s) {
    double det = __builtin_fabs(s->det), m = incode_max_norm(s->m);
    return s->pdet > 1024 * det || incode_max_norm(s->pm) > 1024 * m;
}

/* So ill-conditioned, or so much larger than its face, that it does not
 * separate points that are coplanar up to rounding. */
static inline bool
incode_sphere_is_near_degenerate(const struct incode_sphere *s) {
    double size = s->lb > s->lc ? s->lb : s->lc;
    return !(s->det > 1e9 * INCODE_SPHERE_EPS * s->pdet) ||
           !(s->det > INCODE_SPHERE_LEAST) ||
           incode_max_norm(s->m) > 1e6 * size * s->det;
}

/* Plane and sphere in twice the precision, from absolute coordinates. */
struct incode_fine {
    struct incode_dd n[3], m[3], det;
};

/* a: NULL for the plane alone. */
void incode_sphere_fine(struct incode_fine *f, const double v[3],
                        const double b[3], const double c[3], const double *a,
                        double scale);

enum { INCODE_FINE_UNITS = 32 }; /* of incode/predicates/yield.h, at the most */

/* Sharpens the bounds of an ill-conditioned plane or sphere; where that is not
 * enough, computes it again from absolute coordinates in twice the precision,
 * so that only the evaluation's own rounding is left in the bounds.  a: NULL
 * for the plane alone. */
void incode_sphere_refine(struct incode_sphere *s, const double v[3],
                          const double b[3], const double c[3], const double *a,
                          double scale);

static inline double incode_sphere_value(const struct incode_sphere *s,
                                         const double p[3]) {
    return incode_dot(s->m, p) - s->det * incode_dot(p, p);
}

static inline double incode_absolute_dot(const double a[3], const double p[3]) {
    return a[0] * __builtin_fabs(p[0]) + a[1] * __builtin_fabs(p[1]) +
           a[2] * __builtin_fabs(p[2]);
}

static inline double incode_sphere_error(const struct incode_sphere *s,
                                         const double p[3]) {
    return INCODE_SPHERE_EPS *
               (incode_absolute_dot(s->pm, p) + s->pdet * incode_dot(p, p)) +
           INCODE_SPHERE_TINY;
}

static inline double incode_plane_error(const struct incode_sphere *s,
                                        const double p[3]) {
    return INCODE_SPHERE_EPS * incode_absolute_dot(s->pn, p) +
           INCODE_SPHERE_TINY;
}

/* Empty spheres of earlier searches, for searches among points that lie on one
 * sphere up to rounding.  The filter is uncertain about every such point in a
 * candidate's sphere, and boxes exclude none.  But no point is inside the
 * sphere of a tetrahedron.  So a point that beats the candidate has a smaller
 * power with respect to the candidate's sphere than to any of these spheres,
 * which bounds it by a half-space (Aurenhammer, SIAM J.  Comput.  16, 1987).
 * Near the face, only a sliver of the set remains.
 *
 * Memory: struct incode_empty_spheres, about 1 KB. */

enum {
    INCODE_EMPTY_SPHERES = 8,
    INCODE_RADICAL_UNITS = 150 /* of work (incode/predicates/yield.h) */
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

/* A half-space known to lie outside the sphere of four points; r is relative to
 * the first. n: the direction of interest. */
void incode_radical_bound_set(struct incode_radical_bound *c,
                              const struct incode_empty_spheres *e,
                              const double *const p[4], double scale,
                              const double n[3]);

/* Half-spaces that hold every point, for a face that lies in a side of the hull
 * up to rounding.  The filter is uncertain about all points that are coplanar
 * with such a face up to rounding, and a sphere through the face does not bound
 * its apex.  But no point lies above the half-space, so the points that beat
 * the best so far lie in a ball (incode_near_degenerate_lessen). */

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

enum { INCODE_LESSEN_UNITS = 64 }; /* of work (incode/predicates/yield.h) */

/* Shrinks degenerate->ball: no point outside the ball comes before p[3] in
 * Delaunay distance from the face (p[0], p[1], p[2]).  The ball does not change
 * if neither the face's circle nor a half-space bounds it.  A ball that is
 * valid for a point is valid for all points before it. */
void incode_near_degenerate_lessen(struct incode_near_degenerate *degenerate,
                                   const double *const p[4], double scale);

/* Sets the sphere alone. */
void incode_near_degenerate_sphere(struct incode_near_degenerate *degenerate,
                                   const double *const p[4], double scale);

/* Whether a point is certainly outside the sphere of the last point tested.
 * The predicates would find the same at several times the cost. */
bool incode_near_degenerate_outside(
    const struct incode_near_degenerate *degenerate, const double pv[3],
    const double p[3], double scale);

/* n . ((x - p) scale) */
struct incode_dd
incode_half_space_height(const struct incode_half_space *half_space,
                         const double x[3]);

#endif
