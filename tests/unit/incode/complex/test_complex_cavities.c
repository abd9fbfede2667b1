/* Cavities of few facets and of many, by the thousand: a hub within a sphere of
 * points is in one of as many facets as the sphere has. */
#include "complex_scene.h"

#include <math.h>

enum { HUB_MAX = 80, SPHERE = 3000, LATTICE = 2000, EPOCHS = 700 };

static uint64_t seed;

static int begin(void **unused) {
    (void)unused;
    seed = 88172645463325252u;
    return 0;
}

/* On a sphere of radius 1 about 0, but for rounding; all different. */
static void draw_sphere(double (*p)[3], uint32_t n) {
    for (uint32_t i = 0; i < n; i++) {
        double x = scene_unit(&seed) - 0.5, y = scene_unit(&seed) - 0.5,
               z = scene_unit(&seed) - 0.5, r = sqrt(x * x + y * y + z * z);
        p[i][0] = x / r;
        p[i][1] = y / r;
        p[i][2] = z / r;
    }
}

/* The whole numbers with the squares' sum n. */
static uint32_t lattice_sphere(double (*p)[3], int n) {
    uint32_t count = 0;
    int most = (int)sqrt(n);
    for (int x = -most; x <= most; x++)
        for (int y = -most; y <= most; y++)
            for (int z = -most; z <= most; z++)
                if (x * x + y * y + z * z == n) {
                    assert_true(count < LATTICE);
                    p[count][0] = x;
                    p[count][1] = y;
                    p[count++][2] = z;
                }
    return count;
}

/* Finite cells with the vertex of this id, and without. */
static void count_with(const struct host_tetrahedra *tets, uint32_t id,
                       uint64_t count[2]) {
    count[0] = count[1] = 0;
    for (uint64_t i = 0; i < tets->count; i++) {
        const uint32_t *t = tets->v[i];
        bool with = t[0] == id || t[1] == id || t[2] == id || t[3] == id;
        count[with]++;
    }
}

/* n points in a sphere and a last one, their hub, that comes after `before` of
 * them; appends the tetrahedra. */
static void build_hub(double (*p)[3], uint32_t n, uint32_t before,
                      struct host_tetrahedra *tets) {
    struct scene s = {.seed = 7};
    uint32_t *row = malloc((n + 1) * sizeof *row);
    assert_non_null(row);
    for (uint32_t i = 0; i <= n; i++)
        row[i] = i < before ? i : i == before ? n : i - 1;
    scene_open(&s, scene_used(n + 2, 20 * n + 400));
    assert_true(scene_build(&s, (const double(*)[3])p, row, n + 1));
    scene_tetrahedra(&s, tets);
    scene_close(&s);
    free(row);
}

/* The last comes into a cavity of 2 n - 4 facets: all numbers of them, where
 * there is room for their edges on the stack and where there is not. */
TEST_WITH(cavities_of_each_size, begin, NULL) {
    double p[HUB_MAX + 1][3] = {{0}};
    for (uint32_t n = 4; n <= HUB_MAX; n++) {
        struct host_tetrahedra first = {0}, last = {0};
        uint64_t count[2];
        draw_sphere(p, n);
        memset(p[n], 0, sizeof p[n]);
        build_hub(p, n, 0, &first);
        build_hub(p, n, n, &last);
        assert_int_equal(first.count, last.count);
        assert_memory_equal(first.v, last.v, first.count * sizeof *first.v);
        if (n > 40) {
            count_with(&last, n, count);
            assert_int_equal(count[0], 0);
            assert_int_equal(count[1], 2 * n - 4);
        }
        host_tetrahedra_free(&first);
        host_tetrahedra_free(&last);
    }
}

TEST_WITH(a_hub_of_thousands, begin, NULL) {
    static double p[SPHERE + 1][3];
    struct host_tetrahedra tets[3] = {{0}};
    static const uint32_t before[3] = {0, SPHERE, SPHERE / 2};
    uint64_t count[2];
    draw_sphere(p, SPHERE);
    for (int i = 0; i < 3; i++) {
        build_hub(p, SPHERE, before[i], &tets[i]);
        assert_int_equal(tets[i].count, tets[0].count);
        assert_memory_equal(tets[i].v, tets[0].v,
                            tets[0].count * sizeof *tets[0].v);
    }
    count_with(&tets[0], SPHERE, count);
    assert_in_range(count[1], 2 * SPHERE - 40, 2 * SPHERE - 4);
    for (int i = 0; i < 3; i++)
        host_tetrahedra_free(&tets[i]);
}

/* All spheres are one, and it holds the hub. */
TEST_WITH(a_hub_of_ties, begin, NULL) {
    static double p[LATTICE + 1][3];
    struct host_tetrahedra first = {0}, last = {0};
    uint64_t count[2];
    uint32_t n = lattice_sphere(p, 1001);
    assert_in_range(n, 200, LATTICE);
    build_hub(p, n, 0, &first);
    build_hub(p, n, n, &last);
    assert_int_equal(first.count, last.count);
    assert_memory_equal(first.v, last.v, first.count * sizeof *first.v);
    count_with(&first, n, count);
    assert_int_equal(count[0], 0);
    assert_int_equal(count[1], 2 * n - 4);
    host_tetrahedra_free(&first);
    host_tetrahedra_free(&last);
}

/* What an owner has put down of a cell stays until the cell gives way; of the
 * new cells, which are the new point's, nothing is put down. */
TEST_WITH(what_is_proved, begin, NULL) {
    static double p[SPHERE][3];
    struct scene s = {.seed = 7};
    uint8_t reach[2048];
    uint32_t list[2048], four[4], rows = 200;
    draw_sphere(p, rows);
    memset(p[150], 0, sizeof p[150]);
    scene_open(&s, scene_used(rows + 1, 2048));
    for (uint32_t i = 0; i < rows; i++)
        assert_int_equal(incode_complex_add(&s.x, p[i], i), i + 1);
    assert_true(scene_four(&s, 1, rows, four));
    assert_true(incode_complex_begin(&s.x, &s.tally, four));
    for (uint32_t v = 1; v <= rows; v++) {
        uint32_t live = scene_reach(&s, reach, list);
        for (uint32_t i = 0; i < live; i++)
            incode_cell_set_proved(incode_complex_cell(&s.x, list[i]),
                                   1 + v % 3);
        if (incode_complex_is_vertex(&s.x, v))
            continue;
        assert_true(incode_complex_insert(&s.x, &s.tally, v, scene_near(&s)));
        live = scene_reach(&s, reach, list);
        for (uint32_t i = 0; i < live; i++) {
            const struct incode_cell *c = incode_complex_cell(&s.x, list[i]);
            bool new = incode_cell_index(c, v) < 4;
            assert_int_equal(incode_cell_proved(c), new ? 0 : 1 + v % 3);
        }
    }
    scene_close(&s);
}

/* Cells that nobody has looked at for any number of insertions: one corner is
 * filled, then the other. */
TEST_WITH(marks_do_not_come_back, begin, NULL) {
    static double p[2 * EPOCHS][3];
    struct scene s = {.seed = 7};
    uint32_t row[2 * EPOCHS], n = 0;
    for (uint32_t run = 1; n < EPOCHS + 160; run++)
        for (uint32_t i = 0; i < run * run && i < 140; i++, n++) {
            for (int d = 0; d < 3; d++)
                p[n][d] = scene_unit(&seed) + (run % 2) * 4;
            row[n] = n;
        }
    assert_true(n <= 2 * EPOCHS);
    scene_open(&s, scene_bytes(n));
    assert_true(scene_build(&s, (const double(*)[3])p, row, n));
    scene_close(&s);
}
