/* Points by fives that are hard on predicates: each family is one way in which
 * signs come close to zero, are zero, or leave the range of doubles. */
#ifndef TESTS_UNIT_HARD_POINTS_H
#define TESTS_UNIT_HARD_POINTS_H

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

enum hard_family {
    HARD_UNIFORM,    /* nothing special */
    HARD_SMALL_GRID, /* 0..3 */
    HARD_LARGE_GRID, /* corners of boxes of integers up to 2^40 */
    HARD_FLOATS,     /* corners of boxes of floats */
    HARD_PLANE,      /* rounded onto a plane, then moved by ulps */
    HARD_SPHERE,     /* rounded onto a sphere, then moved by ulps */
    HARD_TURNED,     /* a turned grid */
    HARD_SPREAD,     /* coordinates of very different size */
    HARD_WIDE_BOX,   /* corners of boxes of very different sides */
    HARD_EXPONENTS,  /* any exponents */
    HARD_ENDS,       /* 2^1000 mixed with 2^-1074 */
    HARD_LARGEST,    /* near +-DBL_MAX */
    HARD_DENORMAL,   /* multiples of 2^-1074 */
    HARD_UP,         /* the first seven where products begin to overflow */
    HARD_DOWN,       /* the first seven where products begin to underflow */
    HARD_PERMUTED,   /* one point of any exponents, its coordinates in another
                        order and with other signs, sometimes moved by an ulp:
                        mostly on a sphere */
    HARD_FAMILIES
};

static const char *const hard_names[HARD_FAMILIES] = {
    "uniform",  "small grid", "large grid", "floats",    "plane", "sphere",
    "turned",   "spread",     "wide box",   "exponents", "ends",  "largest",
    "denormal", "up",         "down",       "permuted"};

static uint64_t hard_bits(uint64_t *seed) {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    return *seed * 0x9e3779b97f4a7c15u >> 11; /* 53 of them */
}

static double hard_unit(uint64_t *seed) {
    return (double)hard_bits(seed) * 0x1p-53;
}

static int hard_below(uint64_t *seed, int n) {
    return (int)(hard_unit(seed) * n);
}

static double hard_sign(uint64_t *seed) {
    return hard_below(seed, 2) != 0 ? 1.0 : -1.0;
}

/* Half of the time, up to two units in the last place off. */
static double hard_shaken(uint64_t *seed, double x) {
    for (int n = hard_below(seed, 5) - 2; n > 0; n--)
        x = nextafter(x, hard_sign(seed) * INFINITY);
    return x;
}

/* Corners of the box from `lo` to `hi`; now and then a point off them. */
static void hard_box(uint64_t *seed, double p[5][3], const double lo[3],
                     const double hi[3]) {
    int corners = hard_below(seed, 8), step = 1 + 2 * hard_below(seed, 4);
    for (int i = 0; i < 5; i++, corners += step)
        for (int k = 0; k < 3; k++)
            p[i][k] = (corners >> k & 1) != 0 ? hi[k] : lo[k];
    if (hard_below(seed, 4) == 0) {
        int k = hard_below(seed, 3);
        p[4][k] = hard_shaken(seed, p[4][k]);
    }
}

static void hard_on_sphere(uint64_t *seed, double p[5][3]) {
    double center[3], radius = 0.25 + hard_unit(seed);
    for (int k = 0; k < 3; k++)
        center[k] = hard_below(seed, 2) != 0 ? 0 : hard_unit(seed);
    for (int i = 0; i < 5; i++) {
        double v[3], norm = 0;
        for (int k = 0; k < 3; k++) {
            v[k] = hard_unit(seed) - 0.5;
            norm += v[k] * v[k];
        }
        for (int k = 0; k < 3; k++)
            p[i][k] = hard_shaken(seed, center[k] + radius * v[k] / sqrt(norm));
    }
}

static void hard_turned(uint64_t *seed, double p[5][3]) {
    int at[3] = {hard_below(seed, 100) - 50, hard_below(seed, 100) - 50,
                 hard_below(seed, 100) - 50};
    for (int i = 0; i < 5; i++) {
        double v[3];
        for (int k = 0; k < 3; k++)
            v[k] = at[k] + hard_below(seed, 3);
        p[i][0] = 0.6 * v[0] - 0.8 * v[1];
        p[i][1] = 0.48 * v[0] + 0.36 * v[1] - 0.8 * v[2];
        p[i][2] = 0.64 * v[0] + 0.48 * v[1] + 0.6 * v[2];
    }
}

static double hard_coordinate(uint64_t *seed, enum hard_family family) {
    double sign = hard_sign(seed), unit = hard_unit(seed);
    switch (family) {
    case HARD_SMALL_GRID:
        return hard_below(seed, 4);
    case HARD_SPREAD:
        return sign * ldexp(unit, -hard_below(seed, 120));
    case HARD_EXPONENTS:
        return sign * ldexp(0.5 + unit / 2, hard_below(seed, 2098) - 1073);
    case HARD_ENDS:
        return hard_below(seed, 2) != 0
                   ? sign * ldexp(hard_below(seed, 3), 1000)
                   : sign * ldexp(hard_below(seed, 3), -1074);
    case HARD_LARGEST:
        return sign * (hard_below(seed, 2) != 0
                           ? hard_shaken(seed, DBL_MAX / 2)
                           : DBL_MAX * (1 - 0x1p-53 * hard_below(seed, 3)));
    case HARD_DENORMAL:
        return sign * ldexp(hard_below(seed, 1 << hard_below(seed, 20)), -1074);
    default:
        return unit;
    }
}

/* 2^500 or 2^-500, or where products of 5, 3 or 2 leave the range, or where
 * the filters' guards are. */
static double hard_edge(uint64_t *seed, int up) {
    static const int ups[5] = {500, 204, 340, 511, 338};
    static const int downs[5] = {-500, -214, -358, -537, -194};
    int at = hard_below(seed, 5);
    int off = at == 0 ? 0 : hard_below(seed, 17) - 8;
    return ldexp(1, off + (up ? ups[at] : downs[at]));
}

static void hard_each(uint64_t *seed, enum hard_family family, double p[5][3]) {
    for (int i = 0; i < 5; i++)
        for (int k = 0; k < 3; k++)
            p[i][k] = hard_coordinate(seed, family);
}

static void hard_permuted(uint64_t *seed, double p[5][3]) {
    double all[5][3];
    hard_each(seed, HARD_EXPONENTS, all);
    for (int i = 0; i < 5; i++) {
        int turn = hard_below(seed, 3), odd = 1 + hard_below(seed, 2);
        for (int k = 0; k < 3; k++)
            p[i][k] = hard_sign(seed) * all[0][(odd * k + turn) % 3];
    }
    if (hard_below(seed, 2) != 0) {
        double *moved = &p[hard_below(seed, 5)][hard_below(seed, 3)];
        *moved = nextafter(*moved, 0);
    }
}

static void hard_points(uint64_t *seed, enum hard_family family,
                        double p[5][3]) {
    double lo[3], hi[3], scale;
    switch (family) {
    case HARD_LARGE_GRID:
    case HARD_FLOATS:
    case HARD_WIDE_BOX:
        for (int k = 0; k < 3; k++) {
            lo[k] = hard_unit(seed);
            hi[k] = hard_unit(seed);
            if (family == HARD_LARGE_GRID) {
                scale = ldexp(1, 1 + hard_below(seed, 40));
                lo[k] = floor(lo[k] * scale);
                hi[k] = lo[k] + 1 + floor(ldexp(hi[k], hard_below(seed, 32)));
            } else if (family == HARD_FLOATS) {
                lo[k] = (float)(10 * lo[k]);
                hi[k] = (float)(lo[k] + 0.1 * hi[k]);
            } else {
                lo[k] = -ldexp(lo[k], -hard_below(seed, 200));
                hi[k] = ldexp(hi[k], -hard_below(seed, 200));
            }
        }
        hard_box(seed, p, lo, hi);
        break;
    case HARD_PLANE:
        hard_each(seed, HARD_UNIFORM, p);
        for (int k = 0; k < 3; k++)
            lo[k] = hard_unit(seed) - 0.5;
        for (int i = 0; i < 5; i++)
            p[i][2] =
                hard_shaken(seed, lo[0] * p[i][0] + lo[1] * p[i][1] + lo[2]);
        break;
    case HARD_SPHERE:
        hard_on_sphere(seed, p);
        break;
    case HARD_TURNED:
        hard_turned(seed, p);
        break;
    case HARD_PERMUTED:
        hard_permuted(seed, p);
        break;
    case HARD_UP:
    case HARD_DOWN:
        hard_points(seed, (enum hard_family)hard_below(seed, HARD_SPREAD), p);
        scale = hard_edge(seed, family == HARD_UP);
        for (int i = 0; i < 15; i++)
            p[i / 3][i % 3] *= scale;
        break;
    default:
        hard_each(seed, family, p);
        break;
    }
}

/* Whether no two of the five points are equal. */
static int hard_distinct(double p[5][3]) {
    for (int i = 0; i < 5; i++) {
        for (int j = 0; j < i; j++)
            if (p[i][0] == p[j][0] && p[i][1] == p[j][1] && p[i][2] == p[j][2])
                return 0;
    }
    return 1;
}

#endif
