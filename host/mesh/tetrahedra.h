/* A growing list of tetrahedra, 16 bytes each, its canonical order and its
 * digest.
 *
 * Memory: 16 bytes a tetrahedron, grown without a second copy, sorted in
 * place, or where it is put aside (host/base/scratch.h) with a second copy.
 * Work: appending is amortised O(1); sorting about 40 ns a row. */
#ifndef HOST_TETRAHEDRA_H
#define HOST_TETRAHEDRA_H

#include <pthread.h>
#include <stddef.h>
#include <stdint.h>

#include "host/base/error.h"

struct host_tetrahedra {
    uint32_t (*v)[4]; /* [count] four vertices of positive orientation */
    uint64_t count;
    uint64_t capacity;
};

/* "sha256:" and 64 hexadecimal digits. */
struct host_digest {
    char text[72];
};

/* Room for n more rows at v + count; NULL without memory.  The rows count
 * from host_tetrahedra_keep on.  Rows may move in memory. */
uint32_t (*host_tetrahedra_room(struct host_tetrahedra *tets, uint64_t n,
                                struct host_error *error))[4];
static inline void host_tetrahedra_keep(struct host_tetrahedra *tets,
                                        uint64_t n) {
    tets->count += n;
}

/* Drops all rows past `count` (a region that starts again). */
void host_tetrahedra_cut(struct host_tetrahedra *tets, uint64_t count);

/* Replaces every vertex number by map[vertex]. */
void host_tetrahedra_map(struct host_tetrahedra *tets, const uint32_t *map);

/* The same, of all lists, whose rows are put together in the first; map: NULL
 * leaves the numbers as they are. */
int host_tetrahedra_join(struct host_tetrahedra *tets, unsigned lists,
                         const uint32_t *map, struct host_error *error);

/* Turns each of n rows so that its smallest vertex comes first, then the
 * smallest that an even permutation allows. */
void host_tetrahedra_canonical(uint32_t (*v)[4], uint64_t n);

/* Takes rows in blocks, each row canonical, one call at a time, from any
 * thread. It cannot fail: what has no use for more rows cancels the call. */
struct host_sink {
    void (*put)(void *context, const uint32_t (*v)[4], uint64_t count);
    void *context;
    pthread_mutex_t lock; /* held meanwhile */
};

/* Gives all rows to the sink, with map[vertex] for each vertex if map is not
 * NULL, and drops them. */
void host_tetrahedra_pour(struct host_tetrahedra *tets, const uint32_t *map,
                          struct host_sink *sink);

/* Gives back what is mapped beyond the rows. */
void host_tetrahedra_trim(struct host_tetrahedra *tets);

/* Brings every row into the canonical form (smallest vertex first, then the
 * even permutation whose second is smallest) and the rows into the order of
 * the digest (by vertices sorted ascending).  Two threads, in place. */
void host_tetrahedra_sort(struct host_tetrahedra *tets);

/* Brings rows of other things into the order of their first words. */
void host_rows_sort(struct host_tetrahedra *rows);

/* SHA-256 of the sorted rows, each ascending, as little-endian words. */
void host_digest(const struct host_tetrahedra *tets,
                 struct host_digest *digest);

void host_tetrahedra_free(struct host_tetrahedra *tets);

#endif
