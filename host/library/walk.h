/* Point location by visibility walks: from a tetrahedron through a facet that
 * has the query on its other side, until there is none.
 *
 * Each step lowers the power of the query with respect to the circumsphere, the
 * perturbation of ties included, so that no walk meets a tetrahedron twice
 * (Edelsbrunner, Combinatorica 10:251-260, 1990; Devillers, Pion and Teillaud,
 * IJFCS 13:181-199, 2002).  Hulls are convex: a walk that leaves through a
 * facet of the hull has its query outside. */
#ifndef HOST_LIBRARY_WALK_H
#define HOST_LIBRARY_WALK_H

#include "call.h"
#include "incode/predicates/predicates.h"

struct library_mesh {
    const double *xyz;
    uint64_t points;
    const struct incode_tetrahedra *t; /* with neighbours */
};

struct library_query {
    double at[3];
    uint64_t number;
};

enum { LIBRARY_STARS = 64, LIBRARY_STAR_FIRST = 128 };

/* What one thread keeps between its queries.
 *
 * Memory: 3 KB, and up to 24 bytes for each tetrahedron of the largest star of
 * a vertex that a query has been on. */
struct library_walker {
    struct incode_tally tally;
    uint32_t last; /* where the last walk has ended */
    /* Of large stars: vertices + 1, and the lowest tetrahedron. */
    struct {
        uint64_t key, lowest;
    } star[LIBRARY_STARS];
    /* A star while it is gathered: its tetrahedra in the order in which they
     * are found, and a hash table of them, twice as large.  Within `own` until
     * it is too small; then in memory of the call. */
    uint32_t *list, *table;
    uint32_t own[3 * LIBRARY_STAR_FIRST];
    uint64_t room; /* of the list */
};

void library_walker_begin(struct library_walker *walker,
                          const struct library_mesh *mesh);
void library_walker_end(struct library_walker *walker);

/* Writes the answers of `count` queries, best in an order along which
 * neighbours are close, to found[number].  INCODE_BAD_ARGUMENT: the result is
 * damaged.  INCODE_NO_MEMORY: a star does not fit.  When the call is cancelled,
 * some are left out. */
enum incode_status library_walk(struct library_walker *walker,
                                const struct library_mesh *mesh,
                                const struct library_query *query,
                                uint64_t count, uint64_t *found);

#endif
