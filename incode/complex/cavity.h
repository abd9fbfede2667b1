/* The steps of an insertion, for the files of this room only: to locate the
 * point, to find the cells in conflict, to fill the cavity.
 *
 * Memory: the complex's, and 32 KB of stack. */
#ifndef INCODE_CAVITY_H
#define INCODE_CAVITY_H

#include <string.h>

#include "complex.h"

/* INCODE_CELL_MARK of cells during an insertion. */
enum {
    INCODE_CELL_STAYS = 1, /* tested, outside the cavity */
    INCODE_CELL_GOES = 3
};

enum incode_cavity_result {
    INCODE_CAVITY_FILLED,
    INCODE_CAVITY_FULL, /* no room; all is as before */
    INCODE_CAVITY_LARGE /* for incode_complex_insert_large; as before */
};

/* The sphere of a cell, or the half-space of an infinite one, holds p, by exact
 * arithmetic. */
bool incode_complex_holds(const struct incode_complex *x,
                          struct incode_tally *tally,
                          const struct incode_cell *c, const double p[3]);

/* A cell that holds p; INCODE_NONE: it is a vertex already. */
uint32_t incode_complex_locate(struct incode_complex *x,
                               struct incode_tally *tally, uint32_t from,
                               const double p[3]);

enum incode_cavity_result
incode_complex_insert_small(struct incode_complex *x,
                            struct incode_tally *tally, uint32_t v,
                            uint32_t first);
enum incode_cavity_result
incode_complex_insert_large(struct incode_complex *x,
                            struct incode_tally *tally, uint32_t v,
                            uint32_t first);

static inline unsigned incode_cell_mark(const struct incode_cell *c) {
    return c->flags & (unsigned)INCODE_CELL_MARK;
}

static inline void incode_cell_unmark(struct incode_cell *c) {
    c->flags &= (uint8_t)~INCODE_CELL_MARK;
}

/* Whether so many more points and cells fit. */
bool incode_complex_has_room(const struct incode_complex *x, uint32_t points,
                             uint32_t cells);

uint32_t incode_complex_take_cell(struct incode_complex *x);
void incode_complex_free_cell(struct incode_complex *x, uint32_t i);

/* The vertices of a cell opposite each, in an order such that a vertex put
 * behind them takes its place. */
static const uint8_t incode_cell_facet[4][3] = {
    {2, 1, 3}, {0, 2, 3}, {1, 0, 3}, {0, 1, 2}};

/* What each cell keeps of its sphere, to decide for most points at once.
 *
 * With d the difference of a point and the cell's vertex v[3], the point is in
 * the sphere where |d|^2 - X d < 0, X being twice the centre as seen from that
 * vertex; in an infinite cell, beyond the facet where -X d < 0, X being the
 * facet's inner normal, of 1-norm 1.  The cell keeps X as whole multiples of a
 * power of two S, below 2^23 S; S is infinite where nothing is known.
 *
 * Each coordinate is wrong by at most S / 2 for its rounding and S / 16 for
 * what it was computed from.  The roundings of X d here are below 8 u max |X|
 * |d|_1, u = 2^-53, thus 2^-27 S |d|_1.  Those of |d|^2 are below 8 u |d|^2:
 * where that exceeds 2 |X d| the sign is right whatever they are; else they are
 * below 16 u max |X| |d|_1.  In all it is below (9/16 + 2^-25) S |d|_1, and
 * bounded by E |d|_1, E = 73/128 S.
 *
 * S is between 2^-250 and 2^250.  What underflows is below 2^-1070 and, once
 * more, 2^-1047 S; |d|_1 is taken 2^-700 too large.  Where |d|_1 is 2^999 or
 * more, which comes before any product overflows in an infinite cell, the bound
 * does so and nothing is known; where in a finite cell something else
 * overflows, |d|^2 does, which then is more than |X d| by far: the power is
 * infinite, and rightly so, or no number.
 *
 * Memory: 11 bytes a cell.  Work: 20 operations. */

static inline bool incode_sphere_is_infinite(const struct incode_cell *c) {
    return (c->flags & INCODE_CELL_INFINITE) != 0;
}

/* S, whose exponent as a double has 11 bits. */
static inline double incode_sphere_scale(const struct incode_cell *c) {
    uint64_t bits = (uint64_t)c->scale << 55 | (uint64_t)(c->flags >> 5) << 52;
    double s;
    memcpy(&s, &bits, sizeof s);
    return s;
}

/* A coordinate of X, in S. */
static inline int32_t incode_sphere_whole(const struct incode_cell *c, int k) {
    return c->sphere[k] * 256 + (int32_t)c->n[k].low;
}

/* |d|^2 - X d, or -X d: right but for *bound; without a branch. */
static inline double incode_sphere_power(const struct incode_complex_point *v,
                                         const struct incode_cell *c,
                                         const double p[3], double *bound) {
    const double *o = v[c->v[3]].p;
    uint64_t finite = (uint64_t)(c->flags / INCODE_CELL_INFINITE & 1) - 1, lift;
    double s = incode_sphere_scale(c);
    double x = p[0] - o[0], y = p[1] - o[1], z = p[2] - o[2];
    double linear = x * incode_sphere_whole(c, 0) +
                    y * incode_sphere_whole(c, 1) +
                    z * incode_sphere_whole(c, 2);
    double square = x * x + y * y + z * z;
    memcpy(&lift, &square, sizeof lift);
    lift &= finite;
    memcpy(&square, &lift, sizeof square);
    double size =
        __builtin_fabs(x) + __builtin_fabs(y) + (__builtin_fabs(z) + 0x1p-700);
    *bound = size * 0x1.24p25 * (s * 0x1p-26);
    return square - linear * s;
}

enum {
    INCODE_SPHERE_BATCH = 8,
    INCODE_SPHERE_UNITS =
        12 /* of work (incode/predicates/yield.h), that a batch takes */
};

/* Three vertices of each of some cells, as seen from the fourth, coordinate by
 * coordinate; 1 where a vertex is infinite, with coordinates of 0, else 0; what
 * the cells are to keep. */
struct incode_sphere_batch {
    double p[3][3][INCODE_SPHERE_BATCH] __attribute__((aligned(64)));
    double infinite[3][INCODE_SPHERE_BATCH] __attribute__((aligned(64)));
    uint64_t kept[INCODE_SPHERE_BATCH] __attribute__((aligned(64)));
    uint64_t low[INCODE_SPHERE_BATCH] __attribute__((aligned(64)));
};

void incode_sphere_compute(struct incode_sphere_batch *b);

/* Cell j of a batch keeps what there is for it; its other flags are 0. */
static inline void incode_sphere_keep(struct incode_cell *c,
                                      const struct incode_sphere_batch *b,
                                      uint32_t j) {
    for (int k = 0; k < 3; k++) {
        c->sphere[k] = (int16_t)(b->kept[j] >> 16 * k);
        c->n[k].low = (uint8_t)(b->low[j] >> 8 * k);
    }
    c->scale = (uint8_t)(b->kept[j] >> 48);
    c->flags = (uint8_t)(b->kept[j] >> 56);
}

/* Those of some cells with the same last vertex. */
void incode_complex_set_spheres(struct incode_complex *x, uint32_t last,
                                const uint32_t *cell, uint32_t count);

#endif
