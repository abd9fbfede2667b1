/* A known triangulation that is asked which apex a face has.
 *
 * Memory: 64 bytes a tetrahedron. */
#ifndef TESTS_UNIT_ORACLE_H
#define TESTS_UNIT_ORACLE_H

#include <stdlib.h>
#include <string.h>

#include "host/mesh/tetrahedra.h"
#include "incode/pages/bricks.h"
#include "tests/unit/test.h"

struct oracle {
    const struct host_tetrahedra *tets;
    uint32_t (*entry)[4]; /* hash table: a face, and its apex; v v: free */
    uint32_t mask;
    uint32_t *at; /* a tetrahedron of each vertex, or INCODE_NONE */
    uint32_t hull;
};

/* The faces of (a, b, c, d), each with the vertex that it looks at. */
static const uint8_t oracle_faces[4][4] = {
    {0, 1, 2, 3}, {0, 3, 1, 2}, {0, 2, 3, 1}, {1, 3, 2, 0}};

/* The entry of a face, however it is turned, or the free one for it. */
static inline uint32_t *oracle_find(const struct oracle *o,
                                    const uint32_t v[3]) {
    unsigned turn = v[1] < v[0];
    turn = v[2] < v[turn] ? 2 : turn;
    const uint32_t f[3] = {v[turn], v[(turn + 1) % 3], v[(turn + 2) % 3]};
    uint64_t h = ((uint64_t)f[0] << 42 ^ (uint64_t)f[1] << 21 ^ f[2]) *
                 UINT64_C(0x9e3779b97f4a7c15);
    uint32_t i = (uint32_t)(h >> 32) & o->mask;
    while (o->entry[i][0] != o->entry[i][1] &&
           memcmp(o->entry[i], f, sizeof f) != 0)
        i = (i + 1) & o->mask;
    if (o->entry[i][0] == o->entry[i][1]) {
        memcpy(o->entry[i], f, sizeof f);
        o->entry[i][3] = INCODE_NONE;
    }
    return o->entry[i];
}

/* The vertex p of the tetrahedron beside the face where orient3d(face, p) > 0;
 * INCODE_NONE: the face is of the hull. */
static inline uint32_t oracle_apex(const struct oracle *o,
                                   const uint32_t v[3]) {
    return oracle_find(o, v)[3];
}

/* tets: of positive orientation, of vertices below `vertices`; they stay. */
static inline void oracle_open(struct oracle *o,
                               const struct host_tetrahedra *tets,
                               uint32_t vertices) {
    uint32_t size = 1024;
    while (size < 12 * tets->count)
        size *= 2;
    *o = (struct oracle){.tets = tets, .mask = size - 1};
    o->entry = calloc(size, sizeof *o->entry);
    o->at = malloc(vertices * sizeof *o->at);
    assert_non_null(o->entry);
    assert_non_null(o->at);
    memset(o->at, 0xff, vertices * sizeof *o->at);
    for (uint32_t i = 0; i < tets->count; i++) {
        const uint32_t *t = tets->v[i];
        for (int k = 0; k < 4; k++) {
            const uint8_t *j = oracle_faces[k];
            const uint32_t f[3] = {t[j[0]], t[j[1]], t[j[2]]};
            uint32_t *entry = oracle_find(o, f);
            assert_int_equal(entry[3], INCODE_NONE);
            entry[3] = t[j[3]];
            o->at[t[k]] = i;
        }
    }
    for (uint32_t i = 0; i < tets->count; i++) {
        const uint32_t *t = tets->v[i];
        for (int k = 0; k < 4; k++) {
            const uint8_t *j = oracle_faces[k];
            const uint32_t f[3] = {t[j[0]], t[j[2]], t[j[1]]};
            o->hull += oracle_apex(o, f) == INCODE_NONE;
        }
    }
}

static inline void oracle_close(struct oracle *o) {
    free(o->entry);
    free(o->at);
}

#endif
