/* The steps of an insertion, for the files of this room alone: where the point
 * is, which cells give way, what takes their place.
 *
 * Memory: the complex's, and 32 KB of stack.  Work: as in complex.h.
 *
 *     first = incode_complex_locate(x, &tally, x->point[near].cell, p);
 *     r = incode_complex_insert_small(x, &tally, v, first);
 *     if (r == INCODE_CAVITY_LARGE)
 *         r = incode_complex_insert_large(x, &tally, v, first);
 */
#ifndef INCODE_CAVITY_H
#define INCODE_CAVITY_H

#include "complex.h"

/* INCODE_CELL_MARK of cells during an insertion. */
enum {
    INCODE_CELL_STAYS = 1, /* looked at */
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

/* The cells that hold p, as `first` does; INCODE_NONE: too many. */
uint32_t incode_complex_find_small(struct incode_complex *x,
                                   struct incode_tally *tally,
                                   const double p[3], uint32_t first,
                                   uint32_t cells[INCODE_COMPLEX_CAVITY]);

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

#endif
