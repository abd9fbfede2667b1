/* Tells the user, once, where a run spends its time on pages: nodes whose
 * memory does not hold the points that they look at ask for the same pages
 * again and again.  It is so where what was asked for again is many times what
 * has come of it, and took a second or more.  Part of service.h.
 *
 * A page takes a node some 30 us, a tetrahedron 1 us (of points on a sphere,
 * 20); that each node has each page once counts for nothing.  Measured, pages
 * asked for again are a part of a tetrahedron of none for uniform points on
 * nodes of 4M, 1/100 on 1M; 1/16 of 200,000 points around a blunt fin on 4M,
 * 1/2 on 1M; 30 for as many on a sphere.  The bound is 1/6.
 *
 * Memory: none.  Work: a comparison a page.
 *
 *     host_paging_sent(&service); // for each page that has gone
 *     host_paging_end(&service);  // of those that came from other nodes
 */
#ifndef HOST_PAGING_H
#define HOST_PAGING_H

#include "service.h"

enum {
    HOST_PAGING_AGAIN_MIN = 20000, /* pages; fewer are not worth a word */
    HOST_PAGING_TETRAHEDRA = 6     /* for each of them; more: all is well */
};

/* A page has gone to a node. */
void host_paging_sent(struct host_service *service);

/* The run is over, and what the nodes have asked for is known. */
void host_paging_end(struct host_service *service);

/* The least power of two of bytes a node that holds so many pages, where
 * `memory` holds `frames`; at most HOST_MEMORY_MAX. */
uint64_t host_paging_memory(uint64_t memory, uint64_t frames, uint64_t pages);

#endif
