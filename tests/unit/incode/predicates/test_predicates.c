/* The predicates against their definitions on integers of any length, more
 * than a million cases, and each stage against the others. */
#define TEST_OWN_MAIN

#include "tests/unit/test.h"
#include <zlib.h>

#include "incode/predicates/exact.h"
#include "incode/predicates/predicates.h"
#include "incode/predicates/double_double.h"
#include "tests/unit/emulated.h"
#include "exact_reference.h"
#include "hard_points.h"

/* Cases a family: 15 x (40,000 + 20,000 + 8,000 + 8,000) = 1,140,000 signs,
 * and as many again from other orders of the same points. */
enum { ORIENT3D = 40000, IN_SPHERE = 20000, DISTANCE = 8000, LINE = 8000 };

static long cases(long n) {
#ifdef INCODE_SANITIZED
    n /= 8;
#endif
    return emulated() ? n / 40 : n;
}

static void show(const char *what, int family, long number, double (*p)[3]) {
    fprintf(stderr, "%s, family %s, case %ld:\n", what, hard_names[family],
            number);
    for (int i = 0; i < 5; i++)
        fprintf(stderr, "  %a %a %a\n", p[i][0], p[i][1], p[i][2]);
}

static void expect(int got, int want, const char *what, int family, long number,
                   double (*p)[3]) {
    if (got != want) {
        show(what, family, number, p);
        fail_msg("%d, not %d", got, want);
    }
}

static int orient3d(double (*p)[3], int a, int b, int c, int d) {
    struct incode_tally tally = {0};
    return incode_orient3d(&tally, p[a], p[b], p[c], p[d]);
}

static int in_sphere(double (*p)[3], int a, int b, int c, int d, int e) {
    struct incode_tally tally = {0};
    return incode_in_sphere(&tally, p[a], p[b], p[c], p[d], p[e]);
}

/* The even permutations of four; exchange the first two for the odd ones. */
static const int even[12][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2},
                                {1, 0, 3, 2}, {1, 2, 0, 3}, {1, 3, 2, 0},
                                {2, 0, 1, 3}, {2, 1, 3, 0}, {2, 3, 0, 1},
                                {3, 0, 2, 1}, {3, 1, 0, 2}, {3, 2, 1, 0}};

/* ---- the reference itself ---- */

/* det with rows p1-p0, p2-p0, p3-p0 in rational arithmetic. */
static int rational_orient3d(double (*p)[3]) {
    static const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                    {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
    mpq_t m[3][3], t, sum;
    mpq_inits(t, sum, NULL);
    for (int i = 0; i < 9; i++) {
        mpq_init(m[i / 3][i % 3]);
        mpq_set_d(m[i / 3][i % 3], p[i / 3 + 1][i % 3]);
        mpq_set_d(t, p[0][i % 3]);
        mpq_sub(m[i / 3][i % 3], m[i / 3][i % 3], t);
    }
    for (int o = 0; o < 6; o++) {
        mpq_mul(t, m[0][order[o][0]], m[1][order[o][1]]);
        mpq_mul(t, t, m[2][order[o][2]]);
        (o < 3 ? mpq_add : mpq_sub)(sum, sum, t);
    }
    int sign = mpq_sgn(sum);
    for (int i = 0; i < 9; i++)
        mpq_clear(m[i / 3][i % 3]);
    mpq_clears(t, sum, NULL);
    return sign;
}

TEST(test_reference) {
    uint64_t seed = 11;
    double p[5][3];
    for (int family = 0; family < HARD_FAMILIES; family++) {
        for (long n = 0; n < 200; n++) {
            hard_points(&seed, (enum hard_family)family, p);
            expect(reference_orient3d(p), rational_orient3d(p), "reference",
                   family, n, p);
        }
    }
    /* By hand: the unit corner holds its centre, the cube's sixth corner is
     * on its sphere, beyond is outside. */
    double q[5][3] = {{0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {.5, .5, .5}};
    assert_int_equal(reference_orient3d(q), 1);
    assert_int_equal(reference_in_sphere(q, false), 1);
    q[4][0] = q[4][1] = 1;
    q[4][2] = 0;
    assert_int_equal(reference_in_sphere(q, false), 0);
    q[4][0] = 2;
    assert_int_equal(reference_in_sphere(q, false), -1);
}

/* ---- the predicates ---- */

TEST(test_orient3d) {
    uint64_t seed = 1;
    double p[5][3];
    for (int family = 0; family < HARD_FAMILIES; family++) {
        long zeros = 0;
        for (long n = 0; n < cases(ORIENT3D); n++) {
            hard_points(&seed, (enum hard_family)family, p);
            int want = reference_orient3d(p);
            zeros += want == 0;
            expect(orient3d(p, 0, 1, 2, 3), want, "orient3d", family, n, p);
            for (int o = (int)(n % 12), k = 0; k < 2; k++, o = (o + 5) % 12) {
                const int *e = even[o];
                expect(orient3d(p, e[0], e[1], e[2], e[3]), want, "even order",
                       family, n, p);
                expect(orient3d(p, e[1], e[0], e[2], e[3]), -want, "odd order",
                       family, n, p);
            }
        }
        print_message("orient3d, %s: %ld cases, %ld zeros\n",
                      hard_names[family], cases(ORIENT3D), zeros);
    }
}

/* Five distinct points of which the first four are positive. */
static void draw_positive(uint64_t *seed, int family, double (*p)[3]) {
    for (;;) {
        hard_points(seed, (enum hard_family)family, p);
        int o = hard_distinct(p) ? orient3d(p, 0, 1, 2, 3) : 0;
        if (o == 0)
            continue;
        if (o < 0) {
            double t[3];
            memcpy(t, p[0], sizeof t);
            memcpy(p[0], p[1], sizeof t);
            memcpy(p[1], t, sizeof t);
        }
        return;
    }
}

TEST(test_in_sphere) {
    uint64_t seed = 2;
    double p[5][3];
    for (int family = 0; family < HARD_FAMILIES; family++) {
        long ties = 0;
        for (long n = 0; n < cases(IN_SPHERE); n++) {
            draw_positive(&seed, family, p);
            int plain = reference_in_sphere(p, false), want = plain;
            /* The tie of large numbers takes long: one in eight. */
            bool check = plain != 0 || family < HARD_SPREAD || n % 8 == 0;
            ties += plain == 0;
            if (plain == 0 && check)
                want = reference_in_sphere(p, true);
            if (plain == 0 && !check)
                want = in_sphere(p, 0, 1, 2, 3, 4);
            assert_int_not_equal(want, 0);
            for (int o = 0; o < 12;
                 o += family < HARD_SPREAD ? 1 + (int)(n % 5) : 6) {
                const int *e = even[o];
                expect(in_sphere(p, e[0], e[1], e[2], e[3], 4), want,
                       "in_sphere", family, n, p);
            }
        }
        print_message("in_sphere, %s: %ld cases, %ld ties\n",
                      hard_names[family], cases(IN_SPHERE), ties);
    }
}

/* Of two candidates over a face exactly one is in the other's sphere, and of
 * three there is one that no other beats: what makes the apex unique. */
TEST(test_in_sphere_orders_candidates) {
    uint64_t seed = 3;
    double p[10][3];
    for (long n = 0; n < cases(60000); n++) {
        int family = (int)(n % 4) == 0 ? HARD_WIDE_BOX : HARD_SMALL_GRID;
        hard_points(&seed, (enum hard_family)family, p);
        hard_points(&seed, (enum hard_family)family, p + 5);
        if (!hard_distinct(p) || orient3d(p, 0, 1, 2, 3) <= 0 ||
            orient3d(p, 0, 1, 2, 4) <= 0)
            continue;
        expect(in_sphere(p, 0, 1, 2, 3, 4), -in_sphere(p, 0, 1, 2, 4, 3),
               "two candidates", family, n, p);
        struct incode_tally t = {0};
        double *q = p[5];
        if (incode_orient3d(&t, p[0], p[1], p[2], q) <= 0 ||
            incode_lexicographic(q, p[3]) == 0 ||
            incode_lexicographic(q, p[4]) == 0)
            continue;
        int a = in_sphere(p, 0, 1, 2, 3, 4), b = in_sphere(p, 0, 1, 2, 4, 5);
        if (a == b) /* 4 inside that of 3, 5 inside that of 4, or neither */
            expect(in_sphere(p, 0, 1, 2, 3, 5), a, "three candidates", family,
                   n, p);
    }
}

TEST(test_compare_distance) {
    uint64_t seed = 4;
    double p[5][3];
    for (int family = 0; family < HARD_FAMILIES; family++) {
        long zeros = 0;
        for (long n = 0; n < cases(DISTANCE); n++) {
            hard_points(&seed, (enum hard_family)family, p);
            /* As far on the other side, up to rounding. */
            for (int k = 0; n % 3 == 0 && k < 3; k++) {
                double mirrored = p[0][k] - (p[1][k] - p[0][k]);
                p[2][k] = fabs(mirrored) <= DBL_MAX ? mirrored : p[1][k];
            }
            int want = reference_compare_distance(p);
            zeros += want == 0;
            expect(incode_compare_distance(p[0], p[1], p[2]), want, "distance",
                   family, n, p);
            expect(incode_compare_distance(p[0], p[2], p[1]), -want,
                   "distance, exchanged", family, n, p);
        }
        print_message("distance, %s: %ld cases, %ld zeros\n",
                      hard_names[family], cases(DISTANCE), zeros);
    }
}

TEST(test_collinear) {
    uint64_t seed = 5;
    double p[5][3];
    for (int family = 0; family < HARD_FAMILIES; family++) {
        long lines = 0;
        for (long n = 0; n < cases(LINE); n++) {
            hard_points(&seed, (enum hard_family)family, p);
            for (int k = 0; n % 2 == 0 && k < 3; k++) {
                p[0][k] /= 8;
                p[1][k] /= 8;
                p[2][k] = p[1][k] + (p[1][k] - p[0][k]) * (double)(n % 3);
            }
            bool want = reference_collinear(p);
            lines += want;
            expect(incode_collinear(p[0], p[1], p[2]), want, "collinear",
                   family, n, p);
            expect(incode_collinear(p[2], p[0], p[1]), want,
                   "collinear, turned", family, n, p);
        }
        print_message("collinear, %s: %ld cases, %ld lines\n",
                      hard_names[family], cases(LINE), lines);
    }
}

TEST(test_lexicographic) {
    uint64_t seed = 6;
    double p[5][3];
    for (long n = 0; n < cases(20000); n++) {
        hard_points(&seed, n % 2 == 0 ? HARD_SMALL_GRID : HARD_EXPONENTS, p);
        assert_int_equal(incode_lexicographic(p[0], p[1]),
                         reference_above(p[0], p[1]) -
                             reference_above(p[1], p[0]));
    }
    double zero[3] = {0, 0.0, 0}, negative[3] = {-0.0, 0, -0.0};
    assert_int_equal(incode_lexicographic(zero, negative), 0);
}

/* ---- the stages ---- */

struct use {
    long fixed, pair, scaled, exact;
};

static double largest_difference(double (*p)[3], int first, int n,
                                 const double *origin) {
    double most = 0;
    for (int i = first; i < first + n; i++)
        for (int k = 0; k < 3; k++)
            most = fmax(most, fabs(p[i][k] - origin[k]));
    return most;
}

/* Every stage that claims to know must be right, the last one always, whether
 * or not an earlier one would have decided. */
static void check_orient3d_stages(double (*p)[3], int family, long number,
                                  struct use *use) {
    const double *q[4] = {p[0], p[1], p[2], p[3]};
    int want = reference_orient3d(p), sign;
    double most = largest_difference(p, 1, 3, p[0]);
    int64_t d[3][3];
    expect(incode_exact_orient3d(q), want, "exact orient3d", family, number, p);
    use->exact++;
    if (incode_fixed_differences(d, q + 1, 3, p[0], most)) {
        use->fixed++;
        expect(incode_fixed_orient3d((const int64_t(*)[3])d), want,
               "fixed orient3d", family, number, p);
        expect(incode_fixed_orient3d_portable((const int64_t(*)[3])d), want,
               "portable orient3d", family, number, p);
    }
    if (incode_pair_orient3d(q, most, &sign)) {
        use->pair++;
        expect(sign, want, "pair orient3d", family, number, p);
    }
    if (incode_scaled_orient3d(q, most, &sign)) {
        use->scaled++;
        expect(sign, want, "scaled orient3d", family, number, p);
    }
}

static void check_in_sphere_stages(double (*p)[3], int family, long number,
                                   struct use *use) {
    const double *q[5] = {p[0], p[1], p[2], p[3], p[4]};
    int want = reference_in_sphere(p, false), sign;
    double most = largest_difference(p, 0, 4, p[4]);
    int64_t d[4][3];
    struct incode_yield yield = {0};
    expect(incode_exact_in_sphere(q, &yield), want, "exact in_sphere", family,
           number, p);
    use->exact++;
    if (incode_pair_in_sphere(q, most, &sign)) {
        use->pair++;
        expect(sign, want, "pair in_sphere", family, number, p);
    }
    if (incode_scaled_in_sphere(q, most, &sign)) {
        use->scaled++;
        expect(sign, want, "scaled in_sphere", family, number, p);
    }
    bool fixed = incode_fixed_differences(d, q, 4, p[4], most);
    use->fixed += fixed;
    if (want == 0) { /* the integers break ties: positive points only */
        if (!hard_distinct(p) || reference_orient3d(p) <= 0)
            return;
        want = reference_in_sphere(p, true);
    }
    if (fixed) {
        expect(incode_fixed_in_sphere((const int64_t(*)[3])d, false), want,
               "fixed in_sphere", family, number, p);
        expect(incode_fixed_in_sphere_portable((const int64_t(*)[3])d), want,
               "portable in_sphere", family, number, p);
    }
}

TEST(test_stages) {
    uint64_t seed = 7;
    double p[5][3];
    struct use all = {0};
    for (int family = 0; family < HARD_FAMILIES; family++) {
        struct use use = {0};
        for (long n = 0; n < cases(3000); n++) {
            hard_points(&seed, (enum hard_family)family, p);
            check_orient3d_stages(p, family, n, &use);
            check_in_sphere_stages(p, family, n, &use);
        }
        print_message("stages, %s: %ld cases, integers %ld, pairs %ld, scaled "
                      "%ld\n",
                      hard_names[family], use.exact, use.fixed, use.pair,
                      use.scaled);
        if (family <= HARD_FLOATS || family == HARD_DENORMAL)
            assert_true(use.fixed > use.exact * 9 / 10);
        if (family == HARD_SPREAD)
            assert_true(use.pair > use.exact * 9 / 10 &&
                        use.fixed < use.exact / 2);
        if (family == HARD_EXPONENTS)
            assert_true(use.scaled > use.exact * 9 / 10);
        all.fixed += use.fixed;
        all.pair += use.pair;
        all.scaled += use.scaled;
    }
    assert_true(all.fixed > 0 && all.pair > 0 && all.scaled > 0);
}

/* Integers as large as the stage allows, and every size below. */
TEST(test_portable_integers) {
    uint64_t seed = 8;
    int64_t d[4][3];
    for (long n = 0; n < cases(50000); n++) {
        int bits = (int)(n % 62);
        for (int i = 0; i < 12; i++) {
            int64_t m =
                ((int64_t)1 << bits) -
                (int64_t)(hard_bits(&seed) >> (bits < 53 ? 53 - bits : 0));
            d[i / 3][i % 3] = hard_sign(&seed) < 0 ? -m : m;
            if (n % 7 == 0)
                d[i / 3][i % 3] = hard_sign(&seed) < 0 ? -((int64_t)1 << bits)
                                                       : (int64_t)1 << bits;
        }
        const int64_t(*c)[3] = (const int64_t(*)[3])d;
        assert_int_equal(incode_fixed_orient3d(c),
                         incode_fixed_orient3d_portable(c));
        assert_int_equal(incode_fixed_in_sphere(c, false),
                         incode_fixed_in_sphere_portable(c));
    }
}

TEST(test_two_product) {
    uint64_t seed = 9;
    mpz_t x, y, z;
    mpz_inits(x, y, z, NULL);
    for (long n = 0; n < cases(200000); n++) {
        double a = hard_sign(&seed) * (double)hard_bits(&seed);
        double b = hard_sign(&seed) * (double)hard_bits(&seed), e, f, g;
        double p = incode_two_product(a, b, &e);
        assert_true(p == incode_two_product_dekker(a, b, &f) && e == f);
        mpz_set_d(x, a);
        mpz_set_d(y, b);
        mpz_mul(z, x, y);
        mpz_set_d(x, p);
        mpz_set_d(y, e);
        mpz_add(x, x, y);
        assert_int_equal(mpz_cmp(x, z), 0);
        double up = ldexp(1, hard_below(&seed, 700) - 400);
        double q = incode_two_product(a * up, b, &e);
        assert_true(q == incode_two_product_dekker(a * up, b, &g) && e == g);
        assert_true(q == p * up && e == f * up);
    }
    mpz_clears(x, y, z, NULL);
    if (!INCODE_HAS_FMA)
        print_message("no fused multiply-add here: Dekker's product alone\n");
}

TEST(test_tally) {
    struct incode_tally tally = {0};
    double p[5][3] = {{0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {.5, .5, .5}};
    incode_orient3d(&tally, p[0], p[1], p[2], p[3]);
    incode_in_sphere(&tally, p[0], p[1], p[2], p[3], p[4]);
    assert_int_equal(tally.exact_orient3d + tally.exact_in_sphere, 0);
    incode_orient3d(&tally, p[0], p[1], p[2], p[2]);
    assert_int_equal(tally.exact_orient3d, 1);
    p[4][0] = 1;
    p[4][1] = 1;
    p[4][2] = 1;
    incode_in_sphere(&tally, p[0], p[1], p[2], p[3], p[4]);
    assert_int_equal(tally.exact_orient3d, 1);
    assert_int_equal(tally.exact_in_sphere, 1);
}

/* ---- points of others ---- */

/* Up to `room` points of an .xyz file, compressed or not. */
static size_t read_points(const char *path, double (*xyz)[3], size_t room) {
    char line[256];
    size_t n = 0;
    gzFile file = gzopen(path, "rb");
    assert_non_null(file);
    while (n < room && gzgets(file, line, sizeof line) != NULL) {
        double *p = xyz[n];
        n += sscanf(line, "%lf %lf %lf", &p[0], &p[1], &p[2]) == 3;
    }
    gzclose(file);
    return n;
}

enum { NEAR = 24, ROWS = 20000 };

/* Moves the NEAR points next to row `at` to the front. */
static void gather(double (*xyz)[3], size_t n, size_t at) {
    double from[3], t[3];
    memcpy(from, xyz[at], sizeof from);
    for (size_t i = 0; i < NEAR && i < n; i++) {
        size_t best = i;
        double least = INFINITY;
        for (size_t j = i; j < n; j++) {
            double d = 0;
            for (int k = 0; k < 3; k++)
                d += fabs(xyz[j][k] - from[k]);
            best = d < least ? j : best;
            least = fmin(d, least);
        }
        memcpy(t, xyz[i], sizeof t);
        memcpy(xyz[i], xyz[best], sizeof t);
        memcpy(xyz[best], t, sizeof t);
    }
}

static void check_rows(const char *name, double (*xyz)[3], size_t n) {
    static const double scales[3] = {1, 0x1p500, 0x1p-500};
    uint64_t seed = 10;
    double p[5][3];
    long ties = 0, spheres = 0;
    size_t near = n < NEAR ? n : NEAR;
    for (long number = 0; number < cases(4000); number++) {
        if (number % 200 == 0)
            gather(xyz, n, (size_t)hard_below(&seed, (int)n));
        for (int i = 0; i < 5; i++) {
            const double *q = xyz[hard_below(&seed, (int)near)];
            for (int k = 0; k < 3; k++)
                p[i][k] = q[k] * scales[number % 3];
        }
        int o = orient3d(p, 0, 1, 2, 3);
        expect(o, reference_orient3d(p), name, HARD_UNIFORM, number, p);
        if (o == 0 || !hard_distinct(p))
            continue;
        int want = reference_in_sphere(p, false), a = o > 0 ? 0 : 1;
        ties += want == 0;
        spheres++;
        if (want == 0)
            want = reference_in_sphere(p, true);
        /* The reference's sign follows the order of the four. */
        expect(in_sphere(p, a, 1 - a, 2, 3, 4), o * want, name, HARD_UNIFORM,
               number, p);
    }
    print_message("%s: %ld in_sphere, %ld ties\n", name, spheres, ties);
}

TEST(test_data) {
    static const char *const names[] = {"bluntfin.xyz.gz",
                                        "bunny.xyz.gz",
                                        "office.xyz.gz",
                                        "cactus.xyz.gz",
                                        "halo_dm.xyz.gz",
                                        "pdb_3GQP.xyz.gz",
                                        "deg_cgal_grid5.xyz",
                                        "deg_mourner_orient3d_denormal.xyz",
                                        "deg_octahedron.xyz",
                                        "deg_cgal_nested_cubes.xyz",
                                        "deg_trimesh_1446.xyz",
                                        "deg_spirula_60_thin_tet.xyz",
                                        "deg_quickhull3d_issue2.xyz"};
    static double xyz[ROWS][3];
    const char *data = getenv("INCODE_DATA");
    char path[1024];
    int found = 0;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        (void)snprintf(path, sizeof path, "%s/%s",
                       data != NULL ? data : "../shared/data", names[i]);
        FILE *file = fopen(path, "rb");
        if (file == NULL)
            continue;
        (void)fclose(file);
        size_t n = read_points(path, xyz, ROWS);
        found++;
        assert_true(n > 0);
        check_rows(names[i], xyz, n);
    }
    if (found == 0) {
        print_message("no files in %s\n",
                      data != NULL ? data : "../shared/data");
        skip();
    }
}

int main(void) {
    reference_start();
    int failed = test_run();
    reference_stop();
    return failed;
}
