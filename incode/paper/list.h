/* Lists of faces that a face manager lends, and a tetrahedron builder's
 * answers: the paper's "list of m faces", as they travel.  A manager has no
 * points, so two more kinds of lists ask for the first tetrahedron at a vertex,
 * and for the number of points of some bricks. */
#ifndef INCODE_LIST_H
#define INCODE_LIST_H

#include <stddef.h>
#include <stdint.h>

enum {
    INCODE_LIST_MAX = 96,
    INCODE_LIST_COUNTED = 16 /* bricks to be counted in one list, at most */
};

enum incode_list_kind {
    INCODE_LIST_FACES = 1, /* v: a face whose apex is wanted */
    INCODE_LIST_FIRST,     /* v[0]: a vertex that no tetrahedron has; one */
    INCODE_LIST_COUNT      /* v[0]: a brick whose points are to be counted */
};

struct incode_list {
    uint32_t kind, count;
    uint32_t v[INCODE_LIST_MAX][3]; /* 0 if the kind does not use it */
};

/* As many as the list had, in its order.  FACES: the face, and its apex or
 * INCODE_NONE where it is of the hull; FIRST: a tetrahedron of positive
 * orientation, its first vertex that of the list; COUNT: brick, points, 0, 0.
 */
struct incode_answers {
    uint16_t kind;
    uint16_t builder; /* whose they are, as their carrier numbers builders */
    uint32_t count;
    uint32_t v[INCODE_LIST_MAX][4];
};

static inline size_t incode_list_bytes(uint32_t count) {
    return offsetof(struct incode_list, v) + count * 3 * sizeof(uint32_t);
}

static inline size_t incode_answers_bytes(uint32_t count) {
    return offsetof(struct incode_answers, v) + count * 4 * sizeof(uint32_t);
}

#endif
