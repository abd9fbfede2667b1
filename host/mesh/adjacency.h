/* Which tetrahedra share a facet, vertex by vertex: the facets whose lowest
 * vertex is p, sorted, so that twins stand side by side.
 *
 * Memory: 4 bytes a tetrahedron and 8 a vertex; 16 a tetrahedron where arrays
 * are put aside (host/base/scratch.h), so that groups in the order of their
 * vertices read in order.  Work: two passes; a group of g facets O(g log g). */
#ifndef HOST_ADJACENCY_H
#define HOST_ADJACENCY_H

#include "tetrahedra.h"

struct host_adjacency {
    const struct host_tetrahedra *tets; /* canonical and sorted */
    uint32_t vertices;
    uint32_t *first_by_lowest; /* [vertices + 1] rows are sorted by it */
    uint32_t *first_by_second; /* [vertices + 1] into by_second */
    uint32_t *by_second;       /* [count] tetrahedra by second vertex; or */
    /* their second vertices, the lower and the higher of the others, numbers */
    struct host_tetrahedra seconds;
};

/* A facet of the group of its lowest vertex p. */
struct host_facet {
    uint64_t others; /* middle vertex << 32 | highest */
    uint32_t tet;
    uint32_t corner; /* of the tetrahedron, opposite the facet */
};

struct host_group {
    struct host_facet *facet;
    size_t count, capacity;
};

/* Tetrahedra sorted, every vertex below `vertices`; at most 2^32 - 2 of
 * them. */
int host_adjacency_make(struct host_adjacency *a,
                        const struct host_tetrahedra *tets, uint32_t vertices,
                        struct host_error *error);
void host_adjacency_free(struct host_adjacency *a);

/* Fills the group of p, sorted by `others`.  0 or HOST_BROKEN. */
int host_adjacency_group(const struct host_adjacency *a, uint32_t p,
                         struct host_group *group, struct host_error *error);
void host_group_free(struct host_group *group);

/* The facet opposite a corner of a positive tetrahedron, its normal (by the
 * right hand) pointing out. */
void host_facet_outward(const uint32_t tet[4], uint32_t corner,
                        uint32_t facet[3]);

#endif
