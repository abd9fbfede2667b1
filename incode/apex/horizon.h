/* The whole set as seen from one brick: near bricks one by one, farther bricks
 * in boxes of the tree, which are split when a search needs their children.
 * Most searches beyond the local points end here without a walk: they test the
 * boxes in one pass, many at a time, and read points only in boxes that matter.
 *
 * A search asks which points may lie in a cap: beyond the face and inside a
 * sphere through it, D |y|^2 - M . y < 0 relative to the face's vertex.  So
 * spheres of any size, planes among them, are precise near the vertex.
 *
 * Memory: 106 bytes a box, for 128 to 320 of them, and 768 a copied brick,
 * given by its owner. */
#ifndef INCODE_HORIZON_H
#define INCODE_HORIZON_H

#include <stdalign.h>
#include <stddef.h>
#include <stdint.h>

#include "query.h"

enum {
    INCODE_HORIZON_MIN = 128, /* boxes */
    INCODE_HORIZON_MAX = 320, /* both multiples of 64 */
    INCODE_HORIZON_PADDING = 16,
    INCODE_HORIZON_COPIES = 128, /* at most */
    INCODE_NO_COPY = 0xff
};

/* What rounding to single precision and its arithmetic may do to the value of a
 * cap at a point, as a part of far (D far + |M|): the coordinates of the point
 * and of the vertex, half a unit each, in a gradient of 2 D far + |M|; six
 * roundings of a term and of the sum. */
#define INCODE_HORIZON_DOUBT 0x1p-20F
/* The value of `far` for a box that may be anywhere. */
#define INCODE_ANYWHERE 3e30F

/* Boxes along the axes and lifted ones (incode/pages/pages.h) in the horizon's
 * units; the numbers of all boxes stand together. */
struct incode_horizon {
    float *lo[3], *hi[3]; /* rounded outward */
    float *o[3], *a[3][3], *slope[3];
    float *lid;     /* -inf: it is not lifted */
    float *far;     /* coordinates are below */
    float *doubt;   /* of a lifted box */
    uint32_t *page; /* of the tree */
    uint32_t *left; /* of a box page: the children that have no box of their own
                       here */
    uint8_t *level; /* of the page; 0: a brick */
    uint8_t *copy;  /* of a brick's points, or INCODE_NO_COPY */
    uint32_t boxes; /* room for so many, a multiple of 64 */
    uint32_t count;
    uint32_t near;   /* so many from the start; the rest is split off later */
    uint32_t centre; /* brick, or INCODE_NONE */
    uint32_t self;   /* its index */
    double origin[3], scale;
    double box_lo[3], box_hi[3]; /* bricks that meet this box are listed */
    /* The points of some of the bricks, in the boxes' units. */
    float (*point)[3][INCODE_BRICK_POINTS];
    uint32_t room; /* for so many of them, up to INCODE_HORIZON_COPIES */
    uint32_t next; /* copy to be given away */
    uint16_t owner[INCODE_HORIZON_COPIES];
};

/* Bytes of so many boxes and copies, a multiple of 64. */
size_t incode_horizon_bytes(uint32_t boxes, uint32_t copies);

/* memory: so many bytes, aligned to 64.  boxes: INCODE_HORIZON_MIN to
 * INCODE_HORIZON_MAX, a multiple of 64; copies: 1 to INCODE_HORIZON_COPIES. */
void incode_horizon_init(struct incode_horizon *h, void *memory, uint32_t boxes,
                         uint32_t copies, struct incode_yield *yield);

/* Boxes that are listed from the start, at most; the others are for splitting.
 */
static inline uint32_t incode_horizon_near(const struct incode_horizon *h) {
    return h->boxes / 8 * 5;
}

/* A cap, beyond a face and inside a sphere: D |y|^2 - M . y < 0 < n . y, with y
 * = x - v in the horizon's units. */
struct incode_horizon_cap {
    float d, m[3], v[3], n[3];
    float peak[3];     /* M / 2 D, where the least value is */
    float m_sum, near; /* the sums of the components of M and v */
    /* Where it is bounded: g . y > level + slack far is outside, too. */
    bool bounded;
    float g[3], level, slack;
};

/* Makes the horizon of a brick; bricks that meet the box lo..hi are listed one
 * by one. */
enum incode_step incode_horizon_make(struct incode_horizon *h,
                                     struct incode_walker *walker,
                                     uint32_t brick, const double lo[3],
                                     const double hi[3], uint32_t *missing);

/* The cap of the sphere det |r|^2 = m . r beyond the plane n . r = 0, with r =
 * (x - pv) scale; det >= 0, of a half-space 0.  False: it is out of the range
 * of single precision. */
bool incode_horizon_cap(const struct incode_horizon *h,
                        struct incode_horizon_cap *cap, const double pv[3],
                        double scale, const double m[3], double det,
                        const double n[3]);

/* Bounds a cap by a radical plane (sphere.h), for r as above. */
void incode_horizon_bound(const struct incode_horizon *h,
                          struct incode_horizon_cap *cap, double scale,
                          const struct incode_radical_bound *radical);

/* Indices of the boxes in which points may lie in the cap, bricks and pages,
 * but for those of `done` (one bit each); returns how many.  Room for a vector
 * more is needed. */
uint32_t incode_horizon_reached(
    const struct incode_horizon *h, const struct incode_horizon_cap *cap,
    const uint64_t done[INCODE_HORIZON_MAX / 64],
    uint32_t index[INCODE_HORIZON_MAX + INCODE_HORIZON_PADDING]);

/* Splits a box page: lists one by one those of its children that the cap
 * reaches.  INCODE_WAITING: the page is missing.  INCODE_FULL: there is no room
 * for the children. */
enum incode_step incode_horizon_split(struct incode_horizon *h,
                                      struct incode_walker *walker,
                                      uint32_t index,
                                      const struct incode_horizon_cap *cap,
                                      uint32_t *missing);

/* Copies the points of a brick, which is in the frame, in place of the oldest
 * copy. */
void incode_horizon_copy(struct incode_horizon *h, uint32_t index,
                         const struct incode_frame *frame);

/* The points of a copied brick, one bit each, that are not certainly outside
 * the cap's sphere.  All are tested, without a branch.  Bits past the brick's
 * last point have no meaning. */
uint64_t incode_horizon_points(const struct incode_horizon *h, uint32_t index,
                               const struct incode_horizon_cap *cap);

/* Visits the leaves of listed bricks that meet the box of a query, which lies
 * in the horizon's.  INCODE_WAITING: query.missing is not there. */
enum incode_step incode_horizon_box(const struct incode_horizon *h,
                                    struct incode_walker *walker,
                                    struct incode_query *q, incode_visit *visit,
                                    void *context);

/* Whether all bricks that meet a box are listed. */
static inline bool incode_horizon_holds(const struct incode_horizon *h,
                                        const double lo[3],
                                        const double hi[3]) {
    bool holds = true;
    for (int d = 0; d < 3; d++)
        holds = holds && lo[d] >= h->box_lo[d] && hi[d] <= h->box_hi[d];
    return holds;
}

/* Local points.  The points around one leaf are copied from their pages once
 * for its (up to 8) vertices.  From these the points around one vertex are
 * selected, relative to it, and scanned for every tetrahedron that is built
 * there.  Far vertices are appended when a search meets them.
 *
 * Memory: struct incode_local_points, about 43 KB. */

enum {
    INCODE_AROUND_POINTS = 768, /* around a leaf */
    INCODE_AROUND_EXTRA = 64,   /* far vertices */
    INCODE_AROUND_ALL = INCODE_AROUND_POINTS + INCODE_AROUND_EXTRA + 16,
    INCODE_NEAR_POINTS = 192, /* around a vertex */
    INCODE_NEAR_ALL = INCODE_NEAR_POINTS + INCODE_AROUND_EXTRA + 32,
    INCODE_LOCAL_NONE = 0xffff
};

struct incode_local_points {
    struct incode_yield *yield; /* or NULL */
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

/* Hits: the points in the current ball of the search of a regular face, and
 * their places in the face's pencil of spheres.  Many are placed at a time.
 * The first of them in the pencil shrinks the ball, and points outside the ball
 * are dropped when room is needed.  The predicates decide among the rest.
 *
 * Memory: struct incode_hits, about 5 KB. */

enum { INCODE_HITS = 128 /* kept at a time */ };

/* t: where in the pencil, infinite where the point is not clearly beyond the
 * face. */
struct incode_hits {
    alignas(64) double p[3][INCODE_HITS];
    alignas(64) double t[INCODE_HITS];
    uint32_t id[INCODE_HITS], count;
    uint32_t placed; /* so many of them, at least, have a place */
};

/* The query's ball becomes that of the pencil's sphere at t, widened by 1e-6 of
 * its size. */
void incode_hits_draw_in(struct incode_query *q,
                         const struct incode_pencil *pencil, double t);

/* Adds the points of a brick whose bits are set; false: there are too many in
 * the ball. */
bool incode_hits_add(const struct incode_pencil *pencil, struct incode_query *q,
                     const struct incode_frame *frame, uint64_t in,
                     struct incode_hits *hits);

/* Sets the places that are missing, and draws the ball in to the first of them.
 */
void incode_hits_place(struct incode_query *q,
                       const struct incode_pencil *pencil,
                       struct incode_hits *hits);

/* Whether a hit may be the first, or tie with one placed at `last`. */
bool incode_hits_contends(const struct incode_query *q,
                          const struct incode_hits *hits, uint32_t i,
                          double last);

#endif
