/* The check of a triangulation: right ones pass, every planted fault is found.
 * The reference that makes them agrees with the digests that came with the
 * data. */
#include <float.h>
#include <math.h>

#include "host/base/parallel.h"
#include "host/base/scratch.h"
#include "host/mesh/gen.h"
#include "host/verify/check.h"
#include "tests/unit/reference.h"
#include "tests/unit/test.h"

struct fixture {
    struct host_points points;
    struct host_tetrahedra tets;
};

static int verify(struct fixture *f, struct host_check_report *report) {
    struct host_error error = {0};
    return host_verify(&f->points, &f->tets, HOST_CHECK_DELAUNAY, report,
                       &error);
}

static void close_fixture(struct fixture *f) {
    host_points_free(&f->points);
    host_tetrahedra_free(&f->tets);
}

static struct fixture made(const char *kind, uint32_t n, uint64_t seed) {
    struct fixture f = {0};
    struct host_error error = {0};
    assert_int_equal(host_gen(kind, n, seed, &f.points, &error), 0);
    reference_delaunay(f.points.xyz, n, &f.tets);
    host_tetrahedra_sort(&f.tets);
    return f;
}

/* Expects a fault whose report holds `what`. */
static void expect(struct fixture *f, const char *what) {
    struct host_check_report report;
    struct host_error error = {0};
    assert_int_equal(
        host_verify(&f->points, &f->tets, HOST_CHECK_DELAUNAY, &report, &error),
        HOST_UNVERIFIED);
    assert_true(report.faults > 0);
    if (strstr(report.text, what) == NULL)
        fail_msg("expected '%s' in:\n%s", what, report.text);
    assert_null(strchr(error.text, '\n'));
    assert_non_null(strstr(error.text, "; "));
}

TEST(data_agrees) {
    static const struct {
        const char *name;
        uint64_t tetrahedra;
        const char *digest;
    } sets[] = {
        {"deg_cgal_T3_1", 62,
         "965a2ab30aa5b1b69d1e6436348fac2d9ba2d93857cf22992101a513144a35e0"},
        {"deg_cgal_grid5", 384,
         "aa529fc9acd28e8299a993865df4a5301ed7d6c611ced988e2bc9a92ad20b8a9"},
        {"deg_cgal_lp500", 3066,
         "2346073089467dd56941b34a8e3b687ecba04a59d13d043f90bae50f1cbd9e8c"},
        {"deg_cgal_nested_cubes", 84,
         "3511437730cc0c99fb86d73a2a4d9ce99a7ddd029159ea0c51642165bc544421"},
        {"deg_mourner_orient3d_denormal", 2,
         "e2225447bb3ff45bdb4c3eaf44dfd1448e3625c8fb1271060af020ab4273cc75"},
        {"deg_octahedron", 4,
         "b113519c1ede86210422008ba36baaf1024a77ecc12ee7daac1a5b2669256139"},
        {"deg_quickhull3d_issue2", 6,
         "1be8ef6fbcbb678b9efc982c78e2c19588f246c750f8775fdd7892024525d7cf"},
        {"deg_quickhull3d_issue38_dupcube", 6,
         "d98de334d30f68e8a3f130db6a7cf5d124a9361ece99d6c26fbac116e89b5489"},
        {"deg_scipy_16094_grid18", 24,
         "fc7d71460e71ac19f96ca6851181c8e394055c49f772455def5e750c65bbc577"},
        {"deg_spirula_60_thin_tet", 1,
         "baed642339816affb3fe8719792d0e4ce82f12db72b7373d244eaa65445800fe"},
        {"deg_trimesh_1446", 21,
         "b48df38ac2f525cffae1a993d8698e5aa4c03061b1a1626aa5bf751618796aae"},
    };
    for (size_t i = 0; i < sizeof sets / sizeof *sets; i++) {
        struct fixture f = {0};
        char file[96];
        (void)snprintf(file, sizeof file, "%s.xyz", sets[i].name);
        if (!reference_data(file, &f.points)) {
            print_message("%s: not there\n", file);
            skip();
        }
        reference_delaunay(f.points.xyz, (uint32_t)f.points.count, &f.tets);
        host_tetrahedra_sort(&f.tets);
        struct host_digest digest;
        host_digest(&f.tets, &digest);
        assert_int_equal(f.tets.count, sets[i].tetrahedra);
        assert_string_equal(digest.text + 7, sets[i].digest);
        /* As it is, and scaled far up and down; denormals only up. */
        bool tiny = strstr(file, "denormal") != NULL;
        static const int powers[] = {0, 500, -1000};
        for (int k = 0; k < (tiny ? 2 : 3); k++) {
            struct host_check_report report;
            struct host_error error = {0};
            for (uint64_t c = 0; c < 3 * f.points.count; c++)
                f.points.xyz[c] = ldexp(f.points.xyz[c], powers[k]);
            assert_int_equal(host_verify(&f.points, &f.tets,
                                         HOST_CHECK_DELAUNAY, &report, &error),
                             0);
            assert_int_equal(report.faults, 0);
        }
        close_fixture(&f);
    }
}

TEST(right_ones_pass) {
    static const struct {
        const char *kind;
        uint32_t n;
    } sets[] = {{"uniform", 4},    {"uniform", 5},  {"uniform", 700},
                {"bubbles", 500},  {"sphere", 400}, {"grid", 343},
                {"rotated", 343},  {"hub", 300},    {"bluntfin", 640},
                {"uniform", 1500}, {"grid", 100}};
    for (size_t i = 0; i < sizeof sets / sizeof *sets; i++) {
        struct fixture f = made(sets[i].kind, sets[i].n, i + 1);
        struct host_check_report r;
        int code = verify(&f, &r);
        if (code != 0)
            fail_msg("%s %u: %s", sets[i].kind, sets[i].n, r.text);
        assert_int_equal(r.tetrahedra, f.tets.count);
        assert_int_equal(r.hull_facets, 2 * r.hull_vertices - 4);
        close_fixture(&f);
    }
}

TEST(range_beyond_scaling) {
    struct fixture f = {0};
    struct host_error error = {0};
    assert_int_equal(host_gen("uniform", 60, 3, &f.points, &error), 0);
    for (uint64_t i = 0; i < 180; i++) {
        int power = i % 4 == 0 ? 1000 : i % 4 == 1 ? -1074 : 0;
        f.points.xyz[i] = ldexp(f.points.xyz[i] - 0.5, power);
    }
    reference_delaunay(f.points.xyz, 60, &f.tets);
    struct host_check_report r;
    assert_int_equal(verify(&f, &r), 0);
    close_fixture(&f);
}

/* Corners as far away as doubles go. */
TEST(ends_of_the_range) {
    struct fixture f = {0};
    struct host_error error = {0};
    for (int i = 0; i < 8; i++) {
        const double p[3] = {i & 1 ? DBL_MAX : -DBL_MAX,
                             i & 2 ? DBL_MAX : -DBL_MAX,
                             i & 4 ? DBL_MAX : -DBL_MAX};
        assert_int_equal(host_points_append(&f.points, p, 1, &error), 0);
    }
    reference_delaunay(f.points.xyz, 8, &f.tets);
    struct host_check_report r;
    assert_int_equal(verify(&f, &r), 0);
    close_fixture(&f);
}

TEST(each_turned_one_is_found) {
    struct fixture f = made("uniform", 40, 5);
    for (uint64_t i = 0; i < f.tets.count; i++) {
        uint32_t t = f.tets.v[i][2];
        f.tets.v[i][2] = f.tets.v[i][3];
        f.tets.v[i][3] = t;
        expect(&f, "is of negative orientation");
        host_tetrahedra_free(&f.tets);
        reference_delaunay(f.points.xyz, 40, &f.tets);
        host_tetrahedra_sort(&f.tets);
    }
    close_fixture(&f);
}

/* What is put aside is checked in an order of its own, here with two windows of
 * rows, and the report is the same. */
TEST(what_is_put_aside_is_checked_alike) {
    static const struct {
        uint32_t vertex;
        const char *what;
    } wrong[] = {{UINT32_MAX, ""},
                 {0, ""},
                 {6000, "is no row"},
                 {4100, "repeats an earlier one"}};
    struct fixture f = made("uniform", 6000, 8);
    struct host_scratch scratch;
    struct host_error error = {0};
    struct host_call call = {
        .threads = 4, .memory_max = UINT64_MAX, .scratch = &scratch};
    memcpy(f.points.xyz + 3 * 17, f.points.xyz + 3 * 4100, 24); /* a repeat */
    host_tetrahedra_free(&f.tets);
    reference_delaunay(f.points.xyz, 6000, &f.tets);
    assert_int_equal(
        host_scratch_begin_own(&scratch, "/tmp", 1 << 18, 4, &error), 0);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct host_check_report in_memory, aside;
        uint32_t *v = &f.tets.v[7000][1], before = *v;
        *v = i == 0 ? before : wrong[i].vertex;
        int code = verify(&f, &in_memory);
        host_call_enter(&call);
        assert_int_equal(verify(&f, &aside), code);
        assert_int_equal(call.memory, 0);
        host_call_enter(NULL);
        *v = before;
        assert_int_equal(code, i == 0 ? 0 : HOST_UNVERIFIED);
        assert_int_equal(aside.faults, in_memory.faults);
        assert_int_equal(aside.points, in_memory.points);
        assert_int_equal(aside.distinct, in_memory.distinct);
        assert_int_equal(aside.hull_facets, in_memory.hull_facets);
        assert_int_equal(aside.tetrahedra, in_memory.tetrahedra);
        assert_non_null(strstr(in_memory.text, wrong[i].what));
        assert_non_null(strstr(aside.text, wrong[i].what));
    }
    host_scratch_end(&scratch);
    close_fixture(&f);
}

TEST(each_missing_one_is_found) {
    struct fixture f = made("uniform", 40, 6);
    uint64_t count = f.tets.count;
    for (uint64_t i = 0; i < count; i++) {
        uint32_t kept[4], last[4];
        memcpy(kept, f.tets.v[i], sizeof kept);
        memcpy(last, f.tets.v[count - 1], sizeof last);
        memcpy(f.tets.v[i], last, sizeof last);
        host_tetrahedra_cut(&f.tets, count - 1);
        expect(&f, "");
        uint32_t(*room)[4] =
            host_tetrahedra_room(&f.tets, 1, &(struct host_error){0});
        memcpy(*room, kept, sizeof kept);
        host_tetrahedra_keep(&f.tets, 1);
        host_tetrahedra_sort(&f.tets);
    }
    close_fixture(&f);
}

TEST(each_doubled_one_is_found) {
    struct fixture f = made("uniform", 40, 7);
    uint64_t count = f.tets.count;
    for (uint64_t i = 0; i < count; i++) {
        uint32_t(*room)[4] =
            host_tetrahedra_room(&f.tets, 1, &(struct host_error){0});
        memcpy(*room, f.tets.v[i], sizeof *room);
        host_tetrahedra_keep(&f.tets, 1);
        expect(&f, "");
        host_tetrahedra_free(&f.tets);
        reference_delaunay(f.points.xyz, 40, &f.tets);
        host_tetrahedra_sort(&f.tets);
    }
    close_fixture(&f);
}

TEST(each_wrong_apex_is_found) {
    struct fixture f = made("uniform", 40, 8);
    for (uint64_t i = 0; i < f.tets.count; i++) {
        uint32_t *t = f.tets.v[i];
        uint32_t wrong = (t[3] + 1 + (uint32_t)i % 7) % 40;
        while (wrong == t[0] || wrong == t[1] || wrong == t[2] || wrong == t[3])
            wrong = (wrong + 1) % 40;
        t[3] = wrong;
        expect(&f, "");
        host_tetrahedra_free(&f.tets);
        reference_delaunay(f.points.xyz, 40, &f.tets);
        host_tetrahedra_sort(&f.tets);
    }
    close_fixture(&f);
}

static bool positive(const struct fixture *f, const uint32_t t[4]) {
    struct incode_tally tally = {0};
    const double *xyz = f->points.xyz;
    return incode_orient3d(&tally, xyz + 3 * t[0], xyz + 3 * t[1],
                           xyz + 3 * t[2], xyz + 3 * t[3]) > 0;
}

/* Two tetrahedra on facet p to three about the edge of their apexes; false
 * where their union is not convex. */
static bool flip(struct fixture *f, uint64_t i, uint64_t j, const uint32_t p[3],
                 uint32_t below, uint32_t above) {
    uint32_t made_of[3][4];
    for (int k = 0; k < 3; k++) {
        uint32_t t[4] = {p[k], p[(k + 1) % 3], below, above};
        memcpy(made_of[k], t, sizeof t);
        if (!positive(f, t))
            return false;
    }
    memcpy(f->tets.v[i], made_of[0], sizeof made_of[0]);
    memcpy(f->tets.v[j], made_of[1], sizeof made_of[1]);
    uint32_t(*room)[4] =
        host_tetrahedra_room(&f->tets, 1, &(struct host_error){0});
    memcpy(*room, made_of[2], sizeof made_of[2]);
    host_tetrahedra_keep(&f->tets, 1);
    return true;
}

/* Valid triangulations that differ by one flip: only the spheres tell. */
static int flips_found(const char *kind, uint32_t n, uint64_t seed) {
    struct fixture f = made(kind, n, seed);
    int flips = 0;
    for (uint64_t i = 0; i < f.tets.count; i++) {
        for (uint64_t j = i + 1; j < f.tets.count; j++) {
            for (uint32_t c = 0; c < 4; c++) {
                uint32_t p[3], above = UINT32_MAX;
                int shared = 0;
                host_facet_outward(f.tets.v[i], c, p);
                for (int k = 0; k < 4; k++) {
                    uint32_t v = f.tets.v[j][k];
                    bool on = v == p[0] || v == p[1] || v == p[2];
                    shared += on;
                    above = on ? above : v;
                }
                if (shared == 3 && flip(&f, i, j, p, f.tets.v[i][c], above)) {
                    flips++;
                    expect(&f, "not Delaunay");
                    host_tetrahedra_free(&f.tets);
                    reference_delaunay(f.points.xyz, n, &f.tets);
                    host_tetrahedra_sort(&f.tets);
                }
            }
        }
    }
    close_fixture(&f);
    return flips;
}

TEST(each_flip_is_found) {
    assert_true(flips_found("uniform", 30, 9) >= 10);
    assert_true(flips_found("grid", 27, 9) >= 0);
}

/* Six cospherical points: three ways to cut them, one is right. */
TEST(wrong_ties_are_found) {
    const double xyz[18] = {1, 0,  0, -1, 0, 0, 0, 1, 0,
                            0, -1, 0, 0,  0, 1, 0, 0, -1};
    int passed = 0;
    for (uint32_t axis = 0; axis < 3; axis++) {
        struct fixture f = {0};
        struct host_error error = {0};
        assert_int_equal(host_points_append(&f.points, xyz, 6, &error), 0);
        uint32_t a = 2 * axis, b = a + 1, c = (a + 2) % 6, d = (a + 4) % 6;
        uint32_t ring[4] = {c, d, c + 1, d + 1};
        for (int k = 0; k < 4; k++) {
            uint32_t t[4] = {a, b, ring[k], ring[(k + 1) % 4]};
            if (!positive(&f, t))
                t[0] = b, t[1] = a;
            uint32_t(*room)[4] = host_tetrahedra_room(&f.tets, 1, &error);
            memcpy(*room, t, sizeof t);
            host_tetrahedra_keep(&f.tets, 1);
        }
        struct host_check_report r;
        passed += verify(&f, &r) == 0;
        if (r.faults > 0)
            assert_non_null(strstr(r.text, "not Delaunay"));
        close_fixture(&f);
    }
    assert_int_equal(passed, 1);
}

TEST(unused_points_are_found) {
    struct fixture f = made("uniform", 40, 10);
    struct host_error error = {0};
    const double inside[3] = {0.5, 0.5, 0.5}, outside[3] = {2, 2, 2};
    assert_int_equal(host_points_append(&f.points, inside, 1, &error), 0);
    expect(&f, "point (40) is a vertex of no tetrahedron");
    f.points.count--;
    assert_int_equal(host_points_append(&f.points, outside, 1, &error), 0);
    expect(&f, "point (40) is a vertex of no tetrahedron");
    f.points.count = 39;
    expect(&f, "no row of the points");
    close_fixture(&f);
}

TEST(duplicates_stand_for_the_lowest) {
    struct fixture f = made("uniform", 40, 11);
    struct host_error error = {0};
    struct host_check_report r;
    double copy[3];
    memcpy(copy, f.points.xyz + 3 * 7, sizeof copy);
    assert_int_equal(host_points_append(&f.points, copy, 1, &error), 0);
    assert_int_equal(verify(&f, &r), 0);
    assert_int_equal(r.distinct, 40);
    for (uint64_t i = 0; i < f.tets.count; i++)
        for (int k = 0; k < 4; k++)
            f.tets.v[i][k] = f.tets.v[i][k] == 7 ? 40 : f.tets.v[i][k];
    expect(&f, "repeats an earlier one");
    close_fixture(&f);
}

/* Odd and even points by themselves: every facet fits, and yet. */
TEST(two_bodies_are_found) {
    struct fixture f = made("uniform", 30, 12), g = made("uniform", 30, 13);
    struct host_error error = {0};
    assert_int_equal(host_points_append(&f.points, g.points.xyz, 30, &error),
                     0);
    for (uint64_t i = 0; i < g.tets.count; i++) {
        uint32_t(*room)[4] = host_tetrahedra_room(&f.tets, 1, &error);
        for (int k = 0; k < 4; k++)
            (*room)[k] = g.tets.v[i][k] + 30;
        host_tetrahedra_keep(&f.tets, 1);
    }
    expect(&f, "");
    close_fixture(&f);
    close_fixture(&g);
}

/* All tetrahedra at a vertex of the hull left out, and the vertex too: a dent
 * or another hull. */
TEST(dents_are_found) {
    struct fixture f = made("sphere", 60, 14);
    uint64_t kept = 0;
    for (uint64_t i = 0; i < f.tets.count; i++) {
        const uint32_t *t = f.tets.v[i];
        if (t[0] != 0)
            memmove(f.tets.v[kept++], t, sizeof *f.tets.v);
    }
    host_tetrahedra_cut(&f.tets, kept);
    expect(&f, "is a dent of the hull");
    close_fixture(&f);
}

TEST(nothing_is_no_triangulation) {
    struct fixture f = made("uniform", 10, 15);
    host_tetrahedra_cut(&f.tets, 0);
    expect(&f, "point (0) is a vertex of no tetrahedron");
    close_fixture(&f);
}

/* Rows of any numbers, the same vertex twice included. */
TEST(garbage_is_refused) {
    struct fixture f = {0};
    struct host_error error = {0};
    uint64_t state = 1;
    assert_int_equal(host_gen("grid", 27, 1, &f.points, &error), 0);
    for (int round = 0; round < 2000; round++) {
        host_tetrahedra_cut(&f.tets, 0);
        for (int i = 0; i < 1 + round % 40; i++) {
            uint32_t(*row)[4] = host_tetrahedra_room(&f.tets, 1, &error);
            for (int k = 0; k < 4; k++) {
                state = state * 6364136223846793005u + 1442695040888963407u;
                (*row)[k] =
                    (uint32_t)((state >> 33) % (27 + (unsigned)round % 2));
            }
            host_tetrahedra_keep(&f.tets, 1);
        }
        expect(&f, "");
    }
    close_fixture(&f);
}
