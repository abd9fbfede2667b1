/* The uniform grid of the paper, index `grid`: cells over the tight box of all
 * points, and the two lists that say which points lie in each, in pages of
 * 384 words: first[cell], and the vertex numbers sorted by cell.
 *
 * Memory: struct incode_grid.  Work: constant; a word may need a page.
 *
 *     struct incode_grid grid = {&pager, &tree, lo, hi, cells};
 *     cell = incode_cell_of(lo, hi, cells, p);
 *     there = incode_cells_word(&grid, tree.cells_base, cell, &first, &page);
 */
#ifndef INCODE_CELLS_H
#define INCODE_CELLS_H

#include "pager.h"

/* The grid: so many cells in x, y and z over the box [lo, hi]. */
struct incode_grid {
    struct incode_pager *pager;
    const struct incode_tree *tree;
    const double *lo, *hi;
    const uint32_t *cells;
};

/* Cell of coordinate p along one side [lo, hi] of the uniform grid:
 * floor((p - lo) / (hi - lo) * cells), clamped to [0, cells).  It never falls
 * as p grows, and no finite input overflows it. */
uint32_t incode_cell_along(double lo, double hi, uint32_t cells, double p);

/* Cell of a point: (iz * cells[1] + iy) * cells[0] + ix. */
uint32_t incode_cell_of(const double lo[3], const double hi[3],
                        const uint32_t cells[3], const double p[3]);

/* Along dimension d, a coordinate that no point of the cells from `cell` on
 * lies below. */
double incode_cells_lowest(const struct incode_grid *g, int d, uint32_t cell);

/* The same from above, for the cells up to `cell`. */
double incode_cells_highest(const struct incode_grid *g, int d, uint32_t cell);

/* Word i of the list whose pages begin at `base`; false: page *missing is.
 * Beyond the end of a list, where who made it erred, it is 0. */
bool incode_cells_word(const struct incode_grid *g, uint32_t base, uint32_t i,
                       uint32_t *word, uint32_t *missing);

#endif
