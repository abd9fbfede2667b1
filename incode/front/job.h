/* What a front is asked to do, and how it reaches the world.
 *
 * Memory: the structs.  Work: none.
 *
 *     struct incode_job job = {.first = 0, .last = bricks};
 *     struct incode_face face = {{v, b, c}};
 *     struct incode_front_outside outside = {.context = NULL};
 */
#ifndef INCODE_JOB_H
#define INCODE_JOB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

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
    /* Brick committed: all tetrahedra whose owner (owner.h) lies in it have
     * been emitted before this call. */
    void (*commit)(void *context, uint32_t brick);
    /* Spilled toggles, to be kept in order with their brick (= v[0] / 64);
     * v[1] = INCODE_NONE: vertex v[0] was reached.  False: no room now. */
    bool (*spill)(void *context, const struct incode_face *faces, size_t count);
    /* Asks for a brick's spilled toggles; they come by incode_front_unspill,
     * the last call with `last` set. */
    bool (*unspill)(void *context, uint32_t brick);
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

#endif
