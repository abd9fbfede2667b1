/* A MakeTetra under way, shared by apex.c (among the local points) and
 * around.c (among the bricks around).
 *
 * Memory: the struct.  Work: constant a call.
 *
 *     if (incode_cap_fits(local->wall, &make.pencil, place))
 *         apex = local->id[make.best];   // no point outside can beat it
 */
#ifndef INCODE_APEX_H
#define INCODE_APEX_H

#include "search.h"

struct incode_make {
    struct incode_maker *maker;
    const double *pv, *pb, *pc;
    double store[4][3];  /* those, and the best */
    uint32_t b, c;       /* indices among the local points */
    uint32_t best;       /* likewise, or INCODE_LOCAL_NONE */
    bool bare;           /* the best's sphere and place in store are not set */
    double rb[3], rc[3]; /* b and c relative to v */
    struct incode_sphere sphere;
    bool doubtful; /* no local sphere tells where the apex is */
    bool regular;  /* the face is neither thin nor out of the range of floats */
    struct incode_pencil pencil; /* of a regular face */
    struct incode_near_degenerate degenerate;
};

/* Whether the closed cap, beyond the face, of the sphere at t of the pencil
 * lies strictly within a box: walls as in struct incode_local_points.  Where an
 * extreme point of the sphere is on the known side, the rim of the face's
 * circle is the extreme.  Everything is widened by 1e-6 of the sphere's size.
 */
bool incode_cap_fits(const double walls[8], const struct incode_pencil *pencil,
                     double t);
/* The same for a sphere of any face; an ill-conditioned one never fits. */
bool incode_sphere_fits(const double walls[8], const struct incode_sphere *s);

/* Sets the sphere of a bare best. */
void incode_make_sphere(struct incode_make *make);

/* Begins the search beyond the local points, with the best so far. */
void incode_search_from(struct incode_make *make, struct incode_search *s);
enum incode_near {
    INCODE_NEAR_FOUND, /* *apex is certain */
    INCODE_NEAR_HULL,  /* no point lies beyond the face */
    INCODE_NEAR_SEARCH /* only the whole set can tell: *s is begun */
};
/* MakeTetra among the local points for the face (vertex, b, c); b, c and *apex
 * are indices among them. */
enum incode_near incode_apex_near(struct incode_maker *m, uint32_t b,
                                  uint32_t c, uint32_t *apex,
                                  struct incode_search *s);

/* ---- around.c ---- */

/* Goes on among the bricks around: true where they decide, with query.best the
 * apex; false: the search is ready to go on with the tree. */
bool incode_apex_around(struct incode_make *make, struct incode_search *s);

#endif
