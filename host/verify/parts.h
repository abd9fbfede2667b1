/* Data that the parts of the check share: ranges of tetrahedra, one a thread,
 * marks and sums of vertices, and the faults found. */
#ifndef HOST_CHECK_PARTS_H
#define HOST_CHECK_PARTS_H

#include <pthread.h>

#include "check.h"
#include "incode/predicates/predicates.h"

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
 * all threads; about 500 ns a facet. */

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

enum {
    CHECK_PARTS_MAX = 16,
    CHECK_THREADS_MAX = 4,   /* a thread's own arrays take memory */
    CHECK_VERTICES = 1 << 12 /* a turn of a thread */
};

/* The tetrahedra [first, last), of which `listed` (if there is a list) are
 * candidates: those with a facet that may belong to the hull. */
struct check_part {
    uint64_t first, last;
    uint64_t *sum;  /* [count] of a vertex's hashes; bit 0: it is used */
    uint32_t *list; /* of candidates, less `first` */
    uint64_t listed;
    uint32_t *end;   /* [count + 1] of the entries of a vertex, see twins.c */
    uint32_t *entry; /* less `first` */
};

struct check_fault {
    uint64_t tet[2];
    uint32_t vertex[5];
    uint8_t tets, vertices;
    const char *subject, *what;
};

struct check {
    const struct host_sites *sites;
    const struct host_tetrahedra *tets;
    enum host_check_depth depth;
    struct host_check_report *report;
    unsigned parts;
    struct check_part part[CHECK_PARTS_MAX];
    uint64_t key[2];
    uint8_t *used; /* [count] 1: third or fourth vertex of a tetrahedron */
    uint8_t *hot;  /* [count] 1: facets with it as their lowest vertex do not
                      cancel */
    uint64_t *bad; /* a bit a tetrahedron: left out of the check */
    bool careful;  /* some vertices are false: all are looked at */
    bool any_bad, any_unused, any_false;
    struct host_hull hull;
    uint64_t next;        /* first vertex or facet that no thread has taken */
    pthread_mutex_t lock; /* of what follows, and of the hull */
    struct check_fault *fault;
    uint64_t faults_kept, faults_room, faults_max;
    struct host_error *error;
};

/* Notes a fault, on any thread.  Tetrahedra and vertices are copied. */
void check_fault(struct check *c, const char *subject, const char *what,
                 const uint64_t *tets, int tet_count, const uint32_t *vertices,
                 int count);

static inline bool check_is_bad(const struct check *c, uint64_t tet) {
    return c->any_bad && (c->bad[tet / 64] >> tet % 64 & 1) != 0;
}

/* Takes the next `turn` items of `total`: the first of them; `total` if none
 * are left. */
static inline uint64_t check_take(struct check *c, uint64_t turn,
                                  uint64_t total) {
    uint64_t i = __atomic_fetch_add(&c->next, turn, __ATOMIC_RELAXED);
    return i < total ? i : total;
}

static inline uint64_t check_end(uint64_t first, uint64_t turn,
                                 uint64_t total) {
    return total - first < turn ? total : first + turn;
}

/* The lowest two vertices. */
static inline void check_lowest_two(const uint32_t t[4], uint32_t low[2]) {
    uint32_t a = t[0] < t[1] ? t[0] : t[1], b = t[0] < t[1] ? t[1] : t[0];
    uint32_t c = t[2] < t[3] ? t[2] : t[3], d = t[2] < t[3] ? t[3] : t[2];
    uint32_t higher = a < c ? c : a, other = b < d ? b : d;
    low[0] = a < c ? a : c;
    low[1] = higher < other ? higher : other;
}

/* sums.c: leaves out tetrahedra that are not positive, and finds the vertices
 * that are unused or hot. */
int check_sums(struct check *c);

#endif
