/* Lifted boxes: no point is outside of one, whatever the points, and no
 * function of a sphere has less at a point than its bound; and the bounds are
 * close where the points are flat. */
#include <math.h>

#include "host/mesh/lift.h"
#include "host/mesh/order.h"
#include "tests/unit/emulated.h"
#include "tests/unit/test.h"

static uint64_t state = 1;

static double draw(void) {
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

static double even(void) {
    return 2 * draw() - 1;
}

/* ---- point sets ---- */

/* A direction that is no axis. */
static const double tilt[3][3] = {
    {0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};

static void tilted(double p[3], double a, double b, double c) {
    for (int d = 0; d < 3; d++)
        p[d] = a * tilt[0][d] + b * tilt[1][d] + c * tilt[2][d];
}

static void volume(double p[3]) {
    tilted(p, even(), even(), even());
}

static void plane(double p[3]) {
    tilted(p, even(), even(), 0.3);
}

static void line(double p[3]) {
    tilted(p, even(), 0.1, 0.3);
}

static void sphere(double p[3]) {
    double z = even(), angle = 6.283185307179586 * draw(), r = sqrt(1 - z * z);
    tilted(p, r * cos(angle), r * sin(angle), z);
}

static void cylinder(double p[3]) {
    double angle = 6.283185307179586 * draw();
    tilted(p, 0.2 * cos(angle), 0.2 * sin(angle), even());
}

static void terrain(double p[3]) {
    p[0] = even(), p[1] = even();
    p[2] = 0.1 * sin(3 * p[0]) * cos(4 * p[1]) + 0.001 * draw();
}

static void clusters(double p[3]) {
    tilted(p, rint(2 * even()), rint(2 * even()), 0);
    for (int d = 0; d < 3; d++)
        p[d] += ldexp(even(), -8 * (1 + (int)(draw() * 5)));
}

static void trajectory(double p[3]) {
    double t = even();
    p[0] = t * 1e6, p[1] = sin(5 * t) + 1e-3 * draw(), p[2] = 1e-6 * t * t;
}

static void far_plane(double p[3]) {
    plane(p);
    for (int d = 0; d < 3; d++)
        p[d] += 1e9 * (d + 1);
}

static void large(double p[3]) {
    sphere(p);
    for (int d = 0; d < 3; d++)
        p[d] *= 0x1p1023;
}

static void small(double p[3]) {
    plane(p);
    for (int d = 0; d < 3; d++)
        p[d] *= 1e-306;
}

static void denormal(double p[3]) {
    sphere(p);
    for (int d = 0; d < 3; d++)
        p[d] *= 1e-312;
}

static void all_scales(double p[3]) {
    for (int d = 0; d < 3; d++)
        p[d] = ldexp(even(), (int)(draw() * 2000) - 1000);
}

typedef void making(double p[3]);

/* Two points make a plane or a line span the space. */
static void order(struct host_order *order, making *make, size_t n) {
    struct host_error error = {0};
    double *xyz = malloc(3 * n * sizeof *xyz);
    assert_non_null(xyz);
    for (size_t i = 0; i < n; i++)
        make(xyz + 3 * i);
    for (int i = 0; i < 6; i++) {
        double bend = 0x1p-2 * (i % 3 + 1.) * (i < 3 ? 1 : -1.);
        xyz[i] += xyz[i] * bend;
    }
    assert_int_equal(
        host_order_make(order, "test", xyz, n, HOST_ADAPTIVE, 1, false, &error),
        0);
    free(xyz);
}

/* ---- what must hold ---- */

static long double dot(const long double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The first of a child's points, and how many. */
static uint32_t below(const struct host_order *o, uint32_t level,
                      uint32_t child, uint32_t *last) {
    uint64_t width = UINT64_C(1) << (5 * (level - 1));
    uint64_t end = (child + 1) * width;
    end = end < o->bricks ? end : o->bricks;
    *last = (uint32_t)(end * INCODE_BRICK_POINTS);
    return (uint32_t)(child * width * INCODE_BRICK_POINTS);
}

/* A vertex relative to the box's centre, in the page's units; long doubles have
 * 2^-11 of what double precision loses. */
static void relative(const struct host_order *o,
                     const struct incode_boxes *boxes,
                     const struct incode_lifted *l, uint32_t v,
                     long double t[3]) {
    double p[3];
    host_vertex(o, v, p);
    for (int d = 0; d < 3; d++)
        t[d] = ((long double)p[d] - boxes->origin[d]) / boxes->unit - l->o[d];
}

/* The bound of the header, for D = 1 and a gradient at the centre. */
static double bound_of(const struct incode_lifted *l, const double g[3]) {
    double least = l->lid, length = 0;
    for (int k = 0; k < 3; k++) {
        double s = l->slope[k];
        for (int d = 0; d < 3; d++)
            s += g[d] * l->a[k][d];
        least -= fabs(s);
        length += g[k] * g[k];
    }
    return least - sqrt(length) * l->radius * 0x1p-20;
}

enum { FUNCTIONS = 8 };

/* Functions |p - o|^2 + g . (p - o): at random, and of spheres that touch the
 * points near the centre. */
static void gradients(const struct incode_lifted *l, double g[FUNCTIONS][3]) {
    for (int i = 0; i < FUNCTIONS; i++) {
        double size = l->radius * pow(2, 12 * draw() - 4);
        const double *a = l->a[2];
        double length = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
        for (int d = 0; d < 3; d++)
            g[i][d] = size * (i % 2 == 0 ? even() : a[d] / length);
    }
}

static void check_child(const struct host_order *o, uint32_t level,
                        uint32_t child) {
    const struct incode_tree *tree = &o->tree;
    const struct incode_boxes *boxes =
        o->boxes + (tree->base[level] - tree->base[1]) + child / INCODE_FANOUT;
    struct incode_lifted l;
    if (!incode_boxes_lifted(boxes, child % INCODE_FANOUT, &l))
        return;
    double g[FUNCTIONS][3], bound[FUNCTIONS];
    gradients(&l, g);
    for (int i = 0; i < FUNCTIONS; i++)
        bound[i] = bound_of(&l, g[i]);
    uint32_t last, first = below(o, level, child, &last);
    for (uint32_t v = first; v < last; v++) {
        long double t[3], rest[3];
        relative(o, boxes, &l, v, t);
        memcpy(rest, t, sizeof rest);
        long double w = t[0] * t[0] + t[1] * t[1] + t[2] * t[2];
        long double lid = l.lid;
        for (int k = 0; k < 3; k++) {
            long double a[3] = {l.a[k][0], l.a[k][1], l.a[k][2]};
            long double s = dot(t, l.a[k]) / dot(a, l.a[k]);
            assert_true(fabsl(s) <= 1);
            lid += s * l.slope[k];
            for (int d = 0; d < 3; d++)
                rest[d] -= s * a[d];
        }
        for (int d = 0; d < 3; d++)
            assert_true(fabsl(rest[d]) <= l.radius * 0x1p-40);
        assert_true(w >= lid);
        assert_true(w <= (long double)l.radius * l.radius);
        for (int i = 0; i < FUNCTIONS; i++)
            assert_true(w + dot(t, g[i]) >= bound[i]);
    }
}

/* Returns the share of bricks that have a lifted box. */
static double check_all(making *make, size_t n) {
    struct host_order o;
    unsigned lifted = 0;
    order(&o, make, n);
    for (uint32_t level = 1; level < o.tree.levels; level++) {
        for (uint32_t c = 0; c < o.tree.count[level - 1]; c++) {
            check_child(&o, level, c);
            lifted += level == 1 &&
                      o.boxes[c / INCODE_FANOUT].is_lifted[c % INCODE_FANOUT];
        }
    }
    double share = (double)lifted / o.bricks;
    host_order_free(&o);
    return share;
}

TEST(no_point_is_outside) {
    static const struct {
        making *make;
        double least, most; /* share of lifted boxes of bricks */
    } sets[] = {{volume, 0, 0.02}, {plane, 0.9, 1},    {line, 0.9, 1},
                {sphere, 0.9, 1},  {cylinder, 0.9, 1}, {terrain, 0.5, 1},
                {clusters, 0, 1},  {trajectory, 0, 1}, {far_plane, 0.9, 1},
                {large, 0.9, 1},   {small, 0.9, 1},    {denormal, 0.9, 1},
                {all_scales, 0, 1}};
    for (size_t i = 0; i < sizeof sets / sizeof *sets; i++) {
        for (size_t n = 40; n < (emulated() ? 6000 : 200000); n *= 12) {
            double share = check_all(sets[i].make, n);
            assert_true(n < 1000 || share >= sets[i].least);
            assert_true(n < 1000 || share <= sets[i].most);
        }
    }
}

/* ---- what is excluded ---- */

/* Whether the ball about c is known to hold no point. */
static bool excluded(const struct incode_lifted *l, const double c[3],
                     double radius) {
    double g[3], f = -radius * radius;
    for (int d = 0; d < 3; d++) {
        g[d] = 2 * (l->o[d] - c[d]);
        f += (l->o[d] - c[d]) * (l->o[d] - c[d]);
    }
    return f + bound_of(l, g) > 0;
}

/* Balls beside the box, of 1 to 10,000 times its radius, with a gap of a part
 * in 30 of their sagitta over it and a part in 1,000 of its radius. */
static bool balls_beside(const struct incode_lifted *l,
                         const struct incode_boxes *boxes) {
    (void)boxes;
    double length[3], c[3];
    int thin = 0;
    for (int k = 0; k < 3; k++) {
        length[k] = sqrt(l->a[k][0] * l->a[k][0] + l->a[k][1] * l->a[k][1] +
                         l->a[k][2] * l->a[k][2]);
        thin = length[k] < length[thin] ? k : thin;
    }
    static const double times[] = {1, 10, 100, 1e3, 1e4};
    for (unsigned i = 0; i < sizeof times / sizeof times[0]; i++) {
        for (int side = -1; side <= 1; side += 2) {
            double radius = times[i] * l->radius;
            double gap = l->radius * (0x1p-10 + 0x1p-5 / times[i]);
            for (int d = 0; d < 3; d++)
                c[d] = l->o[d] +
                       side * (radius + gap) * l->a[thin][d] / length[thin];
            if (!excluded(l, c, radius))
                return false;
        }
    }
    return true;
}

/* A ball about the centre of the sphere that the points lie on, smaller by an
 * eighth of r^2. */
static bool ball_within(const struct incode_lifted *l,
                        const struct incode_boxes *boxes) {
    double c[3], r = l->radius * boxes->unit;
    for (int d = 0; d < 3; d++)
        c[d] = -boxes->origin[d] / boxes->unit;
    return excluded(l, c, (1 - r * r / 8) / boxes->unit);
}

/* The share of bricks of which all of these balls are excluded. */
static double excluding(making *make,
                        bool (*balls)(const struct incode_lifted *,
                                      const struct incode_boxes *)) {
    struct host_order o;
    unsigned count = 0;
    order(&o, make, 50000);
    for (uint32_t b = 0; b < o.bricks; b++) {
        const struct incode_boxes *boxes = &o.boxes[b / INCODE_FANOUT];
        struct incode_lifted l;
        count += incode_boxes_lifted(boxes, b % INCODE_FANOUT, &l) &&
                 balls(&l, boxes);
    }
    double share = (double)count / o.bricks;
    host_order_free(&o);
    return share;
}

TEST(flat_boxes_exclude) {
    assert_true(excluding(plane, balls_beside) > 0.99);
    assert_true(excluding(line, balls_beside) > 0.99);
    assert_true(excluding(sphere, ball_within) > 0.99);
}

/* A lump has the same shape whether it is of points or of lumps. */
TEST(lumps_join) {
    static _Alignas(64) struct incode_brick brick[INCODE_FANOUT];
    struct host_lump lump[INCODE_FANOUT], all, one;
    for (int b = 0; b < INCODE_FANOUT; b++) {
        for (int i = 0; i < INCODE_BRICK_POINTS; i++) {
            brick[b].x[i] = b + draw();
            brick[b].y[i] = b * b + draw() * 4;
            brick[b].z[i] = draw() * 9;
        }
        host_lump_brick(&lump[b], &brick[b]);
        assert_true(lump[b].count == INCODE_BRICK_POINTS);
    }
    host_lump_join(&all, lump, INCODE_FANOUT);
    memset(&one, 0, sizeof one);
    for (int b = 0; b < INCODE_FANOUT; b++) {
        for (int i = 0; i < INCODE_BRICK_POINTS; i++) {
            double p[3] = {brick[b].x[i], brick[b].y[i], brick[b].z[i]}, w = 0;
            for (int d = 0; d < 3; d++) {
                p[d] = (p[d] - all.origin[d]) / all.unit;
                w += p[d] * p[d];
            }
            for (int d = 0; d < 3; d++) {
                one.y[d] += p[d];
                one.yy[d] += p[d] * p[d];
                one.yy[3 + d] += p[(d + 1) % 3] * p[(d + 2) % 3];
                one.y_cube[d] += w * p[d];
            }
            one.y_square += w * w;
        }
    }
    assert_true(all.count == INCODE_FANOUT * INCODE_BRICK_POINTS);
    for (int d = 0; d < 3; d++) {
        assert_true(fabs(one.y[d] - all.y[d]) < 1e-9);
        assert_true(fabs(one.yy[d] - all.yy[d]) < 1e-9);
        assert_true(fabs(one.yy[3 + d] - all.yy[3 + d]) < 1e-9);
        assert_true(fabs(one.y_cube[d] - all.y_cube[d]) < 1e-9);
    }
    assert_true(fabs(one.y_square - all.y_square) < 1e-9);
}
