/* The points of a run as pages: bricks of 64 points in spatial order, and a
 * tree of boxes over them, 32 children a page.  They are 1,536 and 1,568 bytes,
 * so one pager serves both and the number of points has no bound but 2^32.
 *
 * Level 0 pages are bricks; page i of level k+1 holds the boxes of the
 * children [32 i, 32 i + 32) of level k.  The root is the one page of the
 * highest level, which is at least 1.
 *
 * Memory: struct incode_tree; a page is 1,568 bytes at most.  Work: constant,
 * as there are 8 levels at most.
 *
 *     struct incode_tree tree;
 *     incode_tree_init(&tree, bricks, 0);
 *     root = tree.base[tree.levels - 1];
 */
#ifndef INCODE_PAGES_H
#define INCODE_PAGES_H

#include <assert.h>
#include <stdint.h>

#include "boxes.h"
#include "bricks.h"

enum {
    INCODE_LEAF_POINTS = 8, /* points a leaf of a brick */
    INCODE_BRICK_LEAVES = 8,
    INCODE_BRICK_BYTES = 1536,
    INCODE_PAGE_BYTES = 1568, /* of the largest page */
    INCODE_LEVELS_MAX = 8,    /* bricks, then up to 7 levels of boxes */
    INCODE_PAGE_WORDS = 384   /* uint32 a page of the uniform grid's lists */
};

/* How points are searched: all of them in turn, by the uniform grid, whose
 * lists have pages of their own, or by the tree. */
enum incode_index { INCODE_NAIVE, INCODE_GRID, INCODE_KD };

/* Why a page that has come is not taken: nobody has asked for it, or it cannot
 * be the one of that number (sound.h). */
enum { INCODE_PAGE_UNASKED = -1, INCODE_PAGE_UNSOUND = -2 };

/* A brick: coordinates of slots [0, count); the rest repeats the last point. */
struct incode_brick {
    double x[INCODE_BRICK_POINTS];
    double y[INCODE_BRICK_POINTS];
    double z[INCODE_BRICK_POINTS];
};

/* A page of the uniform grid's two lists (index `grid` only): first[cell] and
 * the vertex numbers sorted by cell. */
struct incode_words {
    uint32_t word[INCODE_PAGE_WORDS];
};

union incode_page {
    struct incode_brick brick;
    struct incode_boxes boxes;
    struct incode_words words;
};

static_assert(sizeof(struct incode_brick) == INCODE_BRICK_BYTES &&
                  sizeof(struct incode_words) == INCODE_BRICK_BYTES &&
                  sizeof(struct incode_boxes) == INCODE_PAGE_BYTES &&
                  sizeof(union incode_page) == INCODE_PAGE_BYTES,
              "pages are what a message carries");

/* Page numbers: level k's page i is base[k] + i; then the uniform grid's cell
 * starts (cells + 1 words) from cells_base, its vertex list from list_base. */
struct incode_tree {
    uint32_t bricks;
    uint32_t levels;                       /* levels used, bricks included */
    uint32_t base[INCODE_LEVELS_MAX + 1];  /* base[levels] = tree pages */
    uint32_t count[INCODE_LEVELS_MAX];     /* pages of each level */
    uint32_t cells_base, list_base, pages; /* grid lists; pages = total */
};

/* Lays out the page numbers for 1 <= bricks; cells = 0 where there is no
 * uniform grid, otherwise the number of its cells. */
void incode_tree_init(struct incode_tree *tree, uint32_t bricks,
                      uint32_t cells);

/* Where bricks [first, first + count), 2 or more, are cut in space: so many
 * come before the cut.  At the multiple of 32^k nearest to the middle, for the
 * largest k that leaves a fifth on either side, so that the children of a box
 * page lie together. */
uint32_t incode_bricks_cut(uint32_t first, uint32_t count);

/* Level of a page, or tree->levels for the uniform grid's pages. */
uint32_t incode_tree_level(const struct incode_tree *tree, uint32_t page);

#endif
