/* Whether facets are the surface of a convex body, each part of it covered
 * once: exact.
 *
 * The facets must have Euler characteristic 2.  At each edge two facets must
 * meet, of opposite orientation, without a dent.  Seen from a point inside,
 * every facet must face away, and a ray in a chosen direction must cross one
 * facet only.  This is the check of Mehlhorn and others (Computational Geometry
 * 12:85-103, 1999): locally convex, and wound once.
 *
 * Memory: 40 bytes a facet, 5 a vertex number.  Work: O(f + vertex numbers), on
 * all threads; about 500 ns a facet.
 *
 *     struct host_hull hull = {.sites = &sites, .tets = &tets};
 *     if (host_hull_add(&hull, 7, 0, &error) != 0) // opposite corner 0
 *         return error.code;
 *     return host_hull_check(&hull, &listener, &error);
 */
#ifndef HOST_HULL_H
#define HOST_HULL_H

#include "check.h"

struct host_hull_facet {
    uint64_t tet;
    uint32_t corner;
};

/* Receives the faults that host_hull_check finds: called once for each, on any
 * thread, with 0 to 2 tetrahedra and 0 to 3 vertices. */
struct host_hull_listener {
    void *context;
    void (*fault)(void *context, const uint64_t *tets, int tet_count,
                  const uint32_t *vertices, int count, const char *what);
};

struct host_hull {
    const struct host_sites *sites;
    const struct host_tetrahedra *tets;
    struct host_hull_facet *facet;
    size_t count, capacity;
    uint64_t vertices; /* found by the check */
};

int host_hull_add(struct host_hull *hull, uint64_t tet, uint32_t corner,
                  struct host_error *error);

/* Checks the facets; their tetrahedra must be positive.  Other tetrahedra are
 * used only to find a point inside. */
int host_hull_check(struct host_hull *hull,
                    const struct host_hull_listener *listener,
                    struct host_error *error);

void host_hull_free(struct host_hull *hull);

#endif
