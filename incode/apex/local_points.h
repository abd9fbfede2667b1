/* The points around one leaf, copied out of their pages once for its (up to 8)
 * vertices; and of these the points around one vertex, relative to it, scanned
 * for every tetrahedron that is built there.  Far vertices are appended as they
 * are met.
 *
 * Memory: struct incode_local_points, about 43 KB.  Work: one walk a leaf, one
 * pass a vertex; a scan looks at every point around the vertex, a vector at a
 * time in single precision, and leaves what its error bound cannot tell to the
 * exact predicates.
 *
 *     incode_local_around(&local, &walker, &horizon, leaf, lo, hi, radius);
 *     incode_local_centre(&local, v, p, radius, lo, hi);
 *     count = incode_local_first(&local, &pencil, &t, out);   // by distance
 *     count = incode_local_inside(&local, &sphere, out);
 */
#ifndef INCODE_LOCAL_POINTS_H
#define INCODE_LOCAL_POINTS_H

#include <stdalign.h>
#include <stdint.h>

#include "horizon.h"

enum {
    INCODE_AROUND_POINTS = 768, /* around a leaf */
    INCODE_AROUND_EXTRA = 64,   /* far vertices */
    INCODE_AROUND_ALL = INCODE_AROUND_POINTS + INCODE_AROUND_EXTRA + 16,
    INCODE_NEAR_POINTS = 192, /* around a vertex */
    INCODE_NEAR_ALL = INCODE_NEAR_POINTS + INCODE_AROUND_EXTRA + 32,
    INCODE_LOCAL_NONE = 0xffff
};

struct incode_local_points {
    struct incode_pause *pause; /* or NULL */
    /* Around the vertex: relative to p0 and scaled; w = |p|^2; e: of this the
     * error of n . p is at most max|n|; at: the point's index below. */
    alignas(64) float x[INCODE_NEAR_ALL];
    alignas(64) float y[INCODE_NEAR_ALL];
    alignas(64) float z[INCODE_NEAR_ALL];
    alignas(64) float w[INCODE_NEAR_ALL];
    alignas(64) float e[INCODE_NEAR_ALL];
    alignas(64) uint32_t at[INCODE_NEAR_ALL];
    alignas(64) uint32_t near_id[INCODE_NEAR_ALL];
    uint32_t near; /* how many, with far vertices */
    double reach;  /* |x| + |y| + |z| of them is at most this */
    double doubt;  /* absolute error of their coordinates */
    /* Around the leaf, then the far vertices: absolute, and (the former alone)
     * in units of 1 / per_unit from origin, cut to whole ones. */
    alignas(64) double p[3][INCODE_AROUND_ALL];
    alignas(64) int32_t unit[3][INCODE_AROUND_ALL];
    alignas(64) uint32_t id[INCODE_AROUND_ALL];
    double origin[3], per_unit;
    uint32_t around, count; /* copied from the box; with the far ones */
    uint32_t leaf;          /* vertex number / 8, or INCODE_NONE */
    uint32_t pages_max;     /* that a walk may need */
    double around_lo[3], around_hi[3];
    uint32_t vertex, self; /* its number, its index in p */
    double p0[3], scale, radius;
    double lo[3], hi[3];        /* absolute: every point within is at hand */
    double rlo[3], rhi[3];      /* the same, relative; infinite where the domain
                                   ends before */
    alignas(64) double wall[8]; /* rhi, infinity, -rlo, infinity */
    struct incode_query query;
};

enum incode_local_outcome {
    INCODE_LOCAL_READY,
    INCODE_LOCAL_WAIT,   /* for page query.missing */
    INCODE_LOCAL_CROWDED /* too many points or pages: try a smaller box */
};

/* Forgets what is around the last leaf. */
void incode_local_reset(struct incode_local_points *local);

/* Copies every point of the box lo..hi widened by radius on all sides. */
enum incode_local_outcome
incode_local_around(struct incode_local_points *local,
                    struct incode_walker *walker,
                    const struct incode_horizon *horizon, uint32_t leaf,
                    const double lo[3], const double hi[3], double radius);

/* Selects the points of the box of half-width radius, at most that of the
 * leaf's box, around the vertex at p; a crowded box is made smaller.  domain:
 * tight box of all points. */
void incode_local_centre(struct incode_local_points *local, uint32_t vertex,
                         const double p[3], double radius,
                         const double domain_lo[3], const double domain_hi[3]);

/* Index of a vertex among the local points, or INCODE_LOCAL_NONE.  It counts
 * as one around the vertex from now on: it is likely an apex again. */
uint32_t incode_local_find(struct incode_local_points *local, uint32_t id);

/* Appends a far vertex; INCODE_LOCAL_NONE: full. */
uint32_t incode_local_append(struct incode_local_points *local, uint32_t id,
                             const double p[3]);

/* Relative coordinates of point i, in double precision. */
static inline void
incode_local_relative(const struct incode_local_points *local, uint32_t i,
                      double r[3]) {
    for (int d = 0; d < 3; d++)
        r[d] = (local->p[d][i] - local->p0[d]) * local->scale;
}

/* Points around the vertex that may lie beyond the face and no later in the
 * pencil than a certain one of them: *t is the upper bound.  None that is left
 * out lies in the closed sphere of that t beyond the face.  The face's own
 * vertices are among them as a rule.  Returns how many, 0 where none is
 * certain to be beyond the face. */
uint32_t incode_local_first(const struct incode_local_points *local,
                            const struct incode_pencil *pencil, double *t,
                            uint16_t out[INCODE_NEAR_ALL]);

/* The points around the vertex that are not certainly outside the sphere;
 * returns how many. */
uint32_t incode_local_inside(const struct incode_local_points *local,
                             const struct incode_sphere *s,
                             uint16_t out[INCODE_NEAR_ALL]);

#endif
