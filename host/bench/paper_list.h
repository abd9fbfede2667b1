/* The active face list alone, for Table 1: the searches of a triangulation made
 * once more, without the search for apexes.
 *
 * Memory: 16 bytes a face, of twice as many faces as there are tetrahedra at
 * most.  Work: four searches a tetrahedron.
 *
 *     struct host_paper_list list;
 *     if (host_paper_list(&tets, vertices, &list, &error) == 0)
 *         printf("%.2f accesses a search\n", list.accesses);
 */
#ifndef HOST_BENCH_PAPER_LIST_H
#define HOST_BENCH_PAPER_LIST_H

#include "host/mesh/tetrahedra.h"

struct host_paper_list {
    uint64_t searches;
    double accesses;  /* faces looked at, a search */
    double seconds;   /* of all searches */
    uint64_t longest; /* faces open at a time */
};

/* tets: of positive orientation, in the order in which they were built; their
 * vertices below `vertices`.  0, or HOST_BROKEN without memory. */
int host_paper_list(const struct host_tetrahedra *tets, uint64_t vertices,
                    struct host_paper_list *list, struct host_error *error);

#endif
