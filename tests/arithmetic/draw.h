/* Numbers and points that predicates find hard, made of integers alone: not one
 * operation on doubles, so that whoever draws them has the same bits, whatever
 * is wrong with its arithmetic.
 *
 * Work: constant, some 20 operations on words a coordinate. */
#ifndef TESTS_ARITHMETIC_DRAW_H
#define TESTS_ARITHMETIC_DRAW_H

#include <stdint.h>

struct draw {
    uint64_t state;
};

enum draw_family {
    DRAW_UNIFORM,     /* between -1 and 1, nothing special */
    DRAW_PLANE,       /* rounded onto a plane, then moved by ulps */
    DRAW_SPHERE,      /* rounded onto a sphere, then moved by ulps */
    DRAW_BOX,         /* corners of boxes of integers up to 2^40 */
    DRAW_SPREAD,      /* coordinates of very different size */
    DRAW_EXPONENTS,   /* any exponents */
    DRAW_LATTICE,     /* 0 .. 3 */
    DRAW_EDGE,        /* the first five where the filters' range ends */
    DRAW_COSPHERICAL, /* five points of one sphere, exactly: ties */
    DRAW_DENORMAL,    /* small multiples of 2^-1074 */
    DRAW_ENDS,        /* the greatest mixed with the least */
    DRAW_LARGEST,     /* near the largest doubles */
    DRAW_FAMILIES
};

/* A stream of its own for each number. */
struct draw draw_begin(uint64_t number);

/* 64 random bits. */
uint64_t draw_bits(struct draw *draw);

/* 0 .. n - 1, n > 0. */
uint32_t draw_below(struct draw *draw, uint32_t n);

/* Any finite double whose exponent is in 2^least .. 2^most; least = -1023 gives
 * denormals, too. */
double draw_between(struct draw *draw, int least, int most);

/* Five points, finite, not always distinct. */
void draw_points(struct draw *draw, enum draw_family family, double p[5][3]);

#endif
