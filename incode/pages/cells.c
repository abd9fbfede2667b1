#include "cells.h"

uint32_t incode_cell_along(double lo, double hi, uint32_t cells, double p) {
    /* Halves first: hi - lo of two finite numbers may overflow. */
    double side = 0.5 * hi - 0.5 * lo;
    double t = (0.5 * p - 0.5 * lo) / side * (double)cells;
    if (!(t > 0)) { /* below the box, or a side of no length: NaN */
        return 0;
    }
    return t < (double)cells ? (uint32_t)t : cells - 1;
}

uint32_t incode_cell_of(const double lo[3], const double hi[3],
                        const uint32_t cells[3], const double p[3]) {
    uint32_t ix = incode_cell_along(lo[0], hi[0], cells[0], p[0]);
    uint32_t iy = incode_cell_along(lo[1], hi[1], cells[1], p[1]);
    uint32_t iz = incode_cell_along(lo[2], hi[2], cells[2], p[2]);
    return (iz * cells[1] + iy) * cells[0] + ix;
}

/* The cell function itself is asked, and it never falls as the
 * coordinate grows, so rounding cannot make the bound wrong, only wide. */
double incode_cells_lowest(const struct incode_grid *g, int d, uint32_t cell) {
    double lo = g->lo[d], hi = g->hi[d];
    if (cell == 0)
        return lo;
    double side = 0.5 * hi - 0.5 * lo;
    double wall = 2 * (0.5 * lo + side * ((double)cell / g->cells[d]));
    double slack =
        0x1p-50 * (__builtin_fabs(lo) + __builtin_fabs(hi)) + 0x1p-1070;
    for (int i = 0; i < 4; i++, slack *= 64) {
        double bound = wall - slack;
        if (!(bound > lo))
            return lo;
        if (incode_cell_along(lo, hi, g->cells[d], bound) < cell)
            return bound;
    }
    return lo;
}

double incode_cells_highest(const struct incode_grid *g, int d, uint32_t cell) {
    double lo = g->lo[d], hi = g->hi[d];
    if (cell + 1 >= g->cells[d])
        return hi;
    double side = 0.5 * hi - 0.5 * lo;
    double wall = 2 * (0.5 * lo + side * ((double)(cell + 1) / g->cells[d]));
    double slack =
        0x1p-50 * (__builtin_fabs(lo) + __builtin_fabs(hi)) + 0x1p-1070;
    for (int i = 0; i < 4; i++, slack *= 64) {
        double bound = wall + slack;
        if (!(bound < hi))
            return hi;
        if (incode_cell_along(lo, hi, g->cells[d], bound) > cell)
            return bound;
    }
    return hi;
}

bool incode_cells_word(const struct incode_grid *g, uint32_t base, uint32_t i,
                       uint32_t *word, uint32_t *missing) {
    uint32_t page = base + i / INCODE_PAGE_WORDS;
    const struct incode_frame *f = incode_pager_get(g->pager, page);
    *missing = page;
    if (f == NULL)
        return false;
    *word = f->page.words.word[i % INCODE_PAGE_WORDS];
    *word = *word == INCODE_NONE ? 0 : *word;
    return true;
}
