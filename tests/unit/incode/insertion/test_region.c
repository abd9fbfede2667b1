/* The error bounds of regions: no point of a sphere, or beyond a plane, is ever
 * told apart from it, as exact arithmetic has it, where the point is as near
 * the boundary as doubles allow; lattices with decimal steps, whose spheres
 * have points in the boundary everywhere, come out right by points with little
 * memory; and each bound that is left out is found by one or the other. */
#include <math.h>

#include <gmp.h>

/* The bounds, and which one is left out. */
enum bound {
    NOTHING,
    BALL_ERROR,
    BALL_UNDERFLOW,
    BALL_ROUNDING,
    WHOLE,
    SHARP_SPHERE,
    SHARP_DETERMINANT,
    BEHIND_UNDERFLOW,
    BEHIND_ERROR,
    BEHIND_ROUNDING,
    BEFORE_UNDERFLOW,
    BEFORE_ERROR,
    BEFORE_ROUNDING,
    POINTS_UNDERFLOW,
    POINTS_ERROR,
    POINTS_ROUNDING,
    LIFTED_UNDERFLOW,
    LIFTED_ERROR,
    LIFTED_ROUNDING,
    LIFTED_REST,
    BOUNDS
};
static enum bound planted;

/* Of the kept spheres a part stays: 0.25 of 0.625. */
#define INCODE_PLANT_BOUND(name, value)                                        \
    ((value) * (planted != (name) ? 1 : (name) == WHOLE ? 0.4 : 0))
#include "incode/insertion/region.c" /* NOLINT(bugprone-suspicious-include) */

#include "tests/unit/emulated.h"
#include "tests/unit/incode/solo.h"

static const char *const names[BOUNDS] = {"none",
                                          "ball/error",
                                          "ball/underflow",
                                          "ball/rounding",
                                          "whole",
                                          "sharp/sphere",
                                          "sharp/det",
                                          "behind/underflow",
                                          "behind/error",
                                          "behind/rounding",
                                          "before/underflow",
                                          "before/error",
                                          "before/rounding",
                                          "points/underflow",
                                          "points/error",
                                          "points/rounding",
                                          "lifted/underflow",
                                          "lifted/error",
                                          "lifted/rounding",
                                          "lifted/rest"};
static uint64_t wrong[BOUNDS];

static uint64_t state = 1;

static double draw(void) {
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

static double even(void) {
    return 2 * draw() - 1;
}

/* ---- a point's box ---- */

/* A lifted box with a point in a corner and, of the rest that it need not hold,
 * a part; or that is next to nothing, and whose centre no double is. */
struct corner {
    struct incode_boxes boxes;
    struct incode_lifted lifted;
};

static void set_radius(struct incode_lifted *l, const double q[3]) {
    double square = 0;
    for (int d = 0; d < 3; d++)
        square += l->a[0][d] * l->a[0][d] + l->a[1][d] * l->a[1][d] +
                  l->a[2][d] * l->a[2][d];
    l->radius = sqrt(square) * (1 + 0x1p-20);
    l->lid = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]) * (1 - 0x1p-40);
}

/* Its centre is off by a part of the last digit, which its one half axis makes
 * up for. */
static void set_place(struct corner *c, const double p[3]) {
    double q[3];
    memset(c, 0, sizeof *c);
    c->boxes.unit = 1;
    for (int d = 0; d < 3; d++) {
        double last = nextafter(fabs(p[d]), INFINITY) - fabs(p[d]);
        double off = p[d] * (1 + 0x1p-20 * even());
        /* The difference is exact, and so is its sum with a part of `last`. */
        c->boxes.origin[d] = off;
        c->lifted.o[d] = (p[d] - off) + last * floor(0x1p10 * even()) * 0x1p-10;
        q[d] = (p[d] - off) - c->lifted.o[d];
        c->lifted.a[0][d] = q[d];
    }
    set_radius(&c->lifted, q);
}

/* The point is in the corner where F is least, less a part of the radius that
 * boxes need not hold.  down: against the gradient of F there. */
static void set_corner(struct corner *c, const double p[3],
                       const double down[3], double size) {
    double q[3], norm = 0, radius = 0;
    memset(c, 0, sizeof *c);
    c->boxes.unit = 1;
    for (int d = 0; d < 3; d++)
        norm += down[d] * down[d];
    norm = sqrt(norm);
    for (int k = 0; k < 3; k++) {
        double along = 0;
        for (int d = 0; d < 3; d++) {
            c->lifted.a[k][d] = size * even();
            along += c->lifted.a[k][d] * down[d];
        }
        for (int d = 0; d < 3; d++) {
            c->lifted.a[k][d] *= along < 0 ? -1 : 1;
            radius += c->lifted.a[k][d] * c->lifted.a[k][d];
        }
    }
    radius = sqrt(radius);
    for (int d = 0; d < 3; d++) {
        double rest = norm > 0 ? 0x1.ep-21 * radius * down[d] / norm : 0;
        c->lifted.o[d] = p[d] - (c->lifted.a[0][d] + c->lifted.a[1][d] +
                                 c->lifted.a[2][d] + rest);
        q[d] = p[d] - c->lifted.o[d];
    }
    set_radius(&c->lifted, q);
}

/* ---- regions against boxes of points ---- */

static struct incode_regions regions;

/* A brick's every point is that one. */
static bool holds_in_brick(const double p[3]) {
    alignas(64) struct incode_brick brick;
    for (unsigned i = 0; i < INCODE_BRICK_POINTS; i++) {
        brick.x[i] = p[0];
        brick.y[i] = p[1];
        brick.z[i] = p[2];
    }
    return incode_regions_points(&regions, 5, &brick) == ~UINT64_C(0);
}

static void count_wrong(const struct incode_region *r, const double p[3],
                        const struct corner *corners, int count) {
    bool met = true;
    incode_regions_set(&regions, 5, r);
    met = incode_regions_meeting(&regions, 1 << 5, p, p) == 1 << 5;
    met = met && (!r->infinite || incode_region_is_behind(r, p, p));
    met = met && holds_in_brick(p);
    for (int i = 0; i < count; i++)
        met = met &&
              incode_regions_meeting_lifted(&regions, 1 << 5, &corners[i].boxes,
                                            &corners[i].lifted) == 1 << 5;
    wrong[planted] += !met;
}

/* ---- X is exact ---- */

static mpq_t term, sum, other;

/* Whether F(p) <= 0, or X (p - o) >= 0 of a half-space. */
static bool holds(const struct incode_region *r, const double p[3]) {
    mpq_set_ui(sum, 0, 1);
    for (int d = 0; d < 3; d++) {
        mpq_set_d(term, p[d]);
        mpq_set_d(other, r->o[d]);
        mpq_sub(term, term, other);
        mpq_set_d(other, -r->x[d]);
        if (!r->infinite)
            mpq_add(other, other, term);
        mpq_mul(term, term, other);
        mpq_add(sum, sum, term);
    }
    return mpq_sgn(sum) <= 0;
}

typedef bool holding(const void *of, const double p[3]);

static bool region_holds(const void *of, const double p[3]) {
    return holds(of, p);
}

/* From a point that is held towards one that is not: the last one held. */
static void approach(holding *hold, const void *of, double in[3],
                     const double out[3]) {
    double a = 0, b = 1, from[3];
    memcpy(from, in, sizeof from);
    while (a < (a + b) / 2 && (a + b) / 2 < b) {
        double t = (a + b) / 2, p[3];
        for (int d = 0; d < 3; d++)
            p[d] = from[d] + t * (out[d] - from[d]);
        bool held = hold(of, p);
        a = held ? t : a;
        b = held ? b : t;
        if (held)
            memcpy(in, p, sizeof p);
    }
}

static void gradient(const struct incode_region *r, const double p[3],
                     double down[3]) {
    for (int d = 0; d < 3; d++)
        down[d] = r->x[d] - (r->infinite ? 0 : 2 * (p[d] - r->o[d]));
}

static void try_exact(double far, double scale, bool infinite) {
    struct incode_region r = {.infinite = infinite};
    struct corner corners[3];
    double p[3], out[3], down[3];
    for (int d = 0; d < 3; d++) {
        r.o[d] = far * even() * scale;
        r.x[d] = even() * scale;
        p[d] = r.o[d] + (infinite ? even() * scale + r.x[d] : 0.5 * r.x[d]);
    }
    for (int d = 0; d < 3; d++)
        out[d] = infinite ? r.o[d] + (even() * scale - r.x[d])
                          : p[d] + 4 * even() * scale;
    if (!holds(&r, p) || holds(&r, out))
        return;
    approach(region_holds, &r, p, out);
    gradient(&r, p, down);
    memset(corners, 0, sizeof corners);
    corners[0].boxes.unit = 1;
    memcpy(corners[0].lifted.o, p, sizeof p);
    set_place(&corners[1], p);
    set_corner(&corners[2], p, down, scale * 0x1p-4 * draw());
    for (planted = NOTHING; planted < BOUNDS; planted++) {
        set_ball(&r);
        /* Of denormals no box says so much. */
        count_wrong(&r, p, corners, scale < 0x1p-200 ? 1 : 3);
    }
}

/* ---- X is of a cell ---- */

struct cell {
    struct incode_complex x;
    struct incode_tally tally;
    const struct incode_cell *c;
    alignas(64) uint8_t memory[4096];
};

static bool cell_holds(const void *of, const double p[3]) {
    const struct cell *s = of;
    struct incode_tally tally = {0};
    const double *q[4];
    unsigned k = incode_cell_index(s->c, INCODE_COMPLEX_INFINITE);
    for (unsigned i = 0; i < 4; i++)
        q[i] = i == k ? p : s->x.point[s->c->v[i]].p;
    return k < 4 ? incode_orient3d(&tally, q[0], q[1], q[2], q[3]) >= 0
                 : incode_in_sphere(&tally, q[0], q[1], q[2], q[3], p) > 0;
}

/* How the points of a cell lie. */
enum shape { REGULAR, CAP, THIN, ALIGNED, SHAPES };

static void draw_cell(double p[4][3], enum shape shape, double far) {
    for (int i = 0; i < 4; i++)
        for (int d = 0; d < 3; d++)
            p[i][d] = far + even();
    double height = ldexp(1, -(int)(11 * draw()));
    for (int i = 0; i < 4; i++) {
        if (shape == CAP) /* nearly in a plane */
            p[i][2] = far + 0.3 * p[i][0] + height * even();
        if (shape == THIN) /* nearly in a line, but for one */
            for (int d = 1; d < 3 && i > 0; d++)
                p[i][d] = p[i][0] * 0.7 + height * even();
        if (shape == ALIGNED) { /* nearly opposite, as seen from one */
            double y = height * even(), z = height * even();
            double x = sqrt(fmax(0, 0.25 - y * y - z * z));
            p[i][0] = far + (i % 2 == 0 ? 0.5 - x : 0.5 + x);
            p[i][1] = far + y, p[i][2] = far + z;
        }
    }
}

/* A point just in the cell's sphere, or just beyond its facet. */
static bool draw_point(const struct cell *s, const struct incode_region *r,
                       enum shape shape, double p[3]) {
    double out[3], size = 0;
    for (int d = 0; d < 3; d++)
        size = fmax(size, fabs(r->x[d]));
    for (int d = 0; d < 3; d++) {
        p[d] = r->infinite ? r->o[d] + 8 * even() : r->o[d] + r->x[d] / 2;
        out[d] = p[d] + 4 * even() * (r->infinite ? 2 : size);
    }
    if (shape == ALIGNED && !r->infinite) { /* where X is nearly 0 */
        p[0] = out[0] = r->o[0];
        double height = fmax(fabs(r->x[1]), fabs(r->x[2]));
        out[1] = p[1] + 4 * even() * height;
        out[2] = p[2] + 4 * even() * height;
    }
    if (!cell_holds(s, p) || cell_holds(s, out))
        return false;
    approach(cell_holds, s, p, out);
    return true;
}

static void try_sharp(struct cell *s, enum shape shape) {
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < s->x.cells; i++) {
        struct incode_region kept, sharp;
        struct corner corner = {.boxes = {.unit = 1}};
        double p[3];
        s->c = incode_complex_cell(&s->x, i);
        planted = NOTHING;
        bool known[2] = {incode_region_set(&kept, &s->x, s->c),
                         incode_region_set_sharp(&sharp, &s->x, s->c, 0.5)};
        if (!known[1] || !draw_point(s, &sharp, shape, p))
            continue;
        memcpy(corner.lifted.o, p, sizeof p);
        for (planted = NOTHING; planted < BOUNDS; planted++) {
            (void)incode_region_set_sharp(&sharp, &s->x, s->c, 0.5);
            count_wrong(&sharp, p, &corner, 1);
            (void)incode_region_set(&kept, &s->x, s->c);
            if (known[0])
                count_wrong(&kept, p, &corner, 1);
        }
    }
}

static void try_cell(struct cell *s, enum shape shape, double far) {
    double p[4][3];
    uint32_t four[4];
    draw_cell(p, shape, far);
    incode_complex_init(&s->x, s->memory, sizeof s->memory);
    for (uint32_t i = 0; i < 4; i++)
        four[i] = incode_complex_add(&s->x, p[i], i);
    if (incode_complex_begin(&s->x, &s->tally, four))
        try_sharp(s, shape);
}

TEST(points_in_the_boundary) {
    static struct cell cell;
    int rounds = emulated() ? 20 : SANITIZED ? 300 : 1500;
    mpq_inits(term, sum, other, NULL);
    for (int i = 0; i < rounds; i++) {
        try_exact(i % 3 == 0 ? 0x1p20 : i % 3, 1, i % 2 != 0);
        try_exact(0, i % 4 < 2 ? 0x1p-520 : 0x1p-537, i % 2 != 0);
        for (int shape = 0; shape < SHAPES; shape++)
            try_cell(&cell, (enum shape)shape, i % 2 == 0 ? 0 : 0x1p10);
    }
    mpq_clears(term, sum, other, NULL);
}

/* ---- lattices ---- */

enum { SIDE = 28, POINTS = SIDE * SIDE * SIDE };

static double xyz[POINTS][3];

/* Steps of 0.1, tenths, and three fractions. */
static const struct {
    double times;
    int parts[3];
} lattices[] = {{0.1, {1, 1, 1}}, {1, {10, 10, 10}}, {1, {3, 7, 11}}};
enum { LATTICES = sizeof lattices / sizeof *lattices };

static void make_lattice(int l) {
    for (int i = 0; i < POINTS; i++) {
        const int at[3] = {i / SIDE / SIDE, i / SIDE % SIDE, i % SIDE};
        for (int d = 0; d < 3; d++)
            xyz[i][d] = at[d] * lattices[l].times / lattices[l].parts[d];
    }
}

static void run(uint8_t build, size_t memory, struct host_digest *digest,
                uint64_t *count) {
    struct solo solo = {
        .index = INCODE_KD, .build = build, .regions = 1, .memory = memory};
    solo_run(&solo, xyz[0], POINTS);
    assert_true(build == INCODE_BUILD_FACES || solo.by_points > 0);
    *digest = solo.digest;
    *count = solo.tets.count;
    solo_close(&solo);
}

/* With how many of two sizes of memory the digest is wrong by points. */
static unsigned wrong_by_points(enum bound without,
                                const struct host_digest *right) {
    struct host_digest digest;
    uint64_t count;
    unsigned found = 0;
    planted = without;
    for (size_t kb = 640; kb <= 1024; kb += 384) {
        run(INCODE_BUILD_POINTS, kb << 10, &digest, &count);
        found += strcmp(digest.text, right->text) != 0;
    }
    planted = NOTHING;
    print_message("without %s: wrong with %u sizes\n", names[without], found);
    return found;
}

/* 0.25 for 0.625 of a kept sphere changes none of these results; the test of
 * points in the boundary finds it. */
TEST(decimal_lattices) {
    unsigned found = 0;
    for (int l = 0; l < LATTICES; l++) {
        struct host_digest right;
        uint64_t count;
        make_lattice(l);
        run(INCODE_BUILD_FACES, 4 << 20, &right, &count);
        assert_int_equal(count, 118098);
        assert_int_equal(wrong_by_points(NOTHING, &right), 0);
        found += wrong_by_points(BALL_ERROR, &right);
    }
    assert_true(found > 0);
}

TEST(each_bound_is_needed) {
    for (int b = NOTHING; b < BOUNDS; b++)
        print_message("without %s: %llu wrong\n", names[b],
                      (unsigned long long)wrong[b]);
    assert_int_equal(wrong[NOTHING], 0);
    for (int b = NOTHING + 1; b < BOUNDS && !emulated(); b++)
        assert_true(wrong[b] > 0);
}
