#include "draw.h"

#include <stdbool.h>
#include <string.h>

enum { EXPONENT_ONE = 1023, EXPONENT_MOST = 2046 };

#define MANTISSA ((UINT64_C(1) << 52) - 1)
#define SIGN (UINT64_C(1) << 63)

/* A counter stirred until each of its bits changes half of all bits. */
struct draw draw_begin(uint64_t number) {
    uint64_t s = (number + 1) * UINT64_C(0xd1342543de82ef95);
    s ^= s >> 32;
    s *= UINT64_C(0xaf251af3b0f025b5);
    s ^= s >> 29;
    return (struct draw){s | 1};
}

/* Marsaglia's xorshift, its low bits mended by a multiplication. */
uint64_t draw_bits(struct draw *draw) {
    uint64_t s = draw->state;
    s ^= s << 13;
    s ^= s >> 7;
    s ^= s << 17;
    draw->state = s;
    s *= UINT64_C(0x9e3779b97f4a7c15);
    return s ^ s >> 32;
}

uint32_t draw_below(struct draw *draw, uint32_t n) {
    return (uint32_t)((draw_bits(draw) >> 32) * n >> 32);
}

static double double_of(uint64_t bits) {
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static uint64_t bits_of(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

double draw_between(struct draw *draw, int least, int most) {
    uint64_t bits = draw_bits(draw);
    uint32_t span = (uint32_t)(most - least + 1);
    uint64_t e = (uint32_t)(least + EXPONENT_ONE) + draw_below(draw, span);
    return double_of((bits & (SIGN | MANTISSA)) | e << 52);
}

/* n 2^e, cut to 53 bits, for a result that is no denormal. */
static double number(int64_t n, int e) {
    uint64_t m = n < 0 ? 0 - (uint64_t)n : (uint64_t)n;
    if (m == 0)
        return 0;
    int top = 63 - __builtin_clzll(m);
    m = top > 52 ? m >> (top - 52) : m << (52 - top);
    uint32_t exponent = (uint32_t)(top + e + EXPONENT_ONE);
    return double_of((n < 0 ? SIGN : 0) | (uint64_t)exponent << 52 |
                     (m & MANTISSA));
}

/* Between -1 and 1, evenly but for what is below 2^-12. */
static double unit(struct draw *draw) {
    uint64_t bits = draw_bits(draw), e = EXPONENT_ONE - 1;
    e -= (uint32_t)__builtin_ctzll(bits >> 52 | UINT64_C(1) << 11);
    return double_of((bits & (SIGN | MANTISSA)) | e << 52);
}

/* Half of the time one or two units in the last place off. */
static double shaken(struct draw *draw, double x) {
    static const int by[8] = {0, 0, 0, 0, 1, -1, 2, -2};
    uint64_t bits = bits_of(x);
    int off = by[draw_below(draw, 8)];
    bool room = (bits & ~SIGN) > 2 && (bits & ~SIGN) < bits_of(0x1p1023);
    return room ? double_of(bits + (uint64_t)(int64_t)off) : x;
}

/* -2^(bits-1) .. 2^(bits-1) - 1. */
static int64_t integer(struct draw *draw, int bits) {
    return (int64_t)draw_bits(draw) >> (64 - bits);
}

/* The fourth and fifth of them in the plane of the others. */
static void plane(struct draw *draw, double p[5][3]) {
    int64_t n[5][3];
    int bits = 20 + (int)draw_below(draw, 36);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            n[i][k] = integer(draw, bits);
    for (int i = 3; i < 5; i++) {
        int64_t s = integer(draw, 6), t = integer(draw, 6);
        for (int k = 0; k < 3; k++)
            n[i][k] = n[0][k] +
                      ((n[1][k] - n[0][k]) * s + (n[2][k] - n[0][k]) * t) / 16;
    }
    for (int i = 0; i < 15; i++)
        p[i / 3][i % 3] = shaken(draw, number(n[i / 3][i % 3], -bits));
}

/* A vector and the same with other signs, in another order, are equally long.
 */
static void sphere(struct draw *draw, double p[5][3], bool shake) {
    int bits =
        shake ? 20 + (int)draw_below(draw, 36) : 2 + (int)draw_below(draw, 24);
    int64_t v[3], center[3];
    for (int k = 0; k < 3; k++) {
        v[k] = integer(draw, bits);
        center[k] = integer(draw, bits + 2);
    }
    uint32_t turns = draw_below(draw, 1u << 30);
    for (int i = 0; i < 5; i++, turns >>= 6) {
        for (uint32_t k = 0; k < 3; k++) {
            uint32_t from = (turns & 1) != 0 ? 4 - k : k;
            int64_t x = v[(from + (turns >> 1 & 3)) % 3];
            x = center[k] + ((turns >> (3 + k) & 1) != 0 ? -x : x);
            p[i][k] = number(x, shake ? -bits : 0);
            if (shake)
                p[i][k] = shaken(draw, p[i][k]);
        }
    }
}

/* Corners of a box; now and then a point off them. */
static void box(struct draw *draw, double p[5][3]) {
    int64_t corner[2][3];
    uint32_t at = draw_below(draw, 8), step = 1 + 2 * draw_below(draw, 4);
    for (int k = 0; k < 3; k++) {
        corner[0][k] = integer(draw, 1 + (int)draw_below(draw, 41));
        corner[1][k] = corner[0][k] + 1 + (integer(draw, 33) & UINT32_MAX);
    }
    for (int i = 0; i < 5; i++, at += step)
        for (int k = 0; k < 3; k++)
            p[i][k] = number(corner[at >> k & 1][k], 0);
    if (draw_below(draw, 4) == 0) {
        uint32_t k = draw_below(draw, 3);
        p[4][k] = shaken(draw, p[4][k]);
    }
}

/* x 2^e, where it is neither 0 nor leaves the range. */
static double moved(double x, int e) {
    uint64_t bits = bits_of(x);
    int to = (int)(bits >> 52 & 0x7ff) + e;
    if ((bits & ~SIGN) == 0 || to < 1 || to > EXPONENT_MOST)
        return x;
    return double_of((bits & (SIGN | MANTISSA)) | (uint64_t)to << 52);
}

/* Where products of two, three or five differences leave the range of doubles,
 * and where the filters say that they might. */
static void edge(struct draw *draw, double p[5][3]) {
    static const int16_t ends[8] = {204, 340, 511, -214, -358, -537, 202, -322};
    enum draw_family of = draw_below(draw, DRAW_EDGE - 2);
    int e = ends[draw_below(draw, 8)] + (int)draw_below(draw, 17) - 8;
    draw_points(draw, of, p);
    for (int i = 0; i < 15; i++)
        p[i / 3][i % 3] = moved(p[i / 3][i % 3], e);
}

static double coordinate(struct draw *draw, enum draw_family family) {
    uint64_t bits;
    switch (family) {
    case DRAW_SPREAD:
        return draw_between(draw, -120, -1);
    case DRAW_EXPONENTS:
        return draw_between(draw, -1023, 1023);
    case DRAW_LATTICE:
        return number((int64_t)draw_below(draw, 4), 0);
    case DRAW_DENORMAL:
        bits = draw_bits(draw);
        return double_of((bits & SIGN) |
                         (bits & MANTISSA) >> (32 + (bits >> 52 & 15)));
    case DRAW_ENDS:
        bits = draw_bits(draw);
        return double_of((bits & SIGN) | (bits >> 8 & 3) |
                         ((bits & 1) != 0 ? bits_of(0x1p1000) : 0));
    case DRAW_LARGEST:
        bits = draw_bits(draw);
        return double_of((bits & SIGN) |
                         (bits_of(0x1.fffffffffffffp1023) - (bits & 3) -
                          ((bits & 4) != 0 ? MANTISSA + 1 : 0)));
    default:
        return unit(draw);
    }
}

void draw_points(struct draw *draw, enum draw_family family, double p[5][3]) {
    switch (family) {
    case DRAW_PLANE:
        plane(draw, p);
        break;
    case DRAW_SPHERE:
    case DRAW_COSPHERICAL:
        sphere(draw, p, family == DRAW_SPHERE);
        break;
    case DRAW_BOX:
        box(draw, p);
        break;
    case DRAW_EDGE:
        edge(draw, p);
        break;
    default:
        for (int i = 0; i < 15; i++)
            p[i / 3][i % 3] = coordinate(draw, family);
        break;
    }
}
