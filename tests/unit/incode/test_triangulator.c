/* The triangulator, with every index, against the digests that came with the
 * data and against a plain reference: regions, partitions, rules, memories,
 * pages that come at random, spilled faces, hubs, extreme coordinates. */
#include <float.h>
#include <math.h>

#include "host/verify/check.h"
#include "host/mesh/gen.h"
#include "tests/unit/emulated.h"
#include "tests/unit/reference.h"
#include "solo.h"
#include "tests/unit/test.h"

static const char *const index_names[] = {"naive", "grid", "kd"};
static const char *const build_names[] = {"auto", "faces", "points"};

/* Runs one case and compares the digest. */
static void expect(struct solo *s, const struct host_points *points,
                   const char *digest, const char *name) {
    struct solo start = *s;
    solo_run(s, points->xyz, points->count);
    if (strcmp(s->digest.text, digest) != 0) {
        fail_msg("%s, %s by %s, %u regions (%s), rule %d, %zu bytes, "
                 "shuffle %llu, chance %llu, pressure %u: %s, expected %s",
                 name, index_names[s->index], build_names[s->build], s->regions,
                 s->partition == HOST_UNIFORM ? "uniform" : "adaptive",
                 s->face_rule, s->memory, (unsigned long long)start.shuffle,
                 (unsigned long long)start.chance, s->pressure, s->digest.text,
                 digest);
    }
    solo_close(s);
}

static void reference_digest(const struct host_points *points,
                             struct host_digest *digest) {
    struct host_tetrahedra tets = {0};
    reference_delaunay(points->xyz, (uint32_t)points->count, &tets);
    host_tetrahedra_sort(&tets);
    host_digest(&tets, digest);
    host_tetrahedra_free(&tets);
}

/* A case face by face and, where that may be, point by point. */
static void expect_both(const struct solo *s, const struct host_points *points,
                        const char *digest, const char *name) {
    static const uint8_t builds[] = {INCODE_BUILD_FACES, INCODE_BUILD_POINTS,
                                     INCODE_BUILD_AUTO};
    bool both = s->index == INCODE_KD && s->face_rule == INCODE_FACE_OWN;
    for (int i = 0; i < (both ? 3 : 1); i++) {
        struct solo one = *s;
        one.build = builds[i];
        expect(&one, points, digest, name);
    }
}

/* Every index, region count, partition and rule, the rest drawn from a seed.
 * Under the sanitizers one of the four pairs of partition and rule. */
static void expect_all(const struct host_points *points, const char *digest,
                       const char *name, bool few) {
    static const uint32_t counts[] = {1, 32, 2, 8};
    uint64_t seed = 1;
    for (unsigned i = 0; i < 3; i++) {
        for (unsigned j = 0; j < (few ? 2 : 4); j++) {
            for (unsigned k = SANITIZED ? (i + j) % 4 : 0; k < 4;
                 k += SANITIZED ? 4 : 1) {
                seed = seed * UINT64_C(6364136223846793005) + 1442695040888963;
                struct solo s = {
                    .index = (uint8_t)i,
                    .regions = counts[j],
                    .partition = k & 1 ? HOST_UNIFORM : HOST_ADAPTIVE,
                    .face_rule = k & 2 ? INCODE_FACE_PAPER : INCODE_FACE_OWN,
                    .memory = seed >> 63 ? 0 : 4 << 20,
                    .shuffle = seed >> 62 & 1 ? seed : 0,
                    .chance = seed >> 61 & 1 ? seed : 0,
                    .false_start = seed >> 60 & 1,
                    .units = seed >> 59 & 1};
                expect_both(&s, points, digest, name);
            }
        }
    }
}

static const char *const degenerate[] = {
    "deg_cgal_T3_1",           "deg_cgal_grid5",
    "deg_cgal_nested_cubes",   "deg_mourner_orient3d_denormal",
    "deg_octahedron",          "deg_quickhull3d_issue2",
    "deg_scipy_16094_grid18",  "deg_quickhull3d_issue38_dupcube",
    "deg_spirula_60_thin_tet", "deg_trimesh_1446",
    "deg_cgal_lp500"};

/* Reads a set, or skips the test. */
static void read_set(const char *name, const char *suffix,
                     struct host_points *points) {
    char file[96];
    (void)snprintf(file, sizeof file, "%s%s", name, suffix);
    if (!reference_data(file, points)) {
        print_message("%s: not there\n", file);
        skip();
    }
}

TEST(degenerate_sets) {
    for (size_t i = 0; i < sizeof degenerate / sizeof *degenerate; i++) {
        struct host_points points = {0};
        struct host_digest digest;
        read_set(degenerate[i], ".xyz", &points);
        reference_digest(&points, &digest);
        expect_all(&points, digest.text, degenerate[i], points.count > 400);
        host_points_free(&points);
    }
}

/* Scaling by a power of two changes no sign, so the digest stays. */
TEST(scaled_sets) {
    static const int powers[] = {500, -500};
    for (size_t i = 0; i < sizeof degenerate / sizeof *degenerate; i++) {
        if (strstr(degenerate[i], "denormal") != NULL)
            continue;
        struct host_points points = {0};
        struct host_digest digest;
        read_set(degenerate[i], ".xyz", &points);
        reference_digest(&points, &digest);
        for (int k = 0; k < 2; k++) {
            struct host_points scaled = {0};
            struct host_error error = {0};
            (void)host_points_append(&scaled, points.xyz, points.count, &error);
            for (uint64_t j = 0; j < 3 * points.count; j++)
                scaled.xyz[j] = ldexp(points.xyz[j], powers[k]);
            expect_all(&scaled, digest.text, degenerate[i], true);
            host_points_free(&scaled);
        }
        host_points_free(&points);
    }
}

/* Coordinates of 2^1000 beside coordinates of 2^-1074. */
TEST(both_ends) {
    uint64_t seed = 3;
    for (int round = 0; round < 8; round += SANITIZED ? 2 : 1) {
        struct host_points points = {0};
        struct host_error error = {0};
        struct host_digest digest;
        for (int i = 0; i < 8 + 4 * round; i++) {
            double p[3];
            for (int d = 0; d < 3; d++) {
                seed = seed * UINT64_C(6364136223846793005) + 1442695040888963;
                int kind = (int)(seed >> 60), value = (int)(seed >> 50 & 7) - 3;
                p[d] = ldexp(value, kind < 6 ? 1000 : kind < 12 ? -1074 : 0);
                p[d] = p[d] == 0 ? 0 : p[d];
            }
            (void)host_points_append(&points, p, 1, &error);
        }
        reference_digest(&points, &digest);
        expect_all(&points, digest.text, "both ends", true);
        host_points_free(&points);
    }
}

static double draw(uint64_t *seed) {
    *seed = *seed * UINT64_C(6364136223846793005) + 1442695040888963;
    return (double)(*seed >> 11) * 0x1p-53;
}

/* One coordinate anywhere among doubles, each kind in its way. */
static double anywhere(int kind, uint64_t *seed) {
    double x = 2 * draw(seed) - 1;
    return kind == 0   ? DBL_MAX * (x < 0 ? 0.7 * x - 0.3 : 0.7 * x + 0.3)
           : kind == 1 ? DBL_MAX * 0.55 * x
                       : ldexp(floor(7.5 * x + 0.5), 1020);
}

/* Points over the whole range of doubles, where differences, boxes and their
 * sums overflow: they lie as the same points a little nearer. */
TEST(whole_range) {
    uint64_t seed = 5;
    for (int round = 0; round < (SANITIZED ? 3 : 9); round++) {
        struct host_points points = {0}, nearer = {0};
        struct host_error error = {0};
        struct host_digest digest;
        int kind = round % 3, count = kind < 2 ? 120 + 15 * round : 500;
        for (int i = 0; i < count; i++) {
            double p[3], q[3];
            for (int d = 0; d < 3; d++) {
                p[d] = anywhere(kind, &seed);
                q[d] = ldexp(p[d], -30);
            }
            (void)host_points_append(&points, p, 1, &error);
            (void)host_points_append(&nearer, q, 1, &error);
        }
        struct solo right = {
            .index = INCODE_KD, .build = INCODE_BUILD_FACES, .regions = 1};
        solo_run(&right, nearer.xyz, nearer.count);
        digest = right.digest;
        solo_close(&right);
        for (uint32_t k = 0; k < 4; k++) {
            struct solo s = {.index = INCODE_KD,
                             .regions = k & 1 ? 2 : 1,
                             .memory = 4 << 20,
                             .chance = k & 2 ? k : 0};
            expect_both(&s, &points, digest.text, "whole range");
        }
        host_points_free(&points);
        host_points_free(&nearer);
    }
}

/* Clusters of sizes that have nothing to do with each other, and points so far
 * away that differences overflow and products underflow, at every index's
 * expense but kd's.  Under the sanitizers as many rounds as take each kind of
 * size, far point and count of them: they look for wrong accesses, not for
 * wrong digests. */
TEST(mixed_scales) {
    uint64_t seed = 11;
    for (int round = 0; round < (SANITIZED ? 3 : 24); round++) {
        struct host_points points = {0};
        struct host_error error = {0};
        struct host_digest digest;
        unsigned clusters = 1 + (unsigned)(3 * draw(&seed));
        for (unsigned c = 0; c < clusters; c++) {
            int size =
                (int)(round % 3 == 0 ? -530 * draw(&seed) : -60 * draw(&seed));
            bool coplanar = draw(&seed) < 0.5;
            for (int i = 0; i < 30; i++) {
                double p[3];
                for (int d = 0; d < 3; d++)
                    p[d] = ldexp(draw(&seed), size);
                p[2] = coplanar ? p[0] + p[1] : p[2];
                (void)host_points_append(&points, p, 1, &error);
            }
        }
        for (int i = 0; i < 1 + round % 5; i++) {
            double p[3], far = round % 2 == 0 ? 1.7e308 : 1e80;
            for (int d = 0; d < 3; d++) {
                double x = draw(&seed);
                p[d] = x < 0.3 ? far : x < 0.6 ? -far : x;
            }
            (void)host_points_append(&points, p, 1, &error);
        }
        reference_digest(&points, &digest);
        for (uint32_t k = 0; k < 4; k++) {
            struct solo s = {.index = INCODE_KD,
                             .regions = k & 1 ? 2 : 1,
                             .chance = k + 1,
                             .pressure = k & 2 ? 500 : 0};
            expect_both(&s, &points, digest.text, "mixed scales");
        }
        host_points_free(&points);
    }
}

/* Points so near each other that products of what lies between them underflow,
 * beside faces of size 1: found by chance, 9 of 2,040 sets of this kind. */
TEST(denormal_neighbours) {
    static const double p[11][3] = {
        {0.34022349259302698, 0.064774195303455739, 0.2596715618713743},
        {0.27378745413338423, 0.29629881961085613, 0.087738947188406802},
        {0.15279961527933161, -0.23614348846863797, 0.047093660176793062},
        {0.068747626097264924, 0.87629374700182228, 0.47135538312594072},
        {-0.26549646467164867, -0.22219296545396572, 0.09840848316728279},
        {0.88899948510164173, 0.56394968132325196, 0.99542641915812347},
        {-0.080409286842619832, -0.040983218626951645, -0.2971513393817804},
        {0.17078414560015898, 0.11051530891052863, 0.91267288304445138},
        {-8 * 0x1p-1074, 4 * 0x1p-1074, -7 * 0x1p-1074},
        {-9 * 0x1p-1074, 8 * 0x1p-1074, 4 * 0x1p-1074},
        {-3 * 0x1p-1074, 5 * 0x1p-1074, 10 * 0x1p-1074}};
    struct host_points points = {0};
    struct host_error error = {0};
    struct host_digest digest;
    for (size_t i = 0; i < sizeof p / sizeof *p; i++)
        (void)host_points_append(&points, p[i], 1, &error);
    reference_digest(&points, &digest);
    expect_all(&points, digest.text, "denormal neighbours", false);
    host_points_free(&points);
}

static void made(const char *kind, uint64_t n, struct host_points *points) {
    struct host_error error = {0};
    if (host_gen(kind, n, 5, points, &error) != 0)
        fail_msg("%s", error.text);
}

TEST(made_sets) {
    static const char *const kinds[] = {
        "uniform", "bubbles", "bluntfin", "sphere", "grid", "rotated", "hub"};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct host_points points = {0};
        struct host_digest digest;
        made(kinds[i], 600, &points);
        reference_digest(&points, &digest);
        for (uint8_t index = 0; index < 3; index++) {
            for (uint32_t k = 0; k < 4; k++) {
                struct solo s = {
                    .index = index,
                    .regions = k & 1 ? 8 : 1,
                    .partition = k & 2 ? HOST_UNIFORM : HOST_ADAPTIVE,
                    .face_rule = index == 2 && k & 2 ? INCODE_FACE_PAPER
                                                     : INCODE_FACE_OWN,
                    .chance = k + 1,
                    .pressure = k & 1 ? 0 : 500};
                expect_both(&s, &points, digest.text, kinds[i]);
            }
        }
        host_points_free(&points);
    }
}

/* Two lines, and a curve of the third degree: a tetrahedron for each pair of
 * their segments, and searches in which nearly every point beats the one
 * before. */
TEST(curves) {
    enum { HALF = 30 };
    static double xyz[2][2 * HALF][3];
    for (int i = 0; i < 2 * HALF; i++) {
        double t = (double)i / HALF, *line = xyz[0][i], *curve = xyz[1][i];
        line[0] = i < HALF ? t : 0.5;
        line[1] = i < HALF ? 0 : t - 1;
        line[2] = i < HALF ? 0 : 1;
        curve[0] = t;
        curve[1] = t * t;
        curve[2] = t * t * t;
    }
    for (int k = 0; k < 2; k++) {
        struct host_points points = {.xyz = xyz[k][0], .count = 2 * HALF};
        struct host_digest digest;
        reference_digest(&points, &digest);
        expect_all(&points, digest.text, k == 0 ? "lines" : "curve", false);
    }
}

/* What a made set takes with all of its memory. */
static struct solo taken_by(const char *kind, uint64_t n) {
    struct host_points points = {0};
    struct solo s = {.index = INCODE_KD,
                     .build = INCODE_BUILD_FACES,
                     .regions = 1,
                     .memory = 4 << 20};
    made(kind, n, &points);
    solo_run(&s, points.xyz, points.count);
    solo_close(&s);
    host_points_free(&points);
    return s;
}

/* Sides that are coplanar up to rounding, where every point is in doubt about
 * every face: hardly more than the facets of the hull may have to look at all.
 */
TEST(rough_sides) {
    struct solo s = taken_by("rotated", 27000);
    assert_in_range(s.far_calls, 1, s.hulls);
}

/* Points on a sphere up to rounding: not every search that goes through the
 * sphere may look at every point. */
TEST(rough_sphere) {
    struct solo s = taken_by("sphere", 6000);
    assert_in_range(s.far_calls, 1, 1000);
}

/* Two grids up to rounding, the large one 2^1100 times the small one: what is
 * learned of one overflows where it is asked for the other. */
TEST(rough_at_both_ends) {
    struct host_points small = {0}, both = {0};
    struct host_error error = {0};
    made("rotated", SANITIZED ? 216 : 512, &small);
    made("rotated", SANITIZED ? 216 : 512, &both);
    for (uint64_t i = 0; i < 3 * small.count; i++) {
        both.xyz[i] = ldexp(both.xyz[i], 500);
        small.xyz[i] = ldexp(small.xyz[i], -600);
    }
    assert_int_equal(host_points_append(&both, small.xyz, small.count, &error),
                     0);
    for (int build = INCODE_BUILD_FACES; build <= INCODE_BUILD_POINTS;
         build++) {
        struct solo s = {.index = INCODE_KD,
                         .build = (uint8_t)build,
                         .regions = 1,
                         .memory = 4 << 20};
        struct host_check_report report;
        solo_run(&s, both.xyz, both.count);
        if (host_verify(&both, &s.tets, HOST_CHECK_DELAUNAY, &report, &error) !=
            0)
            fail_msg("%s", report.text);
        assert_int_equal(s.by_points > 0, build == INCODE_BUILD_POINTS);
        solo_close(&s);
    }
    host_points_free(&small);
    host_points_free(&both);
}

/* A front at one vertex that is far longer than what is kept at hand. */
TEST(hub) {
    struct host_points points = {0};
    struct host_digest digest[2];
    made("hub", 6000, &points);
    /* The hub in the middle of the order of work, not before it. */
    for (int d = 0; d < 3; d++)
        points.xyz[d] = 0.02 * (d + 1);
    for (unsigned k = 0; k < 8; k++) {
        struct solo s = {.index = INCODE_KD,
                         .build = INCODE_BUILD_FACES,
                         .regions = k & 1 ? 8 : 1,
                         .face_rule =
                             k & 2 ? INCODE_FACE_PAPER : INCODE_FACE_OWN,
                         .chance = k,
                         .brick_pressure = k & 4 ? 12 : 0};
        solo_run(&s, points.xyz, points.count);
        digest[k > 0] = s.digest;
        assert_string_equal(digest[k > 0].text, digest[0].text);
        assert_true(s.hubs > 0);
        if (s.brick_pressure != 0)
            assert_true(s.spilled > 0);
        solo_close(&s);
    }
    host_points_free(&points);
}

/* ---- larger sets ---- */

/* The digest of a set in INDEX.md beside it; false: it is not there. */
static bool known_digest(const char *name, char text[72]) {
    const char *folder = getenv("INCODE_DATA");
    char path[512], line[4096], hex[65], set[64];
    (void)snprintf(path, sizeof path, "%s/INDEX.md",
                   folder != NULL ? folder : "../shared/data");
    FILE *file = fopen(path, "r");
    bool found = false;
    while (file != NULL && !found && fgets(line, sizeof line, file) != NULL) {
        found = sscanf(line, "%64[0-9a-f]  %63s", hex, set) == 2 &&
                strcmp(set, name) == 0;
    }
    if (file != NULL)
        (void)fclose(file);
    if (found)
        (void)snprintf(text, 72, "sha256:%.64s", hex);
    return found;
}

struct real {
    const char *name;
    uint8_t index;
    uint32_t regions;
    uint32_t pressure;
};

TEST(real_sets) {
    static const struct real cases[] = {
        {"cactus", INCODE_NAIVE, 1, 0},  {"pdb_3GQP", INCODE_NAIVE, 8, 0},
        {"cactus", INCODE_GRID, 8, 600}, {"pdb_3GQP", INCODE_GRID, 2, 0},
        {"can_fem", INCODE_GRID, 32, 0}, {"office", INCODE_GRID, 1, 700},
        {"cactus", INCODE_KD, 32, 600},  {"mug_fem", INCODE_KD, 8, 600},
        {"pdb_3GQP", INCODE_KD, 1, 700}, {"can_fem", INCODE_KD, 2, 700},
        {"office", INCODE_KD, 8, 600},   {"hexa_amr", INCODE_KD, 1, 900},
        {"ocean_r", INCODE_KD, 8, 700},  {"bunny", INCODE_KD, 2, 0},
        {"halo_dm", INCODE_KD, 1, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases;
         i += SANITIZED ? 4 : 1) {
        const struct real *c = &cases[i];
        struct host_points points = {0};
        char digest[72];
        if (!known_digest(c->name, digest)) {
            print_message("INDEX.md: not there\n");
            skip();
        }
        read_set(c->name, ".xyz.gz", &points);
        struct solo s = {.index = c->index,
                         .build = INCODE_BUILD_FACES,
                         .regions = c->regions,
                         .partition = i & 1 ? HOST_UNIFORM : HOST_ADAPTIVE,
                         .face_rule =
                             i & 2 ? INCODE_FACE_PAPER : INCODE_FACE_OWN,
                         .shuffle = i & 1 ? i : 0,
                         .chance = i + 1,
                         .pressure = c->pressure};
        expect(&s, &points, digest, c->name);
        host_points_free(&points);
    }
}

/* ---- memory and the interface's refusals ---- */

TEST(smallest_memory) {
    struct host_points points = {0};
    made("uniform", 20000, &points);
    struct host_digest digest[2];
    static const size_t memories[] = {0, 512 << 10, 4 << 20};
    for (int i = 0; i < 3; i++) {
        struct solo s = {.index = INCODE_KD,
                         .build = INCODE_BUILD_FACES,
                         .regions = 1,
                         .memory = memories[i]};
        solo_run(&s, points.xyz, points.count);
        digest[i > 0] = s.digest;
        assert_string_equal(digest[i > 0].text, digest[0].text);
        const struct incode_map *map = incode_triangulator_map(s.t);
        assert_in_range(map->total, 1, s.memory);
        assert_true(map->frames >= map->frame_count * INCODE_PAGE_BYTES);
        assert_int_equal(s.evictions > 0, i < 2);
        solo_close(&s);
    }
    host_points_free(&points);
}

TEST(refusals) {
    struct host_points points = {0};
    made("uniform", 500, &points);
    struct solo s = {.index = INCODE_KD, .regions = 1};
    solo_open(&s, points.xyz, points.count);
    assert_int_equal(incode_triangulator_step(s.t), INCODE_FINISHED);
    solo_start(&s, 0);
    uint8_t page[INCODE_PAGE_BYTES] = {0};
    /* A page not asked for, faces not asked for. */
    assert_int_equal(incode_triangulator_page(s.t, 3, page, sizeof page), -1);
    assert_int_equal(incode_triangulator_page(s.t, INCODE_NONE, page, 24), -1);
    assert_int_equal(incode_triangulator_unspill(s.t, 0, NULL, 0, true), -1);
    while (s.page_count == 0)
        (void)incode_triangulator_step(s.t);
    /* Wrong sizes. */
    static const size_t sizes[] = {0, 1, 23, 25, 1535, 1537, 1567, 1569};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        uint8_t large[1600] = {0};
        assert_int_equal(
            incode_triangulator_page(s.t, s.pages[0], large, sizes[i]),
            INCODE_PAGE_UNSOUND);
    }
    /* All the same, it finishes. */
    assert_true(solo_step(&s, UINT64_MAX));
    solo_close(&s);
    host_points_free(&points);
}
