/* A plain Delaunay triangulation for tests: face by face, every point tried as
 * the apex, nothing but the exact predicates.
 *
 * Memory: a table of 2^18 faces.  Work: O(points * tetrahedra); for up to a few
 * thousand points. */
#ifndef TESTS_REFERENCE_H
#define TESTS_REFERENCE_H

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/mesh/adjacency.h"
#include "host/formats/read.h"
#include "incode/predicates/predicates.h"

enum { REFERENCE_FACES = 1 << 18 };

struct reference {
    const double *xyz;
    uint32_t n;
    uint8_t *distinct;   /* 1: the lowest row of its point */
    uint32_t (*face)[3]; /* hash table; v[0] == v[1]: free, 1 1 1: removed */
    uint32_t (*stack)[3];
    size_t depth;
    struct incode_tally tally;
};

static inline const double *reference_at(const struct reference *r,
                                         uint32_t v) {
    return r->xyz + 3 * (size_t)v;
}

static inline void reference_check(bool holds, const char *what) {
    if (!holds) {
        fprintf(stderr, "reference: %s\n", what);
        abort();
    }
}

static inline uint64_t reference_hash(const uint32_t f[3]) {
    uint64_t h = (uint64_t)f[0] + f[1] + f[2];
    h = h << 40 ^ ((uint64_t)f[0] ^ f[1] ^ f[2]) << 20 ^
        (uint64_t)f[0] * f[1] * f[2];
    return h * UINT64_C(0x9e3779b97f4a7c15) >> 40;
}

static inline bool reference_same(const uint32_t f[3], const uint32_t g[3]) {
    for (int i = 0; i < 3; i++)
        if (f[i] != g[0] && f[i] != g[1] && f[i] != g[2])
            return false;
    return true;
}

/* Enters an open face, or takes out its twin. */
static inline void reference_toggle(struct reference *r, const uint32_t f[3]) {
    size_t i = reference_hash(f) % REFERENCE_FACES;
    for (;; i = (i + 1) % REFERENCE_FACES) {
        uint32_t *g = r->face[i];
        if (g[0] == 0 && g[1] == 0) {
            memcpy(g, f, sizeof *r->face);
            reference_check(r->depth < REFERENCE_FACES, "too many faces");
            memcpy(r->stack[r->depth++], f, sizeof *r->face);
            return;
        }
        if (g[0] != g[1] && reference_same(f, g)) {
            g[0] = g[1] = g[2] = 1;
            return;
        }
    }
}

static inline bool reference_is_open(struct reference *r, const uint32_t f[3]) {
    size_t i = reference_hash(f) % REFERENCE_FACES;
    for (;; i = (i + 1) % REFERENCE_FACES) {
        uint32_t *g = r->face[i];
        if (g[0] == 0 && g[1] == 0)
            return false;
        if (g[0] != g[1] && reference_same(f, g)) {
            g[0] = g[1] = g[2] = 1;
            return true;
        }
    }
}

/* The apex on the face's outer side, or false on the hull. */
static inline bool reference_apex(struct reference *r, const uint32_t f[3],
                                  uint32_t *apex) {
    const double *a = reference_at(r, f[0]), *b = reference_at(r, f[1]),
                 *c = reference_at(r, f[2]);
    bool any = false;
    for (uint32_t p = 0; p < r->n; p++) {
        const double *q = reference_at(r, p);
        if (r->distinct[p] == 0 || p == f[0] || p == f[1] || p == f[2] ||
            incode_orient3d(&r->tally, a, b, c, q) <= 0)
            continue;
        if (!any || incode_in_sphere(&r->tally, a, b, c, reference_at(r, *apex),
                                     q) > 0) {
            *apex = p;
            any = true;
        }
    }
    return any;
}

static inline void reference_add(struct reference *r,
                                 struct host_tetrahedra *tets,
                                 const uint32_t t[4]) {
    struct host_error error = {0};
    uint32_t(*row)[4] = host_tetrahedra_room(tets, 1, &error);
    reference_check(row != NULL, "no memory");
    memcpy(row, t, sizeof *row);
    host_tetrahedra_keep(tets, 1);
    for (uint32_t k = 0; k < 4; k++) {
        uint32_t f[3];
        host_facet_outward(t, k, f);
        reference_toggle(r, f);
    }
}

/* A point, its nearest, and whatever two points make their sphere empty. */
static inline void reference_start(struct reference *r, uint32_t t[4]) {
    uint32_t a = 0, b = UINT32_MAX;
    for (uint32_t p = 1; p < r->n; p++)
        if (r->distinct[p] != 0 &&
            (b == UINT32_MAX ||
             incode_compare_distance(reference_at(r, a), reference_at(r, p),
                                     reference_at(r, b)) < 0))
            b = p;
    for (uint32_t c = 0; c < r->n; c++) {
        uint32_t f[3] = {a, b, c}, d = 0;
        if (r->distinct[c] == 0 || c == a || c == b ||
            !reference_apex(r, f, &d))
            continue;
        bool empty = true;
        for (uint32_t p = 0; p < r->n && empty; p++) {
            empty =
                r->distinct[p] == 0 || p == a || p == b || p == c || p == d ||
                incode_in_sphere(&r->tally, reference_at(r, a),
                                 reference_at(r, b), reference_at(r, c),
                                 reference_at(r, d), reference_at(r, p)) < 0;
        }
        if (empty) {
            uint32_t found[4] = {a, b, c, d};
            memcpy(t, found, sizeof found);
            return;
        }
    }
    reference_check(false, "no first tetrahedron");
}

/* Appends the tetrahedra of n points, which must span the space. */
static inline void reference_delaunay(const double *xyz, uint32_t n,
                                      struct host_tetrahedra *tets) {
    struct reference r = {.xyz = xyz, .n = n};
    r.distinct = malloc(n);
    r.face = calloc(REFERENCE_FACES, sizeof *r.face);
    r.stack = calloc(REFERENCE_FACES, sizeof *r.stack);
    reference_check(r.distinct != NULL && r.face != NULL && r.stack != NULL,
                    "no memory");
    for (uint32_t i = 0; i < n; i++) {
        r.distinct[i] = 1;
        for (uint32_t j = 0; j < i && r.distinct[i] != 0; j++) {
            r.distinct[i] = incode_lexicographic(reference_at(&r, i),
                                                 reference_at(&r, j)) != 0;
        }
    }
    uint32_t t[4];
    reference_start(&r, t);
    reference_add(&r, tets, t);
    while (r.depth > 0) {
        uint32_t f[3], apex = 0;
        memcpy(f, r.stack[--r.depth], sizeof f);
        if (reference_is_open(&r, f) && reference_apex(&r, f, &apex)) {
            uint32_t next[4] = {f[0], f[1], f[2], apex};
            reference_toggle(&r, f); /* its twin is about to come */
            r.depth--;
            reference_add(&r, tets, next);
        }
    }
    free(r.distinct);
    free(r.face);
    free(r.stack);
}

/* Reads a set of the shared data; false where it is not there. */
static inline bool reference_data(const char *name,
                                  struct host_points *points) {
    const char *folder = getenv("INCODE_DATA");
    char path[512];
    struct host_error error = {0};
    (void)snprintf(path, sizeof path, "%s/%s",
                   folder != NULL ? folder : "../shared/data", name);
    FILE *file = fopen(path, "r");
    if (file == NULL)
        return false;
    (void)fclose(file);
    int code = host_points_read(path, points, &error);
    if (code != 0)
        fprintf(stderr, "%s\n", error.text);
    return code == 0;
}

#endif
