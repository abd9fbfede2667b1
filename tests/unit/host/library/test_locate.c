/* Point location and edges, against all tetrahedra. */
#include "tests/unit/reference.h"
#include "tests/unit/test.h"

#include <fenv.h>
#include <math.h>

#include "host/library/incode.h"
#include "host/mesh/gen.h"

struct set {
    double *xyz;
    uint64_t points;
    struct incode_tetrahedra t;
    double *query;
    uint64_t queries, *found;
};

static uint64_t state = 1;
static uint64_t draw(uint64_t below) {
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407;
    return (state >> 33) % below;
}

/* --- sets and queries ----------------------------------------------------- */

/* Takes xyz over. */
static struct set set_of(double *xyz, uint64_t points) {
    struct set s = {.xyz = xyz, .points = points};
    struct incode_options o = {.flags = INCODE_NEIGHBORS, .threads = 1};
    assert_int_equal(incode_delaunay(xyz, points, &o, &s.t), INCODE_OK);
    return s;
}

static double *copy_of(const double *xyz, uint64_t points) {
    double *copy = malloc(3 * points * sizeof *copy);
    assert_non_null(copy);
    memcpy(copy, xyz, 3 * points * sizeof *copy);
    return copy;
}

static struct set made(const char *kind, uint64_t points) {
    struct host_points p = {0};
    struct host_error error = {0};
    assert_int_equal(host_gen(kind, points, 3, &p, &error), 0);
    struct set s = set_of(copy_of(p.xyz, p.count), p.count);
    host_points_free(&p);
    return s;
}

static void set_free(struct set *s) {
    incode_tetrahedra_free(&s->t);
    free(s->xyz);
    free(s->query);
    free(s->found);
}

static void room_for(struct set *s, uint64_t queries) {
    s->queries = queries;
    s->query = malloc(3 * queries * sizeof *s->query);
    s->found = malloc(queries * sizeof *s->found);
    assert_true(s->query != NULL && s->found != NULL);
}

/* Vertices, the middles of edges, facets and tetrahedra, reflections of a
 * vertex in another, and corners of boxes about two vertices: inside and
 * outside, and on what is shared as often as not. */
static void choose_queries(struct set *s, uint64_t queries) {
    room_for(s, queries);
    for (uint64_t i = 0; i < queries; i++) {
        double *q = s->query + 3 * i;
        const uint32_t *v = s->t.vertex[draw(s->t.count)];
        const double *a = s->xyz + 3 * (size_t)v[draw(4)];
        unsigned kind = (unsigned)(i % 7);
        for (int k = 0; k < 3; k++) {
            const double p[4] = {s->xyz[3 * (size_t)v[0] + (size_t)k],
                                 s->xyz[3 * (size_t)v[1] + (size_t)k],
                                 s->xyz[3 * (size_t)v[2] + (size_t)k],
                                 s->xyz[3 * (size_t)v[3] + (size_t)k]};
            const double x[7] = {a[k],
                                 0.5 * p[0] + 0.5 * p[1],
                                 0.25 * p[0] + 0.25 * p[1] + 0.5 * p[3],
                                 0.25 * p[0] + 0.25 * p[1] + 0.25 * p[2] +
                                     0.25 * p[3],
                                 1.5 * p[2] - 0.5 * p[3],
                                 p[draw(4)],
                                 nextafter(a[k], p[3])};
            q[k] = isfinite(x[kind]) ? x[kind] : a[k];
        }
    }
}

/* --- brute force ---------------------------------------------------------- */

static bool contains(const struct set *s, uint64_t tet, const double q[3]) {
    static struct incode_tally tally;
    const uint32_t *v = s->t.vertex[tet];
    for (int i = 0; i < 4; i++) {
        const double *p[4];
        for (int k = 0; k < 4; k++)
            p[k] = k == i ? q : s->xyz + 3 * (size_t)v[k];
        if (incode_orient3d(&tally, p[0], p[1], p[2], p[3]) < 0)
            return false;
    }
    return true;
}

static uint64_t lowest(const struct set *s, const double q[3]) {
    for (uint64_t tet = 0; tet < s->t.count; tet++)
        if (contains(s, tet, q))
            return tet;
    return INCODE_NONE64;
}

static void locate(const struct set *s, unsigned threads) {
    struct incode_options o = {.threads = threads};
    memset(s->found, 0x55, s->queries * sizeof *s->found);
    assert_int_equal(incode_locate(s->xyz, s->points, &s->t, s->query,
                                   s->queries, &o, s->found, NULL),
                     INCODE_OK);
}

static void check(struct set *s, uint64_t queries) {
    choose_queries(s, queries);
    locate(s, 1);
    for (uint64_t i = 0; i < queries; i++) {
        uint64_t at = lowest(s, s->query + 3 * i), alone;
        assert_int_equal(s->found[i], at);
        assert_int_equal(incode_locate(s->xyz, s->points, &s->t,
                                       s->query + 3 * i, 1, NULL, &alone, NULL),
                         INCODE_OK);
        assert_int_equal(alone, at);
    }
    set_free(s);
}

#define CHECK_KIND(kind, points)                                               \
    do {                                                                       \
        struct set s_ = made((kind), (points));                                \
        check(&s_, 700);                                                       \
    } while (0)

TEST(test_kinds) {
    CHECK_KIND("uniform", 300);
    CHECK_KIND("bubbles", 300);
    CHECK_KIND("bluntfin", 500);
    CHECK_KIND("sphere", 300);
    CHECK_KIND("grid", 343);
    CHECK_KIND("hub", 300);
    CHECK_KIND("scales", 200);
    CHECK_KIND("lines", 100);
    CHECK_KIND("uniform", 4);
}

/* Lattices with steps of all sizes, so that every query is on something that
 * is shared. */
TEST(test_lattices) {
    static const double steps[] = {1, 0.1, 0x1p-1074, 0x1p-1040, 0x1p1019};
    enum { SIDE = 5, POINTS = SIDE * SIDE * SIDE };
    for (size_t k = 0; k < sizeof steps / sizeof *steps; k++) {
        double *xyz = malloc(3 * POINTS * sizeof *xyz);
        assert_non_null(xyz);
        for (unsigned i = 0; i < POINTS; i++) {
            xyz[3 * i] = ((int)(i % SIDE) - 2) * steps[k];
            xyz[3 * i + 1] = ((int)(i / SIDE % SIDE) - 2) * 4 * steps[k];
            xyz[3 * i + 2] = ((int)(i / SIDE / SIDE) - 2) * 2 * steps[k];
        }
        struct set s = set_of(xyz, POINTS);
        check(&s, 700);
    }
}

/* One axis of denormals, one that is huge. */
TEST(test_mixed_scales) {
    double *xyz = malloc(3 * 60 * sizeof *xyz);
    assert_non_null(xyz);
    for (unsigned i = 0; i < 60; i++) {
        xyz[3 * i] = (double)draw(5) * 0x1p-1074;
        xyz[3 * i + 1] = ((double)draw(9) - 4) * 0x1p1020;
        xyz[3 * i + 2] = (double)draw(7);
    }
    struct set s = set_of(xyz, 60);
    check(&s, 700);
}

TEST(test_degenerate_data) {
    static const char *const names[] = {"deg_cgal_T3_1.xyz",
                                        "deg_cgal_grid5.xyz",
                                        "deg_cgal_lp500.xyz",
                                        "deg_cgal_nested_cubes.xyz",
                                        "deg_mourner_orient3d_denormal.xyz",
                                        "deg_octahedron.xyz",
                                        "deg_quickhull3d_issue2.xyz",
                                        "deg_quickhull3d_issue38_dupcube.xyz",
                                        "deg_scipy_16094_grid18.xyz",
                                        "deg_spirula_60_thin_tet.xyz",
                                        "deg_trimesh_1446.xyz",
                                        "deg_tritet_8.xyz",
                                        "cactus.xyz.gz"};
    unsigned there = 0;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        struct host_points p = {0};
        struct incode_tetrahedra t;
        if (!reference_data(names[i], &p))
            continue;
        there++;
        bool flat = incode_delaunay(p.xyz, p.count, NULL, &t) != INCODE_OK;
        incode_tetrahedra_free(&t);
        if (!flat) {
            struct set s = set_of(copy_of(p.xyz, p.count), p.count);
            check(&s, s.t.count > 10000 ? 140 : 700);
        }
        host_points_free(&p);
    }
    if (there == 0)
        skip();
}

/* --- threads, order, blocks ----------------------------------------------- */

TEST(test_threads_and_order) {
    struct set s = made("grid", 8000);
    choose_queries(&s, 40000);
    locate(&s, 1);
    uint64_t *first = malloc(s.queries * sizeof *first);
    assert_non_null(first);
    memcpy(first, s.found, s.queries * sizeof *first);
    for (unsigned threads = 0; threads <= 16; threads += 1 + threads / 4) {
        locate(&s, threads);
        assert_memory_equal(s.found, first, s.queries * sizeof *first);
    }
    for (uint64_t i = 0, j = s.queries - 1; i < j; i++, j--) {
        for (int k = 0; k < 3; k++) {
            double x = s.query[3 * i + (size_t)k];
            s.query[3 * i + (size_t)k] = s.query[3 * j + (size_t)k];
            s.query[3 * j + (size_t)k] = x;
        }
    }
    locate(&s, 2);
    for (uint64_t i = 0; i < s.queries; i++)
        assert_int_equal(s.found[i], first[s.queries - 1 - i]);
    free(first);
    set_free(&s);
}

/* More than one block, of few places. */
TEST(test_blocks) {
    enum { PLACES = 700, TIMES = 1600 };
    struct set s = made("uniform", 60);
    choose_queries(&s, PLACES);
    uint64_t expected[PLACES];
    for (uint64_t i = 0; i < PLACES; i++)
        expected[i] = lowest(&s, s.query + 3 * i);
    double *place = s.query;
    free(s.found);
    room_for(&s, PLACES * TIMES);
    for (uint64_t i = 0; i < s.queries; i++)
        memcpy(s.query + 3 * i, place + i % PLACES * 3, 3 * sizeof *place);
    locate(&s, 3);
    for (uint64_t i = 0; i < s.queries; i++)
        assert_int_equal(s.found[i], expected[i % PLACES]);
    free(place);
    set_free(&s);
}

/* All queries at a vertex of all tetrahedra: its star is gathered once, else
 * this takes minutes. */
TEST(test_hub) {
    struct set s = made("hub", 20000);
    room_for(&s, 200000);
    for (uint64_t i = 0; i < s.queries; i++)
        memset(s.query + 3 * i, 0, 3 * sizeof *s.query);
    const double *hub = NULL; /* in the middle */
    for (uint64_t i = 0; i < s.points; i++) {
        const double *p = s.xyz + 3 * i;
        bool is_hub = true;
        for (uint64_t n = 0; n < s.t.count && is_hub; n++)
            is_hub = s.t.vertex[n][0] == i || s.t.vertex[n][1] == i ||
                     s.t.vertex[n][2] == i || s.t.vertex[n][3] == i;
        hub = is_hub ? p : hub;
    }
    assert_non_null(hub);
    for (uint64_t i = 0; i < s.queries; i++)
        memcpy(s.query + 3 * i, hub, 3 * sizeof *hub);
    locate(&s, 2);
    for (uint64_t i = 0; i < s.queries; i++)
        assert_int_equal(s.found[i], 0);

    /* The star does not fit. */
    struct incode_options o = {.threads = 1, .memory_max = 100000};
    assert_int_equal(
        incode_locate(s.xyz, s.points, &s.t, s.query, 1, &o, s.found, NULL),
        INCODE_NO_MEMORY);
    /* It fits what the header says. */
    o.memory_max = 24 * s.t.count;
    assert_int_equal(
        incode_locate(s.xyz, s.points, &s.t, s.query, 1, &o, s.found, NULL),
        INCODE_OK);
    set_free(&s);
}

/* --- limits --------------------------------------------------------------- */

static bool count_calls(void *context, double done) {
    assert_true(done >= 0 && done <= 1);
    return (*(int *)context)-- > 1;
}

TEST(test_memory_and_cancelling) {
    struct set s = made("uniform", 2000);
    choose_queries(&s, 50000);
    struct incode_options o = {.threads = 2, .memory_max = 1000000};
    enum incode_status status = incode_locate(s.xyz, s.points, &s.t, s.query,
                                              s.queries, &o, s.found, NULL);
    assert_int_equal(status, INCODE_NO_MEMORY);
    o.memory_max = 2000000;
    status = incode_locate(s.xyz, s.points, &s.t, s.query, s.queries, &o,
                           s.found, NULL);
    assert_int_equal(status, INCODE_OK);
    int calls = 1; /* the first of them cancels, which may be the last, too */
    o.progress = count_calls;
    o.context = &calls;
    for (uint64_t queries = 1; queries < s.queries; queries *= 8) {
        calls = 1;
        status = incode_locate(s.xyz, s.points, &s.t, s.query, queries, &o,
                               s.found, NULL);
        assert_int_equal(status, INCODE_CANCELLED);
    }
    calls = 1 << 30;
    assert_int_equal(fesetround(FE_UPWARD), 0);
    status = incode_locate(s.xyz, s.points, &s.t, s.query, s.queries, &o,
                           s.found, NULL);
    assert_int_equal(fegetround(), FE_UPWARD);
    assert_int_equal(fesetround(FE_TONEAREST), 0);
    assert_int_equal(status, INCODE_OK);
    assert_true(calls < 1 << 30);
    set_free(&s);
}

static enum incode_status status_of(const struct set *s) {
    return incode_locate(s->xyz, s->points, &s->t, s->query, s->queries, NULL,
                         s->found, NULL);
}

/* What a damaged result leads to: an error, or a wrong answer; no other
 * memory, and an end. */
TEST(test_damage) {
    struct set s = made("grid", 1000);
    choose_queries(&s, 500);
    uint64_t count = s.t.count;
    for (unsigned i = 0; i < 3000; i++) {
        uint64_t tet = draw(count), old = s.t.neighbor[tet][i % 4];
        static const uint64_t wrong[] = {INCODE_NONE64 - 1, UINT32_MAX, 0};
        s.t.neighbor[tet][i % 4] = i % 3 == 2 ? draw(count) : wrong[i % 3];
        enum incode_status status = status_of(&s);
        assert_true(status == INCODE_OK || status == INCODE_BAD_ARGUMENT);
        if (i % 100 != 0) /* others stay */
            s.t.neighbor[tet][i % 4] = old;
    }
    for (uint64_t i = 0; i < count; i++)
        for (int k = 0; k < 4; k++)
            s.t.neighbor[i][k] = count;
    assert_int_equal(status_of(&s), INCODE_BAD_ARGUMENT);
    for (uint64_t i = 0; i < count; i++)
        for (int k = 0; k < 4; k++)
            s.t.neighbor[i][k] = i; /* no walk ends there */
    assert_int_equal(status_of(&s), INCODE_BAD_ARGUMENT);
    for (uint64_t i = 0; i < count; i++)
        s.t.vertex[i][3] = (uint32_t)s.points;
    assert_int_equal(status_of(&s), INCODE_BAD_ARGUMENT);
    set_free(&s);
}

TEST(test_arguments) {
    struct set s = made("uniform", 50);
    choose_queries(&s, 40000);
    uint64_t at = 7;
    struct incode_options o = {.flags = INCODE_NEIGHBORS};
    assert_int_equal(
        incode_locate(s.xyz, s.points, &s.t, s.query, 1, &o, s.found, &at),
        INCODE_BAD_ARGUMENT);
    assert_int_equal(at, 7);
    assert_int_equal(
        incode_locate(s.xyz, s.points, &s.t, NULL, 1, NULL, s.found, NULL),
        INCODE_BAD_ARGUMENT);
    assert_int_equal(
        incode_locate(s.xyz, s.points, &s.t, NULL, 0, NULL, NULL, NULL),
        INCODE_OK);
    o.flags = 0;
    o.threads = 3;
    s.query[3 * 39000] = NAN;
    s.query[3 * 20000 + 2] = INFINITY;
    assert_int_equal(incode_locate(s.xyz, s.points, &s.t, s.query, s.queries,
                                   &o, s.found, &at),
                     INCODE_NOT_FINITE);
    assert_int_equal(at, 20000);
    struct incode_tetrahedra t = s.t;
    t.neighbor = NULL;
    assert_int_equal(
        incode_locate(s.xyz, s.points, &t, s.query, 1, NULL, s.found, NULL),
        INCODE_BAD_ARGUMENT);
    set_free(&s);
}

/* --- edges ---------------------------------------------------------------- */

static void check_edges(const struct set *s, unsigned threads) {
    uint64_t n = s->points, count = 0;
    uint8_t *is_edge = calloc(n, n);
    struct incode_adjacency a;
    struct incode_options o = {.threads = threads};
    assert_non_null(is_edge);
    for (uint64_t i = 0; i < s->t.count; i++)
        for (int j = 0; j < 4; j++)
            for (int k = 0; k < 4; k++)
                if (j != k)
                    is_edge[s->t.vertex[i][j] * n + s->t.vertex[i][k]] = 1;
    assert_int_equal(incode_adjacency(n, &s->t, &o, &a), INCODE_OK);
    assert_int_equal(a.points, n);
    assert_int_equal(a.first[0], 0);
    for (uint64_t p = 0; p < n; p++) {
        for (uint64_t i = a.first[p]; i < a.first[p + 1]; i++) {
            assert_true(i == a.first[p] || a.to[i - 1] < a.to[i]);
            assert_true(a.to[i] < n);
            assert_int_equal(is_edge[p * n + a.to[i]], 1);
        }
    }
    for (uint64_t i = 0; i < n * n; i++)
        count += is_edge[i];
    assert_int_equal(a.first[n], count);
    incode_adjacency_free(&a);
    assert_null(a.to);
    incode_adjacency_free(&a);
    free(is_edge);
}

TEST(test_edges) {
    static const char *const kinds[] = {"uniform", "grid", "hub", "sphere"};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct set s = made(kinds[i], 900);
        for (unsigned threads = 0; threads < 17; threads += 1 + threads / 2)
            check_edges(&s, threads);
        set_free(&s);
    }
}

/* Duplicates have none. */
TEST(test_edges_of_duplicates) {
    double *xyz = malloc(3 * 100 * sizeof *xyz);
    assert_non_null(xyz);
    for (int i = 0; i < 300; i++)
        xyz[i] = (double)draw(4);
    struct set s = set_of(xyz, 100);
    assert_true(s.t.duplicate_count > 0);
    check_edges(&s, 1);
    set_free(&s);
}

TEST(test_edges_and_their_limits) {
    struct set s = made("uniform", 3000);
    struct incode_adjacency a;
    struct incode_options o = {.threads = 2, .memory_max = 1};
    unsigned tried = 0;
    enum incode_status status = INCODE_NO_MEMORY;
    for (; status == INCODE_NO_MEMORY; o.memory_max *= 2, tried++) {
        status = incode_adjacency(s.points, &s.t, &o, &a);
        assert_true(status == INCODE_OK || a.first == NULL);
    }
    assert_int_equal(status, INCODE_OK);
    assert_true(tried > 10);
    incode_adjacency_free(&a);
    int calls = 1;
    o = (struct incode_options){.progress = count_calls, .context = &calls};
    assert_int_equal(incode_adjacency(s.points, &s.t, &o, &a),
                     INCODE_CANCELLED);
    assert_null(a.to);
    o = (struct incode_options){.flags = INCODE_HULL};
    assert_int_equal(incode_adjacency(s.points, &s.t, &o, &a),
                     INCODE_BAD_ARGUMENT);
    assert_int_equal(incode_adjacency(s.points - 1, &s.t, NULL, &a),
                     INCODE_BAD_ARGUMENT);
    s.t.vertex[5][1] = s.t.vertex[5][0];
    assert_int_equal(incode_adjacency(s.points, &s.t, NULL, &a),
                     INCODE_BAD_ARGUMENT);
    assert_int_equal(incode_adjacency(3, &s.t, NULL, NULL),
                     INCODE_BAD_ARGUMENT);
    incode_adjacency_free(NULL);
    set_free(&s);
}
