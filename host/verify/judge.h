/* Facts about single tetrahedra and facets against all points, exact, for a few
 * of them at a time.
 *
 * Memory: 48 bytes a brick (64 vertex numbers), made once.  Work: a box test
 * for each 64 bricks, and for each of these that the sphere or half-space
 * touches, a box test a brick; an exact test for each point of the bricks
 * touched. */
#ifndef HOST_JUDGE_H
#define HOST_JUDGE_H

#include "check.h"

/* Boxes lo[3], hi[3] of bricks, and of groups of 64 bricks, an array for each
 * coordinate.  Several threads may use a judge at once. */
struct host_judge {
    struct host_sites sites;
    double *side[6]; /* [bricks + groups] each: lo x y z, hi x y z */
    uint64_t bricks, groups;
};

int host_judge_make(struct host_judge *judge, const struct host_sites *sites,
                    struct host_error *error);
void host_judge_free(struct host_judge *judge);

/* Whether t is positive and no point lies inside its sphere (tie rule): it
 * belongs to the Delaunay triangulation.  The numbers must be vertices. */
bool host_judge_tetrahedron(const struct host_judge *judge,
                            const uint32_t t[4]);

/* The apex for facet f on its positive side (orient3d(f0, f1, f2, apex) > 0):
 * if f has a Delaunay tetrahedron there, it is the one with this vertex.
 * INCODE_NONE: no point is on that side, and f lies on the hull. */
uint32_t host_judge_apex(const struct host_judge *judge, const uint32_t f[3]);

/* Whether any point lies on the positive side of f. */
bool host_judge_beyond(const struct host_judge *judge, const uint32_t f[3]);

#endif
