/* Box pages: what is set lies in what is told, and is told exactly where it
 * can be. */
#include <float.h>
#include <math.h>

#include "incode/pages/pages.h"
#include "tests/unit/test.h"

static uint64_t state = 1;

static double draw(void) {
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

/* ---- along the axes ---- */

struct set {
    double lo[INCODE_FANOUT][3], hi[INCODE_FANOUT][3];
    double all_lo[3], all_hi[3];
    unsigned count;
};

/* Boxes of random corners, one coordinate from `a number`. */
static void fill(struct set *set, unsigned count, double (*number)(int d)) {
    set->count = count;
    for (int d = 0; d < 3; d++) {
        set->all_lo[d] = INFINITY;
        set->all_hi[d] = -INFINITY;
        for (unsigned i = 0; i < count; i++) {
            double a = number(d), b = number(d);
            set->lo[i][d] = fmin(a, b);
            set->hi[i][d] = fmax(a, b);
            set->all_lo[d] = fmin(set->all_lo[d], set->lo[i][d]);
            set->all_hi[d] = fmax(set->all_hi[d], set->hi[i][d]);
        }
    }
}

static void make(struct incode_boxes *boxes, const struct set *set) {
    incode_boxes_init(boxes, set->all_lo, set->all_hi);
    for (unsigned i = 0; i < set->count; i++)
        incode_boxes_set(boxes, i, set->lo[i], set->hi[i]);
}

/* A page of `count` boxes over as many bricks. */
static bool is_sound(const struct incode_boxes *boxes, const struct set *set) {
    struct incode_tree tree;
    incode_tree_init(&tree, set->count, 0);
    return incode_page_is_sound(&tree, set->all_lo, set->all_hi, tree.base[1],
                                boxes, sizeof *boxes);
}

/* In it and no farther out than rounding to 24 bits of a page's unit. */
static void check(const struct set *set) {
    struct incode_boxes boxes;
    double lo[3][INCODE_FANOUT], hi[3][INCODE_FANOUT];
    make(&boxes, set);
    incode_boxes_axes(&boxes, lo, hi);
    double slack = boxes.unit * 0x1p-22;
    for (int d = 0; d < 3; d++) {
        for (unsigned i = 0; i < INCODE_FANOUT; i++) {
            if (i >= set->count) {
                assert_true(lo[d][i] == INFINITY && hi[d][i] == -INFINITY);
                continue;
            }
            double a = set->lo[i][d], b = set->hi[i][d];
            assert_true(lo[d][i] <= a && lo[d][i] >= a - slack);
            assert_true(hi[d][i] >= b && hi[d][i] <= b + slack);
            assert_true(lo[d][i] >= -DBL_MAX && hi[d][i] <= DBL_MAX);
            /* In real arithmetic, which long doubles are here. */
            long double origin = boxes.origin[d], unit = boxes.unit;
            assert_true(unit * (long double)boxes.lo[d][i] <=
                        (long double)a - origin);
            assert_true(unit * (long double)boxes.hi[d][i] >=
                        (long double)b - origin);
            assert_true(fabsf(boxes.lo[d][i]) <= 2);
            assert_true(fabsf(boxes.hi[d][i]) <= 2);
        }
    }
    assert_true(is_sound(&boxes, set));
}

static double ordinary(int d) {
    return d - draw();
}

static double far_away(int d) {
    (void)d;
    return 1e6 + draw();
}

static double clusters(int d) {
    (void)d;
    return rint(draw() * 3) + ldexp(draw(), -(int)(draw() * 60));
}

static double scales(int d) {
    (void)d;
    return ldexp(draw() - 0.5, (int)(draw() * 2090) - 1070);
}

static double whole_range(int d) {
    (void)d;
    return draw() < 0.2   ? copysign(DBL_MAX, draw() - 0.5)
           : draw() < 0.2 ? 0
                          : (draw() * 2 - 1) * DBL_MAX;
}

static double large(int d) {
    (void)d;
    return 1e300 * draw();
}

static double small(int d) {
    (void)d;
    return 1e-300 * draw();
}

static double denormal(int d) {
    return d == 0 ? 0x1p-1074 * rint(draw() * 9) : draw() * 0x1p-1022;
}

static double skew(int d) {
    return d == 0   ? 1e300 + rint(draw()) * 0x1p960
           : d == 1 ? draw() * 1e-200
                    : 1e250;
}

static double one_point(int d) {
    return 1.1 * d;
}

TEST(boxes_hold_what_was_set) {
    double (*const numbers[])(int) = {ordinary, far_away,    clusters, scales,
                                      large,    whole_range, small,    denormal,
                                      skew,     one_point};
    struct set set;
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++) {
        for (unsigned count = 1; count <= INCODE_FANOUT; count++) {
            fill(&set, count, numbers[k]);
            check(&set);
        }
    }
}

/* A grid of whole numbers is told exactly, and so is a page of one point. */
TEST(what_fits_is_exact) {
    struct set set = {.count = 2,
                      .lo = {{-3, 5, 7}, {0, 0, 7}},
                      .hi = {{1, 6, 7}, {2, 9, 7}},
                      .all_lo = {-3, 0, 7},
                      .all_hi = {2, 9, 7}};
    struct incode_boxes boxes;
    double lo[3][INCODE_FANOUT], hi[3][INCODE_FANOUT];
    make(&boxes, &set);
    incode_boxes_axes(&boxes, lo, hi);
    for (int d = 0; d < 3; d++) {
        for (int i = 0; i < 2; i++) {
            assert_true(lo[d][i] == set.lo[i][d]);
            assert_true(hi[d][i] == set.hi[i][d]);
        }
    }
    assert_true(boxes.unit == 8);
    fill(&set, 1, one_point);
    make(&boxes, &set);
    incode_boxes_axes(&boxes, lo, hi);
    for (int d = 0; d < 3; d++)
        assert_true(lo[d][0] == 1.1 * d && hi[d][0] == 1.1 * d);
}

/* ---- lifted ---- */

static void one_lifted(struct incode_boxes *boxes) {
    struct set set = {.count = 2,
                      .lo = {{-4, -4, -4}, {0, -1, 1}},
                      .hi = {{4, 4, 4}, {4, 0, 1}},
                      .all_lo = {-4, -4, -4},
                      .all_hi = {4, 4, 4}};
    make(boxes, &set); /* unit 8; of child 1, m is (1/4, -1/16, 1/8), e 1/4 */
    boxes->is_lifted[1] = 1;
    boxes->centre[0][1] = 32767;
    boxes->centre[1][1] = -32767;
    boxes->half[0][1] = 0x3c00; /* 1 */
    boxes->half[1][1] = 0x3400; /* 1/4 */
    boxes->half[2][1] = 0x0200; /* 2^-15 */
    boxes->slope[0][1] = 32;
    boxes->slope[1][1] = -127;
    boxes->lid[1] = -8192;
}

TEST(what_a_lifted_box_says) {
    struct incode_boxes boxes;
    struct incode_lifted l;
    one_lifted(&boxes);
    assert_false(incode_boxes_lifted(&boxes, 0, &l));
    assert_true(incode_boxes_lifted(&boxes, 1, &l));
    const double o[3] = {0.5, -0.3125, 0.125}, half[3] = {1, 0.25, 0x1p-15};
    for (int k = 0; k < 3; k++) {
        assert_true(l.o[k] == o[k]);
        for (int d = 0; d < 3; d++)
            assert_true(l.a[k][d] == (d == k) * half[k] / 4);
    }
    assert_true(l.slope[0] == 0x1p-4 && l.slope[1] == -127 * 0x1p-9);
    assert_true(l.slope[2] == 0 && l.lid == -0x1p-4);
    assert_true(l.radius >= 0.25 * sqrt(1.0625));
    assert_true(l.radius <= 0.25 * sqrt(1.0625) * (1 + 0x1p-19));
    /* A third of a turn about (1, 1, 1): x to y to z. */
    for (int d = 0; d < 3; d++)
        boxes.turn[d][1] = 16383;
    double axis[3][3];
    incode_boxes_turned(&boxes, 1, axis);
    for (int k = 0; k < 3; k++)
        for (int d = 0; d < 3; d++)
            assert_true(fabs(axis[k][d] - (d == (k + 1) % 3)) < 1e-3);
}

TEST(axes_are_orthonormal) {
    struct incode_boxes boxes;
    double axis[3][3];
    one_lifted(&boxes);
    for (int i = 0; i < 3000; i++) {
        double q[4], square = 0;
        for (int d = 0; d < 4; d++) {
            q[d] = draw() - 0.5;
            square += q[d] * q[d];
        }
        for (int d = 0; d < 3; d++) {
            double turn = 32767 * q[d] / sqrt(square);
            boxes.turn[d][1] = (int16_t)turn; /* not away from 0 */
        }
        incode_boxes_turned(&boxes, 1, axis);
        for (int a = 0; a < 3; a++) {
            for (int b = 0; b < 3; b++) {
                double dot = 0;
                for (int d = 0; d < 3; d++)
                    dot += axis[a][d] * axis[b][d];
                assert_true(fabs(dot - (a == b)) < 0x1p-49);
            }
        }
        double det =
            axis[0][0] * (axis[1][1] * axis[2][2] - axis[1][2] * axis[2][1]) +
            axis[0][1] * (axis[1][2] * axis[2][0] - axis[1][0] * axis[2][2]) +
            axis[0][2] * (axis[1][0] * axis[2][1] - axis[1][1] * axis[2][0]);
        assert_true(det > 0.999);
    }
}

/* ---- on arrival ---- */

TEST(what_is_not_sound) {
    struct set set = {.count = 2, .all_lo = {-4, -4, -4}, .all_hi = {4, 4, 4}};
    struct incode_boxes good, bad;
    one_lifted(&good);
    assert_true(is_sound(&good, &set));
#define REFUSED(change)                                                        \
    do {                                                                       \
        bad = good;                                                            \
        change;                                                                \
        assert_false(is_sound(&bad, &set));                                    \
    } while (0)
    REFUSED(bad.unit = NAN);
    REFUSED(bad.unit = 7);
    REFUSED(bad.unit = 0);
    REFUSED(bad.unit = -8);
    REFUSED(bad.unit = 0x1p-1030);
    REFUSED(bad.unit = INFINITY);
    REFUSED(bad.unit = 16);
    REFUSED(bad.origin[1] = INFINITY);
    REFUSED(bad.origin[2] = NAN);
    REFUSED(bad.origin[0] = 1);
    REFUSED(bad.lo[0][0] = -0.75F);
    REFUSED(bad.hi[0][0] = 0.75F);
    REFUSED(bad.lo[1][1] = 0.25F);
    REFUSED(bad.hi[1][1] = NAN);
    REFUSED(bad.lo[2][2] = 0);
    REFUSED(bad.hi[2][31] = 1);
    REFUSED(bad.half[1][1] = 0x7c00);
    REFUSED(bad.half[2][1] = 0xbc00);
    REFUSED(bad.turn[0][1] = bad.turn[1][1] = 25000);
    REFUSED(bad.is_lifted[0] = 2);
    REFUSED(bad.is_lifted[2] = 1);
#undef REFUSED
}
