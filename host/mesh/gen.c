#include "gen.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Counters of 64 bits through a mixer (Steele, Lea and Flood, OOPSLA 2014). */
struct random {
    uint64_t state;
};

static uint64_t next(struct random *r) {
    uint64_t z = r->state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

/* In [0, 1), a multiple of 2^-53. */
static double draw(struct random *r) {
    return (double)(next(r) >> 11) * 0x1p-53;
}

struct maker {
    uint64_t n, seed;
    struct random random;
    struct host_points *points;
    struct host_error *error;
};

typedef void make(struct maker *m);

static bool put(struct maker *m, double x, double y, double z) {
    double xyz[3] = {x, y, z};
    return host_points_append(m->points, xyz, 1, m->error) == 0 &&
           m->points->count < m->n;
}

static void uniform(struct maker *m) {
    double x, y, z;
    do {
        x = draw(&m->random);
        y = draw(&m->random);
        z = draw(&m->random);
    } while (put(m, x, y, z));
}

/* Uniform on the unit sphere: a point of the ball, drawn out to it. */
static void direction(struct random *r, double v[3]) {
    double square;
    do {
        square = 0;
        for (int d = 0; d < 3; d++) {
            v[d] = 2 * draw(r) - 1;
            square += v[d] * v[d];
        }
    } while (square > 1 || square < 0x1p-20);
    double length = sqrt(square);
    for (int d = 0; d < 3; d++)
        v[d] /= length;
}

static void sphere(struct maker *m) {
    double v[3];
    do {
        direction(&m->random, v);
    } while (put(m, v[0], v[1], v[2]));
}

static void hub(struct maker *m) {
    if (put(m, 0, 0, 0))
        sphere(m);
}

/* Twelve bubbles in the unit cube, nine points of ten in their thin shells, the
 * tenth anywhere. */
static void bubbles(struct maker *m) {
    enum { BUBBLES = 12 };
    double centre[BUBBLES][3], radius[BUBBLES], v[3];
    for (int b = 0; b < BUBBLES; b++) {
        radius[b] = 0.02 + 0.1 * draw(&m->random);
        for (int d = 0; d < 3; d++)
            centre[b][d] = radius[b] + (1 - 2 * radius[b]) * draw(&m->random);
    }
    bool more = true;
    while (more) {
        if (draw(&m->random) < 0.1) {
            v[0] = draw(&m->random);
            v[1] = draw(&m->random);
            v[2] = draw(&m->random);
        } else {
            uint64_t b = next(&m->random) % BUBBLES;
            direction(&m->random, v);
            double r = radius[b] * (0.98 + 0.02 * draw(&m->random));
            for (int d = 0; d < 3; d++)
                v[d] = centre[b][d] + r * v[d];
        }
        more = put(m, v[0], v[1], v[2]);
    }
}

/* The smallest side with side^3 * ratio >= n. */
static uint64_t side_for(uint64_t n, uint64_t times, uint64_t by) {
    uint64_t side = 2;
    while (side * side * (side * times / by) < n)
        side++;
    return side;
}

static void lattice(uint64_t i, uint64_t side, double c[3]) {
    uint64_t row = i / side, layer = row / side;
    c[0] = (double)(i % side);
    c[1] = (double)(row % side);
    c[2] = (double)layer;
}

static void grid(struct maker *m) {
    uint64_t side = side_for(m->n, 1, 1), i = 0;
    double c[3];
    do {
        lattice(i++, side, c);
    } while (put(m, c[0], c[1], c[2]));
}

/* The same out of its axes, by the rotation of the quaternion (4, 1, 2, 3):
 * integers over 30, so each coordinate is rounded once. */
static void rotated(struct maker *m) {
    static const double rotation[3][3] = {
        {4, -20, 22}, {28, 10, 4}, {-10, 20, 20}};
    uint64_t side = side_for(m->n, 1, 1), i = 0;
    double p[3], c[3];
    do {
        lattice(i++, side, c);
        for (int d = 0; d < 3; d++) {
            const double *row = rotation[d];
            p[d] = (row[0] * c[0] + row[1] * c[1] + row[2] * c[2]) / 30;
        }
    } while (put(m, p[0], p[1], p[2]));
}

/* Cells that grow outward from the wall, u in [0, 1]. */
static double stretched(double u) {
    return u * (0.01 + 0.99 * u * u);
}

/* To single precision and back.  gcc 12 leaves both away where it is told to
 * tune for Intel's processors and joins several of them in a vector. */
static double single(double a) {
    volatile float f = (float)a;
    return (double)f;
}

/* A curvilinear grid of 40 : 32 : 32 around a fin with a round nose, planes
 * upon planes, single precision as in the original. */
static void bluntfin(struct maker *m) {
    uint64_t nj = side_for(m->n, 5, 4), ni = nj * 5 / 4, k = 0;
    bool more = true;
    for (; more; k++) {
        double z = 6 * stretched((double)k / (double)(nj - 1));
        for (uint64_t ij = 0; ij < ni * nj && more; ij++) {
            double along = (double)(ij % ni) / (double)(ni - 1);
            uint64_t row = ij / ni;
            double out = (double)row / (double)(nj - 1);
            double r = 0.5 + 8 * stretched(out), x, y;
            if (along < 0.5) { /* a quarter circle about the nose */
                double t = 2 * along;
                x = 0.5 - r * (1 - t * t) / (1 + t * t);
                y = r * (2 * t) / (1 + t * t);
            } else {
                x = 0.5 + 13 * stretched(2 * along - 1);
                y = r;
            }
            more = put(m, single(x), single(y), single(z));
        }
    }
}

/* Uniform on the unit circle. */
static void turn(struct random *r, double v[2]) {
    double square;
    do {
        v[0] = 2 * draw(r) - 1;
        v[1] = 2 * draw(r) - 1;
        square = v[0] * v[0] + v[1] * v[1];
    } while (square > 1 || square < 0x1p-20);
    double length = sqrt(square);
    v[0] /= length;
    v[1] /= length;
}

/* The side of radius 1 and height 4, without its ends. */
static void cylinder(struct maker *m) {
    double v[2], z;
    do {
        turn(&m->random, v);
        z = 4 * draw(&m->random);
    } while (put(m, v[0], v[1], z));
}

/* Of radii 1 and 1/4, uniform in both angles. */
static void torus(struct maker *m) {
    double about[2], across[2], r;
    do {
        turn(&m->random, about);
        turn(&m->random, across);
        r = 1 + 0.25 * across[0];
    } while (put(m, r * about[0], r * about[1], 0.25 * across[1]));
}

static void shell(struct maker *m) {
    double v[3], r;
    do {
        direction(&m->random, v);
        r = 1 - 0.001 * draw(&m->random);
    } while (put(m, r * v[0], r * v[1], r * v[2]));
}

/* At (i, j) of a lattice that the seed and the octave make, in [0, 1). */
static double knot(const struct maker *m, uint64_t octave, uint64_t i,
                   uint64_t j) {
    struct random r = {m->seed ^ octave << 60 ^ i << 30 ^ j};
    (void)next(&r);
    return draw(&r);
}

/* Between the four knots about (x, y), smooth across each cell. */
static double hill(const struct maker *m, uint64_t octave, double x, double y) {
    uint64_t i = (uint64_t)x, j = (uint64_t)y;
    double u = x - (double)i, v = y - (double)j;
    u *= u * (3 - 2 * u);
    v *= v * (3 - 2 * v);
    double low =
        (1 - u) * knot(m, octave, i, j) + u * knot(m, octave, i + 1, j);
    double high =
        (1 - u) * knot(m, octave, i, j + 1) + u * knot(m, octave, i + 1, j + 1);
    return (1 - v) * low + v * high;
}

/* A square grid, a step of 10, of heights in whole units up to 1,000. */
static void terrain(struct maker *m) {
    uint64_t side = 2, i = 0;
    double x, y, height;
    while (side * side < m->n)
        side++;
    do {
        const uint64_t column = i % side, row = i / side;
        x = (double)column;
        y = (double)row;
        height = 0;
        for (uint64_t octave = 0; octave < 6; octave++) {
            double step = (double)(128 >> octave);
            height += 4 * step * hill(m, octave, x / step, y / step);
        }
        i++;
    } while (put(m, 10 * x, 10 * y, floor(height)));
}

/* Of either sign, from 2^-1000 to 2^1000, each power as likely. */
static double scaled(struct random *r) {
    int power = (int)(next(r) % 2000) - 1000;
    double value = ldexp(1 + draw(r), power);
    return draw(r) < 0.5 ? -value : value;
}

static void scales(struct maker *m) {
    double x, y, z;
    do {
        x = scaled(&m->random);
        y = scaled(&m->random);
        z = scaled(&m->random);
    } while (put(m, x, y, z));
}

/* Half of the points on each of two lines that do not meet. */
static void lines(struct maker *m) {
    double t;
    bool more = true;
    for (uint64_t i = 0; more; i++) {
        t = draw(&m->random);
        more = i % 2 == 0 ? put(m, t, 0, 0) : put(m, 0.5, t - 0.5, 1);
    }
}

static const struct {
    const char *name;
    make *function;
} kinds[] = {
    {"uniform", uniform}, {"bubbles", bubbles}, {"bluntfin", bluntfin},
    {"sphere", sphere},   {"grid", grid},       {"rotated", rotated},
    {"hub", hub},         {"shell", shell},     {"cylinder", cylinder},
    {"torus", torus},     {"terrain", terrain}, {"scales", scales},
    {"lines", lines},
};

const char host_gen_kinds[] =
    "uniform, bubbles, bluntfin, sphere, grid, rotated, hub, shell, cylinder, "
    "torus, terrain, scales, lines";

int host_gen(const char *kind, uint64_t n, uint64_t seed,
             struct host_points *points, struct host_error *error) {
    *points = (struct host_points){0};
    if (n < HOST_GEN_MIN || n > host_gen_max) {
        return host_fail(error, HOST_USAGE,
                         "gen: %llu points: too few or too many; ask for %d to "
                         "%llu",
                         (unsigned long long)n, HOST_GEN_MIN,
                         (unsigned long long)host_gen_max);
    }
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        if (strcmp(kind, kinds[i].name) == 0) {
            struct maker m = {n, seed, {seed}, points, error};
            (void)next(&m.random);
            kinds[i].function(&m);
            if (error->code != 0)
                host_points_free(points);
            return error->code;
        }
    }
    return host_fail(error, HOST_USAGE,
                     "gen %s: no kind of point set; use one of %s", kind,
                     host_gen_kinds);
}
