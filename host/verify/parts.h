/* Data that the parts of the check share: ranges of tetrahedra, one a thread,
 * marks and sums of vertices, and the faults found.
 *
 * Memory: that of the check.  Work: none of its own.
 *
 *     while ((i = check_take(c, 64, sites.count)) < sites.count)
 *         if (!host_site_is_vertex(&sites, (uint32_t)i))
 *             check_fault(c, "point", "is none", NULL, 0, &vertex, 1);
 */
#ifndef HOST_CHECK_PARTS_H
#define HOST_CHECK_PARTS_H

#include <pthread.h>

#include "check.h"
#include "hull.h"
#include "incode/predicates/predicates.h"

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

/* Notes an error, unless there is one. */
void check_fail(struct check *c, const struct host_error *error);

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

/* twins.c: pairs the facets of all tetrahedra, or of those that are listed, and
 * adds the facets without a twin to the hull. */
int check_twins(struct check *c);

#endif
