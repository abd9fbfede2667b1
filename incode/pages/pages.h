/* The points of a run as pages: bricks of 64 points in spatial order, and a
 * tree of boxes over them, 32 children a page.  Pages have 1,536 and 1,568
 * bytes, so one pager serves both, and the only bound on the number of points
 * is 2^32.
 *
 * Level 0 pages are bricks; page i of level k+1 holds the boxes of the children
 * [32 i, 32 i + 32) of level k.  The root is the one page of the highest level,
 * which is at least 1.
 *
 * Memory: struct incode_tree; a page is 1,568 bytes at most.  Work: constant,
 * as there are 8 levels at most. */
#ifndef INCODE_PAGES_H
#define INCODE_PAGES_H

#include <assert.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "bricks.h"

/* Pages of the tree: for each of up to 32 children a box along the axes and a
 * lifted box, that of its points in four dimensions.
 *
 * Lifted to (p, |p|^2), what is inside a sphere is a half-space (Brown,
 * Information Processing Letters 9, 1979), and points of one plane, one sphere
 * or one line are flat.  A lifted box has a centre o and three half axes a_k in
 * space, along the principal axes of the points, and below them a lid: each
 * point p is o + sum(s_k a_k) with every |s_k| <= 1, up to a part in 2^20 of
 * the radius, and
 *
 *   |p - o|^2 >= lid + sum(s_k slope_k).
 *
 * So for any D >= 0 and F(p) = D |p|^2 + linear terms, with g the gradient of F
 * at o, no point has less than
 *
 *   F(o) + D lid - sum |g . a_k + D slope_k|      (widened by its rounding)
 *
 * and where that is above 0, none lies in the sphere F = 0.
 *
 * Memory: 1,568 bytes a page, in single precision and less, relative to the
 * page's own origin, everything rounded outward. */

enum { INCODE_FANOUT = 32 /* children a box page, at most */ };

/* Rows begin at multiples of 64 bytes.  Coordinates are origin + unit x, unit a
 * normal power of two, about half the longest side of all children; |x| <= 2.
 * The origin is the middle of all children.  If the smallest child that is not
 * a point is less than a part in 2^12 of them, it is the middle of that one:
 * single precision is finest there.
 * Absent children have lo > hi (+inf, -inf) in every dimension. */
struct incode_boxes {
    float lo[3][INCODE_FANOUT];
    float hi[3][INCODE_FANOUT];
    /* Of the lifted boxes; the axes' box has centre m and size e, half its
     * longest side. */
    int16_t centre[3][INCODE_FANOUT]; /* of the centre less m, e / 32767 each */
    int16_t turn[3][INCODE_FANOUT];   /* x, y and z of the unit quaternion that
                                         turns the axes, 1 / 32767 each; its w
                                         is not negative */
    uint16_t half[3][INCODE_FANOUT];  /* lengths of half axes, in half
                                         precision (binary16), times e */
    int8_t slope[3][INCODE_FANOUT];   /* e^2 / 32 each */
    uint8_t
        is_lifted[INCODE_FANOUT]; /* 0: it says no more than the axes' box */
    int16_t lid[INCODE_FANOUT];   /* e^2 / 8192 each */
    double origin[3];
    double unit;
};

/* A lifted box, relative to the page's origin and in its units. */
struct incode_lifted {
    double o[3];
    double a[3][3]; /* a[k]: half axis k */
    double slope[3];
    double lid;
    double radius; /* no point is farther from o: in rounding's bounds */
};

/* The frame of all that lies in a box: x = (p - origin) / unit overflows
 * nowhere, and is between -2 and 2. */
void incode_boxes_frame(const double lo[3], const double hi[3],
                        double origin[3], double *unit);

/* No children yet; lo..hi: the box of all that there will be. */
void incode_boxes_init(struct incode_boxes *boxes, const double lo[3],
                       const double hi[3]);

/* Sets a child's box along the axes, rounded outward; no lifted box. */
void incode_boxes_set(struct incode_boxes *boxes, unsigned child,
                      const double lo[3], const double hi[3]);

/* The children's boxes along the axes in absolute coordinates, which hold all
 * that was set. */
void incode_boxes_axes(const struct incode_boxes *boxes,
                       double lo[3][INCODE_FANOUT],
                       double hi[3][INCODE_FANOUT]);

/* The directions of a child's half axes, axis[k] that of k: of length 1 and at
 * right angles within a part in 2^48, in any case finite. */
void incode_boxes_turned(const struct incode_boxes *boxes, unsigned child,
                         double axis[3][3]);

/* A child's lifted box, the same numbers on every machine; false: it has none.
 */
bool incode_boxes_lifted(const struct incode_boxes *boxes, unsigned child,
                         struct incode_lifted *lifted);

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

/* Why an arrived page is dropped: it was not requested, or it cannot be the
 * page of that number (incode_page_is_sound). */
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

/* Where bricks [first, first + count), 2 or more, are cut in space: the number
 * of bricks before the cut.  The cut is at the multiple of 32^k nearest to the
 * middle, for the largest k that leaves a fifth on either side, so that the
 * children of a box page lie together. */
uint32_t incode_bricks_cut(uint32_t first, uint32_t count);

/* Level of a page, or tree->levels for the uniform grid's pages. */
uint32_t incode_tree_level(const struct incode_tree *tree, uint32_t page);

/* Whether bytes that have arrived can be the page of their number: coordinates
 * are finite and in the box of all points, boxes too, and numbers in lists are
 * vertex numbers.  Later code relies on this.  No node can tell whether the
 * points are the right ones. */

/* lo, hi: the box of all points.  data: aligned to 4 bytes. */
bool incode_page_is_sound(const struct incode_tree *tree, const double lo[3],
                          const double hi[3], uint32_t page, const void *data,
                          size_t bytes);

#endif
