/* Points are shown to a complex, which tells the cells that would give way, as
 * exact predicates tell them one by one, and takes back what is put down of
 * them, and of no other; it goes on as if nothing had been shown to it. */
#include "cavity_scene.h"

#include <math.h>

#include "tests/unit/emulated.h"

enum {
    POINTS = 240,
    SHOWN = 40,
    SPHERE = 3000,
    DISC = 30,
    /* So many are listed, with whatever is around them. */
    ALWAYS = (INCODE_COMPLEX_CAVITY - 1) / 4
};

static uint64_t seed;

static int begin(void **unused) {
    (void)unused;
    seed = 88172645463325252u;
    return 0;
}

/* ---- sets, of which points may be the same ---- */

static void volume(uint32_t i, double p[3]) {
    (void)i;
    for (int d = 0; d < 3; d++)
        p[d] = scene_unit(&seed);
}

static void grid(uint32_t i, double p[3]) {
    (void)i;
    for (int d = 0; d < 3; d++)
        p[d] = scene_draw(&seed, 7);
}

static void plane(uint32_t i, double p[3]) {
    volume(i, p);
    p[2] = i % 50 == 0 ? p[2] : 0.5 * p[0] - 0.25 * p[1];
}

static void sphere(uint32_t i, double p[3]) {
    double r = 0;
    volume(i, p);
    for (int d = 0; d < 3; d++) {
        p[d] -= 0.5;
        r += p[d] * p[d];
    }
    for (int d = 0; d < 3; d++)
        p[d] /= sqrt(r);
}

/* The whole numbers with the squares' sum 101, and some within. */
static void lattice_sphere(uint32_t i, double p[3]) {
    do {
        for (int d = 0; d < 3; d++)
            p[d] = (double)scene_draw(&seed, 21) - 10;
    } while (i % 20 != 0 && !(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] == 101));
}

/* Two, each of whose pieces sees each of the other. */
static void skew_lines(uint32_t i, double p[3]) {
    p[0] = i % 2 == 0 ? scene_draw(&seed, 60) : 0;
    p[1] = i % 2 == 0 ? 0 : scene_draw(&seed, 60);
    p[2] = i % 2;
}

static void lumps(uint32_t i, double p[3]) {
    volume(i, p);
    for (int d = 0; d < 3; d++)
        p[d] = i % 2 == 0 ? 3 + p[d] : p[d] * 0x1p-40;
}

typedef void drawing(uint32_t i, double p[3]);

static bool is_there(const double (*p)[3], uint32_t n, const double at[3]) {
    bool there = false;
    for (uint32_t i = 0; i < n; i++)
        there = there || incode_lexicographic(p[i], at) == 0;
    return there;
}

static uint32_t draw_set(drawing *draw, int exponent, double (*p)[3],
                         uint32_t n) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < n; i++) {
        draw(i, p[count]);
        for (int d = 0; d < 3; d++)
            p[count][d] = ldexp(p[count][d], exponent);
        count += !is_there((const double(*)[3])p, count, p[count]);
    }
    return count;
}

/* ---- what is shown ---- */

/* A vertex gives none, and nothing is put down of no cell. */
static void show_vertices(struct scene *s) {
    uint32_t cells[INCODE_COMPLEX_CAVITY];
    uint8_t *none = calloc(s->x.cells, 1);
    assert_non_null(none);
    for (uint32_t v = 1; v < s->x.points; v += 1 + s->x.points / SHOWN) {
        const double *p = s->x.point[v].p;
        if (!incode_complex_is_vertex(&s->x, v))
            continue;
        assert_int_equal(
            incode_complex_cavity(&s->x, &s->tally, p, scene_near(s), cells),
            0);
        scene_check_disproved(s, p, none);
    }
    free(none);
}

/* Most of a set's points are built, the others shown, and some far off; then
 * these are inserted.  Says which numbers of cells there were. */
static void show_others(drawing *draw, int exponent, bool *seen,
                        bool *refused) {
    static double p[POINTS][3];
    struct scene s = {.seed = 7};
    uint32_t row[POINTS], n = draw_set(draw, exponent, p, POINTS);
    uint32_t built = n - n / 4, step = 1 + n / 4 / SHOWN;
    bool listed;
    for (uint32_t i = 0; i < n; i++)
        row[i] = i;
    scene_open(&s, scene_used(n + 1, n * n + 64));
    assert_true(scene_build(&s, (const double(*)[3])p, row, built));
    scene_prove_all(&s);
    show_vertices(&s);
    for (uint32_t i = built; i < n; i += step)
        for (int far = 0; far < 2; far++) {
            double q[3];
            for (int d = 0; d < 3; d++)
                q[d] = p[i][d] * (far == 0 ? 1 : 64);
            if (far > 0 && is_there((const double(*)[3])p, n, q))
                continue;
            uint32_t count = scene_check_cavity(&s, q, &listed);
            assert_true(count > 0);
            seen[count < ALWAYS ? count : ALWAYS] = true;
            *refused = *refused || !listed;
        }
    scene_prove_none(&s);
    scene_check(&s);
    for (uint32_t i = built; i < n; i++) {
        uint32_t v = incode_complex_add(&s.x, p[i], i);
        assert_true(incode_complex_insert(&s.x, &s.tally, v, scene_near(&s)));
    }
    scene_check(&s);
    scene_close(&s);
}

TEST_WITH(those_that_hold_a_point, begin, NULL) {
    static drawing *const draw[] = {volume,         grid,       plane, sphere,
                                    lattice_sphere, skew_lines, lumps};
    static const int exponents[] = {0, -300, 300, -1000, 900};
    bool seen[ALWAYS + 1] = {false}, refused = false;
    uint32_t sizes = 0;
    for (size_t k = 0; k < sizeof draw / sizeof *draw; k++)
        for (size_t e = 0; e < sizeof exponents / sizeof *exponents; e++)
            show_others(draw[k], exponents[e], seen, &refused);
    for (int i = 0; i <= ALWAYS; i++)
        sizes += seen[i];
    assert_true(sizes > 40 && seen[1] && seen[2] && seen[ALWAYS]);
    assert_true(refused);
}

/* ---- by the thousand ---- */

/* All cells within a sphere of many points hold its hub, which comes after it
 * was shown; returns how many there are. */
static uint32_t show_hub(double (*p)[3], uint32_t n, bool *listed) {
    struct scene s = {.seed = 7};
    uint32_t *row = malloc(n * sizeof *row);
    const double hub[3] = {0, 0, 0};
    assert_non_null(row);
    for (uint32_t i = 0; i < n; i++)
        row[i] = i;
    scene_open(&s, scene_used(n + 2, 20 * n + 400));
    assert_true(scene_build(&s, (const double(*)[3])p, row, n));
    scene_prove_all(&s);
    uint32_t count = scene_check_cavity(&s, hub, listed);
    scene_prove_none(&s);
    uint32_t v = incode_complex_add(&s.x, hub, n);
    assert_true(incode_complex_insert(&s.x, &s.tally, v, scene_near(&s)));
    scene_check(&s);
    scene_close(&s);
    free(row);
    return count;
}

TEST_WITH(hubs_of_each_size, begin, NULL) {
    static double p[SPHERE][3];
    uint32_t listed_most = 0, refused = 0, most = SANITIZED ? 120 : 300;
    for (uint32_t n = 4; n <= most; n += n < 60 ? 1 : 12) {
        bool listed;
        draw_set(sphere, 0, p, n);
        uint32_t count = show_hub(p, n, &listed);
        assert_true(n < 40 || count > n);
        listed_most = listed && count > listed_most ? count : listed_most;
        refused += !listed;
    }
    assert_true(listed_most >= ALWAYS);
    assert_true(SANITIZED || refused > 0);
}

/* On a sphere but for rounding, and exactly, where all spheres are one. */
TEST_WITH(a_hub_of_thousands, begin, NULL) {
    static double p[SPHERE][3];
    uint32_t n = SANITIZED ? SPHERE / 3 : SPHERE;
    bool listed;
    assert_int_equal(draw_set(sphere, 0, p, n), n);
    assert_true(show_hub(p, n, &listed) > 2 * n);
    assert_false(listed);
    n = 0;
    for (int i = 0; i < 67 * 67 * 67; i++) {
        const int q[3] = {i / 67 / 67 - 33, i / 67 % 67 - 33, i % 67 - 33};
        if (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] == 1001) {
            for (int d = 0; d < 3; d++)
                p[n][d] = q[d];
            n++;
        }
    }
    assert_true(n > 200);
    assert_true(show_hub(p, n, &listed) > n);
    assert_false(listed);
}

/* A facet of many points, seen at once from far above it, where all cells that
 * give way are infinite; in its plane their circles tell, from outside and from
 * within. */
TEST_WITH(one_side_of_many_points, begin, NULL) {
    static double p[DISC * DISC + 1][3];
    uint32_t row[DISC * DISC + 1], n = DISC * DISC + 1, sides;
    struct scene s = {.seed = 7};
    bool listed;
    for (uint32_t i = 0; i < n; i++) {
        row[i] = i;
        uint32_t line = i / DISC;
        p[i][0] = i - line * DISC;
        p[i][1] = line;
    }
    p[n - 1][0] = 3, p[n - 1][1] = 4, p[n - 1][2] = -1;
    scene_open(&s, scene_bytes(n));
    assert_true(scene_build(&s, (const double(*)[3])p, row, n));
    scene_prove_all(&s);
    const double above[3] = {2, 5, 9}, outside[3] = {DISC, 4, 0},
                 within[3] = {2.5, 7.25, 0}, edge[3] = {2.5, 0, 0},
                 below[3] = {3, 4, -2};
    sides = scene_check_cavity(&s, above, &listed);
    assert_int_equal(sides, 2 * (DISC - 1) * (DISC - 1));
    assert_false(listed);
    assert_true(scene_check_cavity(&s, outside, &listed) > 0 && listed);
    assert_true(scene_check_cavity(&s, within, &listed) > 1 && listed);
    assert_true(scene_check_cavity(&s, edge, &listed) > 1 && listed);
    assert_true(scene_check_cavity(&s, below, &listed) > 0);
    scene_prove_none(&s);
    uint32_t v = incode_complex_add(&s.x, above, n);
    assert_int_not_equal(v, INCODE_NONE);
    assert_true(incode_complex_insert(&s.x, &s.tally, v, 1));
    scene_check(&s);
    scene_close(&s);
}
