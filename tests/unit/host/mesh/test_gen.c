/* Generated point sets: the same everywhere (known digests), and what their
 * names promise. */
#include <math.h>
#include <stdbool.h>

#include "tests/unit/test.h"
#include <nettle/sha2.h>

#include "host/mesh/gen.h"
#include "host/mesh/duplicates.h"

static struct host_points made(const char *kind, uint64_t n, uint64_t seed) {
    struct host_points points;
    struct host_error error = {0};
    assert_int_equal(host_gen(kind, n, seed, &points, &error), 0);
    assert_int_equal(points.count, n);
    for (uint64_t i = 0; i < 3 * n; i++)
        assert_true(isfinite(points.xyz[i]));
    return points;
}

TEST(digests_are_known) {
    static const char *const known[][2] = {
        {"uniform", "93dad7296d99889e"},  {"bubbles", "1d3a6942e6d59fe0"},
        {"bluntfin", "c462303f05f2c400"}, {"sphere", "9dadb48db2822cbf"},
        {"grid", "fb8430c1f27107f2"},     {"rotated", "fbaf1f72975c122a"},
        {"hub", "0d28c3a45ac13c23"},      {"shell", "4e018de5e65e184a"},
        {"cylinder", "c3ad1fd28045082f"}, {"torus", "e159813eb301437d"},
        {"terrain", "7ffa62f86fd6a645"},  {"scales", "f47bae9e658f47d1"},
        {"lines", "160c46caa63d51ac"},
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        struct host_points points = made(known[i][0], 1000, 42);
        struct sha256_ctx sha;
        uint8_t sum[SHA256_DIGEST_SIZE];
        char text[17];
        sha256_init(&sha);
        sha256_update(&sha, 24 * points.count, (const uint8_t *)points.xyz);
        sha256_digest(&sha, sizeof sum, sum);
        for (size_t k = 0; k < 8; k++)
            (void)snprintf(text + 2 * k, 3, "%02x", sum[k]);
        assert_string_equal(text, known[i][1]);
        assert_non_null(strstr(host_gen_kinds, known[i][0]));
        host_points_free(&points);
    }
}

static double length(const double *p) {
    return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
}

TEST(shapes_are_as_named) {
    struct host_points u = made("uniform", 5000, 1);
    double sum = 0;
    for (uint64_t i = 0; i < 15000; i++) {
        assert_true(u.xyz[i] >= 0 && u.xyz[i] < 1);
        sum += u.xyz[i];
    }
    assert_true(fabs(sum / 15000 - 0.5) < 0.01);
    host_points_free(&u);
    struct host_points s = made("sphere", 5000, 1);
    struct host_points h = made("hub", 5000, 1);
    assert_true(length(h.xyz) <= 0);
    for (uint64_t i = 1; i < 5000; i++) {
        assert_true(fabs(length(s.xyz + 3 * i) - 1) < 1e-15);
        assert_true(fabs(length(h.xyz + 3 * i) - 1) < 1e-15);
    }
    host_points_free(&s);
    host_points_free(&h);
    struct host_points g = made("grid", 1000, 1);
    assert_true(g.xyz[2997] >= 9 && g.xyz[2998] >= 9 && g.xyz[2999] >= 9);
    struct host_points r = made("rotated", 1000, 1);
    for (uint64_t i = 0; i < 1000; i++) {
        assert_true(fabs(length(g.xyz + 3 * i) - length(r.xyz + 3 * i)) <
                    1e-13);
    }
    host_points_free(&g);
    host_points_free(&r);
}

TEST(surfaces_are_as_named) {
    struct host_points s = made("shell", 5000, 1);
    struct host_points c = made("cylinder", 5000, 1);
    struct host_points t = made("torus", 5000, 1);
    for (uint64_t i = 0; i < 5000; i++) {
        double *p = c.xyz + 3 * i, *q = t.xyz + 3 * i;
        assert_in_range(1e6 * length(s.xyz + 3 * i), 998999, 1000000);
        assert_true(fabs(hypot(p[0], p[1]) - 1) < 1e-15);
        assert_true(p[2] >= 0 && p[2] < 4);
        assert_true(fabs(hypot(hypot(q[0], q[1]) - 1, q[2]) - 0.25) < 1e-15);
    }
    host_points_free(&s);
    host_points_free(&c);
    host_points_free(&t);
}

TEST(the_rest_is_as_named) {
    struct host_points t = made("terrain", 400, 1);
    struct host_points s = made("scales", 3000, 1);
    struct host_points l = made("lines", 400, 1);
    double most = 0, least = 1;
    for (uint64_t i = 0; i < 400; i++) {
        double *p = t.xyz + 3 * i, *q = l.xyz + 3 * i;
        assert_true(p[0] >= 10. * (double)(i % 20) &&
                    p[0] <= 10. * (double)(i % 20));
        assert_true(p[2] >= floor(p[2]) && p[2] >= 0 && p[2] < 1008);
        assert_true(i % 2 == 0 ? q[1] <= 0 && q[1] >= 0 && q[2] <= 0
                               : q[0] <= 0.5 && q[0] >= 0.5 && q[2] >= 1);
    }
    for (uint64_t k = 0; k < 9000; k++) {
        most = fmax(most, fabs(s.xyz[k]));
        least = fmin(least, fabs(s.xyz[k]));
    }
    assert_true(least >= 0x1p-1000 && least < 0x1p-990);
    assert_true(most <= 0x1p1000 && most > 0x1p990);
    host_points_free(&t);
    host_points_free(&s);
    host_points_free(&l);
}

/* As --help says it. */
TEST(some_kinds_have_no_chance_in_them) {
    static const struct {
        const char *kind;
        bool chance;
    } kinds[] = {{"uniform", true},  {"bubbles", true},   {"sphere", true},
                 {"hub", true},      {"bluntfin", false}, {"grid", false},
                 {"rotated", false}, {"shell", true},     {"cylinder", true},
                 {"torus", true},    {"terrain", true},   {"scales", true},
                 {"lines", true}};
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        struct host_points a = made(kinds[i].kind, 500, 1);
        struct host_points b = made(kinds[i].kind, 500, 2);
        int others = 0;
        for (int k = 0; k < 1500; k++)
            others += a.xyz[k] != b.xyz[k];
        assert_int_equal(others != 0, kinds[i].chance);
        host_points_free(&a);
        host_points_free(&b);
    }
}

TEST(seeds_differ_and_points_do_not_repeat) {
    static const char *const kinds[] = {
        "uniform",  "bubbles", "sphere",  "hub",    "shell",
        "cylinder", "torus",   "terrain", "scales", "lines"};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct host_points a = made(kinds[i], 2000, 1);
        struct host_points b = made(kinds[i], 2000, 2);
        assert_memory_not_equal(a.xyz, b.xyz, 24 * 2000);
        uint32_t lowest[2000];
        assert_int_equal(host_distinct_rows(a.xyz, 2000, lowest), 2000);
        host_points_free(&a);
        host_points_free(&b);
    }
    /* the blunt fin's shape: planes on planes of the same (x, y) */
    struct host_points fin = made("bluntfin", 40960, 1);
    for (uint64_t i = 0; i < 1280; i++) {
        assert_true(fin.xyz[3 * i] == fin.xyz[3 * (i + 1280 * 31)]);
        assert_true(fin.xyz[3 * i + 1] == fin.xyz[3 * (i + 1280 * 31) + 1]);
    }
    host_points_free(&fin);
}

TEST(wrong_requests_are_refused) {
    struct host_points points;
    struct host_error error = {0};
    assert_int_equal(host_gen("cube", 100, 1, &points, &error), HOST_USAGE);
    assert_non_null(strstr(error.text, "gen cube: no kind of point set; use"));
    error = (struct host_error){0};
    assert_int_equal(host_gen("grid", 3, 1, &points, &error), HOST_USAGE);
    error = (struct host_error){0};
    assert_int_equal(host_gen("grid", UINT64_C(1) << 32, 1, &points, &error),
                     HOST_USAGE);
}
