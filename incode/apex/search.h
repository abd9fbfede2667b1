/* Searches of the whole set by the tree of boxes, the known planes of the hull,
 * and the maker's counts.  For the files of this room only. */
#ifndef INCODE_SEARCH_H
#define INCODE_SEARCH_H

#include "maker.h"

/* The fault of a caller that names a slot beyond the points of a brick. */
#define INCODE_NO_VERTEX "a face has a vertex that its brick has not"

/* Begins the search of the apex of (v, b, c). */
void incode_search_begin(struct incode_maker *m, struct incode_search *s,
                         const uint32_t f[3], const double pv[3],
                         const double pb[3], const double pc[3], double radius);

/* Continues it: INCODE_FINISHED with query.best (INCODE_NONE: a hull facet), or
 * INCODE_WAITING for query.missing, or INCODE_WORKED: the walker has no units
 * left. */
enum incode_step incode_search_run(struct incode_maker *m,
                                   struct incode_search *s);

/* Records the page that a walk waits for: INCODE_WAITING or INCODE_WORKED, as
 * above. */
enum incode_step incode_search_suspend(struct incode_search *s);

/* The next box of a search for a first candidate. */
void incode_search_box(struct incode_maker *m, struct incode_search *s);

/* The last pass: over every point that the best so far does not clearly beat,
 * or over every point if there is no best. */
void incode_search_last(struct incode_maker *m, struct incode_search *s);

/* Learns from a finished search of an apex: if many points were tested, the
 * sphere found is kept for the next searches. */
void incode_search_learn(struct incode_maker *m, const struct incode_query *q,
                         uint64_t looked);

/* Whether the face lies on a hull plane already certified, facing out. */
bool incode_hull_known(struct incode_maker *m, const double pv[3],
                       const double pb[3], const double pc[3]);

/* Remembers a hull facet; below: a place strictly on its known side. */
void incode_hull_remember(struct incode_maker *m, const struct incode_query *q,
                          const double below[3]);

/* Remembers a hull facet that a search has found. */
void incode_hull_learn(struct incode_maker *m, const struct incode_query *q);

/* The coordinates of a vertex; false: *page is missing. */
bool incode_fetch_point(struct incode_maker *m, uint32_t v, double p[3],
                        uint32_t *page);

/* Counts a finished MakeTetra and its candidates. */
void incode_count_candidates(struct incode_maker *m, uint64_t looked);

/* A MakeTetra under way, shared by apex.c (among the local points) and
 * around.c (among the bricks around). */

struct incode_make {
    struct incode_maker *maker;
    const double *pv, *pb, *pc;
    double store[4][3];  /* those, and the best */
    uint32_t b, c;       /* indices among the local points */
    uint32_t best;       /* likewise, or INCODE_LOCAL_NONE */
    bool bare;           /* the best's sphere and place in store are not set */
    double rb[3], rc[3]; /* b and c relative to v */
    struct incode_sphere sphere;
    bool doubtful; /* no local sphere bounds the apex */
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

/* Continues among the bricks around.  True: they decide, and query.best is the
 * apex.  False: the search is ready to continue in the tree. */
bool incode_apex_around(struct incode_make *make, struct incode_search *s);

#endif
