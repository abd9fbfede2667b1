/* The points around one vertex, copied out of their pages once and scanned for
 * every tetrahedron that is built there; far vertices are appended as they are
 * met.
 *
 * Memory: struct incode_gather, about 20 KB.  Work: one walk to fill; a scan
 * looks at every point, 16 at a time in single precision, and leaves what its
 * error bound cannot tell to the exact predicates.
 *
 *     incode_gather_fill(&g, &walker, v, p, radius);
 *     i = incode_gather_first(&g, n, c2);          nearest by Delaunay distance
 *     count = incode_gather_inside(&g, &sphere, out);     what may be inside
 */
#ifndef INCODE_GATHER_H
#define INCODE_GATHER_H

#include <stdalign.h>
#include <stdint.h>

#include "query.h"

enum {
    INCODE_GATHER_POINTS = 384,
    INCODE_GATHER_EXTRA = 64,
    INCODE_GATHER_ALL = INCODE_GATHER_POINTS + INCODE_GATHER_EXTRA,
    INCODE_GATHER_NONE = 0xffff
};

struct incode_gather {
    /* Relative to p0 and scaled; w = |p|^2, l = |x| + |y| + |z|. */
    alignas(64) float x[INCODE_GATHER_ALL];
    alignas(64) float y[INCODE_GATHER_ALL];
    alignas(64) float z[INCODE_GATHER_ALL];
    alignas(64) float w[INCODE_GATHER_ALL];
    alignas(64) float l[INCODE_GATHER_ALL];
    alignas(64) uint32_t id[INCODE_GATHER_ALL];
    double p[3][INCODE_GATHER_ALL]; /* absolute */
    double p0[3], scale, radius;
    double lo[3], hi[3];   /* absolute: every point within was copied */
    double rlo[3], rhi[3]; /* the same, relative; infinite where the domain
                              ends before */
    uint32_t vertex;
    uint32_t points, count; /* copied from the box; with the far ones */
    uint32_t pages, pages_max;
    struct incode_query query;
};

enum incode_gathered {
    INCODE_GATHER_READY,
    INCODE_GATHER_WAIT,   /* for page query.missing */
    INCODE_GATHER_CROWDED /* too many points or pages: try a smaller box */
};

/* Copies every leaf that meets the box of half-width radius around the vertex
 * at p; domain: tight box of all points. */
enum incode_gathered
incode_gather_fill(struct incode_gather *g, struct incode_walker *walker,
                   uint32_t vertex, const double p[3], double radius,
                   const double domain_lo[3], const double domain_hi[3]);

/* After INCODE_GATHER_CROWDED: keeps what was copied, but as no whole box. */
void incode_gather_disclaim(struct incode_gather *g);

/* Index of a vertex among the gathered, or INCODE_GATHER_NONE. */
uint32_t incode_gather_find(const struct incode_gather *g, uint32_t id);

/* Appends a far vertex; INCODE_GATHER_NONE: full. */
uint32_t incode_gather_append(struct incode_gather *g, uint32_t id,
                              const double p[3]);

/* Relative coordinates, in double precision. */
static inline void incode_gather_relative(const struct incode_gather *g,
                                          uint32_t i, double r[3])
{
    for (int d = 0; d < 3; d++)
        r[d] = (g->p[d][i] - g->p0[d]) * g->scale;
}

/* Of the points clearly on the positive side of the plane with unit normal n,
 * the one with the least (w - c2 . p) / (n . p), approximately. */
uint32_t incode_gather_first(const struct incode_gather *g, const double n[3],
                             const double c2[3]);

/* The points that are not certainly outside the sphere; returns how many. */
uint32_t incode_gather_inside(const struct incode_gather *g,
                              const struct incode_sphere *s,
                              uint16_t out[INCODE_GATHER_ALL]);

#endif
