/* A front's job, and its calls to its surroundings. */
#ifndef INCODE_JOB_H
#define INCODE_JOB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "incode/predicates/predicates.h"

enum incode_face_rule { INCODE_FACE_OWN, INCODE_FACE_PAPER };

/* The vertices of bricks [first, last) are this front's own. */
struct incode_job {
    uint32_t first, last;
    double lo[3], hi[3]; /* the region's box, for the face rule `paper` */
};

struct incode_face {
    uint32_t v[3]; /* key first: the list it belongs to */
};

/* What the front gives away and takes back.  All calls return at once. */
struct incode_front_outside {
    void *context;
    /* Room for results: how many tetrahedra emit would take now. */
    size_t (*emit_room)(void *context);
    /* Tetrahedra (vertex, apexes[i][0..2]), each of positive orientation. */
    void (*emit)(void *context, uint32_t vertex, const uint32_t (*apexes)[3],
                 size_t count);
    /* A brick is committed: all tetrahedra whose owner (incode_owner) lies in
     * it have been emitted before this call. */
    void (*commit)(void *context, uint32_t brick);
    /* Spilled toggles, to be kept in order with their brick (= v[0] / 64);
     * v[1] = INCODE_NONE: vertex v[0] was reached.  False: no room now. */
    bool (*spill)(void *context, const struct incode_face *faces, size_t count);
    /* Requests a brick's spilled toggles.  They arrive by calls of
     * incode_front_unspill, the last of them with `last` set.  False: not now.
     */
    bool (*unspill)(void *context, uint32_t brick);
    /* NULL, or the region is triangulated alone, point by point: no point of
     * another region is inserted, and this takes, instead of emit, each
     * tetrahedron whose sphere may hold one.  An index is INCODE_NONE: beyond
     * the facet of the others there may be one. */
    void (*left)(void *context, const uint32_t v[4]);
};

enum { INCODE_TAKEN_MAX = 128 }; /* tetrahedra of another front at a time */

/* Other fronts, where they share one active face list (exchange.h). */
struct incode_front_peers {
    void *context;
    /* Calls of `share` that are possible now. */
    size_t (*room)(void *context);
    /* A tetrahedron (or a facet of the hull, v[3] = INCODE_NONE), for all other
     * owners of its vertices. */
    void (*share)(void *context, const uint32_t v[4]);
};

/* The owner of a tetrahedron is one of its vertices: the lexicographically
 * smallest, or the one with the lowest number.  The tetrahedron belongs to the
 * owner's brick.  The owner depends on the tetrahedron alone.  So of all nodes
 * that build it one keeps it, and host and nodes agree which. */

enum incode_owner_rule {
    INCODE_OWNER_SMALLEST, /* the paper's: the upper left frontmost */
    INCODE_OWNER_LOWEST    /* the lowest number */
};

/* The index of the smallest of four points.  As a rule x decides, without a
 * branch, because the result is not predictable. */
static inline unsigned incode_smallest(const double *const p[4]) {
    unsigned least = 0;
    double x = p[0][0];
    for (unsigned i = 1; i < 4; i++) {
        bool less = p[i][0] < x;
        if (__builtin_expect(p[i][0] == x, 0))
            less = incode_lexicographic(p[i], p[least]) < 0;
        x = less ? p[i][0] : x;
        least = less ? i : least;
    }
    return least;
}

/* Which of some vertex numbers is the lowest. */
static inline unsigned incode_lowest(const uint32_t *v, unsigned count) {
    unsigned least = 0;
    for (unsigned i = 1; i < count; i++)
        least = v[i] < v[least] ? i : least;
    return least;
}

/* The index of the owner among a tetrahedron's vertices v, at p[0] to p[3]: 0
 * to 3. */
static inline unsigned incode_owner(enum incode_owner_rule rule,
                                    const uint32_t v[4],
                                    const double *const p[4]) {
    return rule == INCODE_OWNER_LOWEST ? incode_lowest(v, 4)
                                       : incode_smallest(p);
}

#endif
