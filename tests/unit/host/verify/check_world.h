/* Point sets in the order of a run with their Delaunay triangulation, for tests
 * of what judges tetrahedra. */
#ifndef TESTS_CHECK_WORLD_H
#define TESTS_CHECK_WORLD_H

#include <stdlib.h>
#include <string.h>

#include "host/verify/check.h"
#include "host/mesh/gen.h"
#include "tests/unit/reference.h"
#include "tests/unit/test.h"

enum { FAULTS_MAX = 1 << 16 };

/* A set in the order of a run, and its tetrahedra by vertex numbers. */
struct fixture {
    struct host_points points;
    struct host_order order;
    struct host_sites sites;
    struct host_tetrahedra right, tets;
    uint8_t *named; /* [sites] vertices that a fault has named */
    uint64_t state;
};

static inline uint64_t draw(struct fixture *f, uint64_t below) {
    f->state = f->state * 6364136223846793005u + 1442695040888963407u;
    return (f->state >> 33) % below;
}

static inline void append(struct host_tetrahedra *tets, const uint32_t t[4]) {
    struct host_error error = {0};
    uint32_t(*room)[4] = host_tetrahedra_room(tets, 1, &error);
    assert_non_null(room);
    memcpy(*room, t, sizeof *room);
    host_tetrahedra_keep(tets, 1);
}

static inline void cut(struct host_tetrahedra *tets, uint64_t i) {
    memcpy(tets->v[i], tets->v[tets->count - 1], sizeof *tets->v);
    host_tetrahedra_cut(tets, tets->count - 1);
}

/* The right ones again, in an order of chance. */
static inline void restore(struct fixture *f) {
    host_tetrahedra_cut(&f->tets, 0);
    for (uint64_t i = 0; i < f->right.count; i++)
        append(&f->tets, f->right.v[i]);
    for (uint64_t i = f->tets.count; i > 1; i--) {
        uint32_t t[4], (*v)[4] = f->tets.v;
        uint64_t k = draw(f, i);
        memcpy(t, v[k], sizeof t);
        memcpy(v[k], v[i - 1], sizeof t);
        memcpy(v[i - 1], t, sizeof t);
    }
}

static inline void open_order(struct fixture *f) {
    struct host_error error = {0};
    f->state = 1;
    assert_int_equal(host_order_make(&f->order, "points", f->points.xyz,
                                     f->points.count, HOST_ADAPTIVE, 4, false,
                                     &error),
                     0);
    f->sites = host_sites_of_order(&f->order);
    uint32_t *vertex = calloc(f->points.count, sizeof *vertex);
    f->named = calloc(f->sites.count, 1);
    assert_non_null(vertex);
    assert_non_null(f->named);
    for (uint32_t v = 0; v < f->sites.count; v++)
        if (f->order.row[v] != INCODE_NONE)
            vertex[f->order.row[v]] = v;
    reference_delaunay(f->points.xyz, (uint32_t)f->points.count, &f->right);
    host_tetrahedra_map(&f->right, vertex);
    free(vertex);
    restore(f);
}

static inline void open_set(struct fixture *f, const char *kind, uint32_t n,
                            uint64_t seed) {
    struct host_error error = {0};
    memset(f, 0, sizeof *f);
    assert_int_equal(host_gen(kind, n, seed, &f->points, &error), 0);
    if (strcmp(kind, "bubbles") == 0) { /* and each third one twice */
        for (uint32_t i = 0; i < n; i += 3) {
            double copy[3];
            memcpy(copy, f->points.xyz + 3 * (size_t)i, sizeof copy);
            assert_int_equal(host_points_append(&f->points, copy, 1, &error),
                             0);
        }
    }
    open_order(f);
}

static inline void close_set(struct fixture *f) {
    host_points_free(&f->points);
    host_order_free(&f->order);
    host_tetrahedra_free(&f->right);
    host_tetrahedra_free(&f->tets);
    free(f->named);
}

static inline int orientation(const struct fixture *f, const uint32_t t[4]) {
    struct incode_tally tally = {0};
    double p[4][3];
    for (int k = 0; k < 4; k++)
        host_site(&f->sites, t[k], p[k]);
    return incode_orient3d(&tally, p[0], p[1], p[2], p[3]);
}

static inline bool is_one_of(const uint32_t *v, int n, uint32_t vertex) {
    for (int i = 0; i < n; i++)
        if (v[i] == vertex)
            return true;
    return false;
}

static inline bool is_row(const struct fixture *f, const uint32_t t[4]) {
    for (int k = 0; k < 4; k++)
        if (t[k] >= f->sites.count || !host_site_is_vertex(&f->sites, t[k]))
            return false;
    return orientation(f, t) > 0;
}

static inline void open_points(struct fixture *f, const double *xyz,
                               uint32_t n) {
    struct host_error error = {0};
    memset(f, 0, sizeof *f);
    assert_int_equal(host_points_append(&f->points, xyz, n, &error), 0);
    open_order(f);
}

static inline uint32_t vertex_of(const struct fixture *f, uint32_t row) {
    uint32_t v = 0;
    while (f->order.row[v] != row)
        v++;
    return v;
}

static const struct set {
    const char *kind;
    uint32_t n;
} sets[] = {{"uniform", 4},  {"uniform", 5},   {"uniform", 400}, {"grid", 343},
            {"sphere", 200}, {"bubbles", 300}, {"rotated", 216}, {"hub", 150}};

static inline void for_each_set(void (*function)(struct fixture *f)) {
    for (size_t i = 0; i < sizeof sets / sizeof *sets; i++) {
        struct fixture f;
        open_set(&f, sets[i].kind, sets[i].n, i + 1);
        function(&f);
        close_set(&f);
    }
}

/* Whether some tetrahedron has a facet, in this order seen from outside. */
static inline bool has_facet(const struct fixture *f, const uint32_t p[3]) {
    for (uint64_t i = 0; i < f->tets.count; i++) {
        const uint32_t *t = f->tets.v[i];
        if (!is_one_of(t, 4, p[0]) || !is_one_of(t, 4, p[1]) ||
            !is_one_of(t, 4, p[2]) || !is_row(f, t))
            continue;
        for (uint32_t c = 0; c < 4; c++) {
            uint32_t q[3];
            host_facet_outward(t, c, q);
            for (int k = 0; k < 3; k++)
                if (p[0] == q[k] && p[1] == q[(k + 1) % 3] &&
                    p[2] == q[(k + 2) % 3])
                    return true;
        }
    }
    return false;
}

static inline void hear(void *context, const uint64_t *tets, int tet_count,
                        const uint32_t *vertices, int count, const char *what) {
    struct fixture *f = context;
    assert_non_null(what);
    for (int i = 0; i < tet_count; i++)
        assert_true(tets[i] < f->tets.count);
    for (int i = 0; i < count; i++)
        if (vertices[i] < f->sites.count)
            f->named[vertices[i]] = 1;
}

static inline int check(struct fixture *f, enum host_check_depth depth,
                        struct host_check_report *report) {
    struct host_check_listener listener = {f, FAULTS_MAX, hear};
    struct host_error error = {0};
    memset(f->named, 0, f->sites.count);
    int code =
        host_check(&f->sites, &f->tets, depth, &listener, report, &error);
    assert_int_equal(code, error.code);
    assert_true((report->faults > 0) == (code == HOST_UNVERIFIED));
    assert_true(report->faults <= FAULTS_MAX);
    return code;
}

#endif
