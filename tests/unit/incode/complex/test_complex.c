/* Whatever the order of insertion, one triangulation: the one that has each
 * tetrahedron whose sphere holds no other point, and no more. */
#include "complex_scene.h"

#include <math.h>

enum { SMALL = 14, LARGE = 1000, LINE = 20, DISC = 12 };

static uint64_t seed;

static int begin(void **unused) {
    (void)unused;
    seed = 88172645463325252u;
    return 0;
}

static double whole(int from, int to) {
    return from + (int)scene_draw(&seed, (uint32_t)(to - from + 1));
}

/* ---- sets ---- */

enum family {
    /* whole numbers, of which many are in a plane, on a line, on a sphere */
    GRID,
    PLANE_AND_ONE,
    PLANES,
    SPHERE,
    BOX,
    LINES,
    AXES,
    CIRCLES,
    WHOLE, /* so many are they */
    /* others */
    UNIFORM = WHOLE,
    ROUGH_PLANE,
    ROUGH_SPHERE,
    SPREAD,
    DENORMAL,
    WIDE,
    FAMILIES
};

static void set_point(double p[3], double x, double y, double z) {
    p[0] = x;
    p[1] = y;
    p[2] = z;
}

static void draw_whole(enum family family, uint32_t i, double p[3]) {
    static const int8_t circle[12][2] = {{5, 0},   {4, 3},  {3, 4},  {0, 5},
                                         {-3, 4},  {-4, 3}, {-5, 0}, {-4, -3},
                                         {-3, -4}, {0, -5}, {3, -4}, {4, -3}};
    uint32_t k = scene_draw(&seed, 12), d = scene_draw(&seed, 3);
    switch (family) {
    case GRID:
        set_point(p, whole(0, 2), whole(0, 2), whole(0, 2));
        break;
    case PLANE_AND_ONE:
        set_point(p, whole(0, 4), whole(0, 4), i == 0 ? whole(-1, 1) : 0);
        break;
    case PLANES:
        set_point(p, whole(0, 3), whole(0, 3), whole(0, 1));
        break;
    case SPHERE:
        do {
            set_point(p, whole(-3, 3), whole(-3, 3), whole(-3, 3));
        } while (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] != 9);
        break;
    case BOX:
        set_point(p, whole(0, 3), whole(0, 3), whole(0, 3));
        p[d] = whole(0, 1) * 3;
        break;
    case LINES:
        set_point(p, 0, 0, whole(0, 1));
        p[(int)p[2]] = whole(0, 8);
        break;
    case AXES:
        set_point(p, 0, 0, 0);
        p[d] = whole(-3, 3);
        break;
    default:
        set_point(p, circle[k][0], circle[k][1], whole(0, 2));
        break;
    }
}

static void draw_point(enum family family, uint32_t i, double p[3]) {
    double x = scene_unit(&seed) - 0.5, y = scene_unit(&seed) - 0.5,
           z = scene_unit(&seed) - 0.5, r = sqrt(x * x + y * y + z * z);
    switch (family) {
    case UNIFORM:
        set_point(p, x, y, z);
        break;
    case ROUGH_PLANE:
        set_point(p, x, y, 0.3 * x - 0.7 * y + 0.1);
        break;
    case ROUGH_SPHERE:
        set_point(p, 1 + x / r, 2 + y / r, 3 + z / r);
        break;
    case SPREAD:
        set_point(p, ldexp(x, -(int)whole(0, 60)), ldexp(y, -(int)whole(0, 60)),
                  ldexp(z, -(int)whole(0, 60)));
        break;
    case DENORMAL:
        set_point(p, whole(-9, 9) * 0x1p-1074, whole(-9, 9) * 0x1p-1074,
                  whole(0, 99999) * 0x1p-1074);
        break;
    case WIDE:
        draw_whole(GRID, i, p);
        set_point(p, p[0] * 0x1p-1000, p[1], p[2] * 0x1p900);
        break;
    default:
        draw_whole(family, i, p);
        break;
    }
}

/* n points, all different. */
static void draw_set(enum family family, double (*p)[3], uint32_t n) {
    for (uint32_t i = 0; i < n; i++) {
        bool again = false;
        draw_point(family, i, p[i]);
        for (uint32_t k = 0; k < i; k++)
            again = again || incode_lexicographic(p[i], p[k]) == 0;
        i -= again;
    }
}

/* Each four whose sphere holds no other. */
static void by_definition(const double (*p)[3], uint32_t n,
                          struct host_tetrahedra *tets) {
    struct incode_tally tally = {0};
    for (uint32_t m = 0; m < 1u << n; m++) {
        uint32_t t[4], count = 0;
        for (uint32_t i = 0; i < n && count < 5; i++) {
            if ((m >> i & 1) == 0)
                continue;
            if (count < 4)
                t[count] = i;
            count++;
        }
        if (count != 4)
            continue;
        int sign = incode_orient3d(&tally, p[t[0]], p[t[1]], p[t[2]], p[t[3]]);
        uint32_t a = t[sign < 0], b = t[sign >= 0];
        bool empty = sign != 0;
        for (uint32_t i = 0; i < n && empty; i++)
            empty = (m >> i & 1) != 0 ||
                    incode_in_sphere(&tally, p[a], p[b], p[t[2]], p[t[3]],
                                     p[i]) < 0;
        if (empty)
            scene_append(tets, a, b, t[2], t[3]);
    }
    host_tetrahedra_sort(tets);
}

/* ---- small sets, looked at after each insertion ---- */

TEST_WITH(all_orders_are_one, begin, NULL) {
    struct scene s = {.each = true, .seed = 7};
    double p[SMALL][3];
    uint32_t row[SMALL], built = 0;
    for (int round = 0; round < 12 * FAMILIES; round++) {
        struct host_tetrahedra tets = {0};
        uint32_t n = 4 + scene_draw(&seed, SMALL - 3);
        draw_set((enum family)(round % FAMILIES), p, n);
        by_definition((const double(*)[3])p, n, &tets);
        for (int order = 0; order < 4; order++) {
            scene_open(&s, scene_bytes(SMALL));
            scene_shuffle(&seed, row, n);
            bool spans = scene_build(&s, (const double(*)[3])p, row, n);
            assert_int_equal(spans, tets.count > 0);
            if (spans)
                scene_compare(&s, &tets);
            built += spans;
            scene_close(&s);
        }
        host_tetrahedra_free(&tets);
    }
    assert_true(built > 40 * FAMILIES);
    assert_true(s.tally.exact_in_sphere > 1000);
}

/* Powers of two change nothing, down to denormals. */
TEST_WITH(all_scales_are_one, begin, NULL) {
    static const int power[] = {-1074, -1073, -1000, -540, -358, -214,
                                204,   340,   511,   900,  1015};
    double p[SMALL][3], q[SMALL][3];
    uint32_t row[SMALL], built = 0;
    for (int family = 0; family < WHOLE; family++) {
        struct host_tetrahedra tets = {0};
        draw_set((enum family)family, p, SMALL);
        by_definition((const double(*)[3])p, SMALL, &tets);
        for (size_t i = 0; i < sizeof power / sizeof *power; i++) {
            struct scene s = {.seed = 7};
            for (int k = 0; k < 3 * SMALL; k++)
                q[k / 3][k % 3] = ldexp(p[k / 3][k % 3], power[i]);
            scene_open(&s, scene_bytes(SMALL));
            scene_shuffle(&seed, row, SMALL);
            if (scene_build(&s, (const double(*)[3])q, row, SMALL)) {
                scene_compare(&s, &tets);
                built++;
            }
            scene_close(&s);
        }
        host_tetrahedra_free(&tets);
    }
    assert_true(built > 70);
}

/* ---- larger ones ---- */

/* In the given order, in the opposite one, and in others; returns how many
 * tetrahedra there are. */
static uint64_t one_whatever_the_order(double (*p)[3], uint32_t n) {
    struct host_tetrahedra tets = {0};
    uint32_t *row = malloc(n * sizeof *row);
    assert_non_null(row);
    for (int order = 0; order < 4; order++) {
        struct scene s = {.each = n < 40, .seed = 7};
        for (uint32_t i = 0; i < n; i++)
            row[i] = order == 0 ? i : n - 1 - i;
        if (order > 1)
            scene_shuffle(&seed, row, n);
        scene_open(&s, scene_used(n + 1, 20 * n + 400));
        assert_true(scene_build(&s, (const double(*)[3])p, row, n));
        if (order == 0)
            scene_tetrahedra(&s, &tets);
        else
            scene_compare(&s, &tets);
        scene_close(&s);
    }
    uint64_t count = tets.count;
    host_tetrahedra_free(&tets);
    free(row);
    return count;
}

static uint32_t cube(double (*p)[3], int side, bool hollow) {
    uint32_t n = 0;
    for (int i = 0; i < side * side * side; i++) {
        const int at[3] = {i / side / side, i / side % side, i % side};
        bool within = true;
        for (int d = 0; d < 3; d++)
            within = within && at[d] > 0 && at[d] < side - 1;
        if (!hollow || !within)
            set_point(p[n++], at[0], at[1], at[2]);
    }
    return n;
}

TEST_WITH(cubes, begin, NULL) {
    static double p[LARGE][3];
    for (int side = 2; side < 6; side++)
        assert_in_range(one_whatever_the_order(p, cube(p, side, false)),
                        5 * (side - 1) * (side - 1) * (side - 1),
                        6 * (side - 1) * (side - 1) * (side - 1));
    (void)one_whatever_the_order(p, cube(p, 6, true));
}

TEST_WITH(points_of_spheres, begin, NULL) {
    double p[31][3];
    draw_set(SPHERE, p, 30);
    (void)one_whatever_the_order(p, 30);
    set_point(p[30], 0, 0, 0);
    (void)one_whatever_the_order(p, 31);
    draw_set(CIRCLES, p, 30);
    (void)one_whatever_the_order(p, 30);
}

/* Each piece of one line sees each of the other, until a point between them
 * takes many of them away. */
TEST_WITH(skew_lines, begin, NULL) {
    double p[2 * LINE + 1][3];
    for (int i = 0; i < LINE; i++) {
        set_point(p[2 * i], i, 0, 0);
        set_point(p[2 * i + 1], 0, i, 1);
    }
    assert_int_equal(one_whatever_the_order(p, 2 * LINE),
                     (LINE - 1) * (LINE - 1));
    set_point(p[2 * LINE], 0.25, 0.125, 0.5);
    (void)one_whatever_the_order(p, 2 * LINE + 1);
}

/* A hull facet of many points, those of it that come later outside it, and what
 * sees all of it at once, first or last. */
TEST_WITH(one_side_of_many_points, begin, NULL) {
    double p[DISC * DISC + 2][3];
    uint32_t n = DISC * DISC;
    for (int x = 0; x < DISC; x++)
        for (int y = 0; y < DISC; y++)
            set_point(p[DISC * x + y + 1], x, y, 0);
    set_point(p[0], 1, 2, -1);
    assert_int_equal(one_whatever_the_order(p, n + 1),
                     2 * (DISC - 1) * (DISC - 1));
    set_point(p[n + 1], 3, 4, 1000);
    assert_int_equal(one_whatever_the_order(p, n + 2),
                     4 * (DISC - 1) * (DISC - 1));
}

TEST_WITH(points_at_random, begin, NULL) {
    static double p[LARGE][3];
    draw_set(UNIFORM, p, LARGE);
    assert_in_range(one_whatever_the_order(p, LARGE), 6 * LARGE, 7 * LARGE);
    draw_set(ROUGH_PLANE, p, LARGE / 5);
    (void)one_whatever_the_order(p, LARGE / 5);
}
