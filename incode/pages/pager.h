/* Pages in fixed frames, replaced least recently used first.  A frame is
 * reserved before its page is requested, so a reply always has room.
 *
 * Memory: incode_pager_bytes(frames), 1,600 and 16 a frame.  Work: constant for
 * a resident page.  To replace a page, the pager reads the times of use of one
 * group of frames in 32, and as a rule of the frames of some groups; for a box
 * of points, these points.
 *
 * A frame keeps its page until a page is requested that is not resident.  So a
 * caller may hold a frame across a walk, which returns at the first missing
 * page, but not across a walk that looks ahead and passes missing pages over.
 */
#ifndef INCODE_PAGER_H
#define INCODE_PAGER_H

#include <assert.h>
#include <stdalign.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "incode/predicates/yield.h"
#include "pages.h"

enum incode_frame_state {
    INCODE_FRAME_LOADING, /* reserved, the page is on its way */
    INCODE_FRAME_HELD,    /* arrived, kept back by the test's shuffle */
    INCODE_FRAME_READY
};

struct incode_frame {
    alignas(64) union incode_page page;
    uint32_t number; /* the page */
    uint8_t count;   /* points of a brick */
    uint64_t label;  /* the user's, which may be sent with the page */
};

static_assert(sizeof(struct incode_frame) == 1600,
              "a frame holds its page and little else");

/* What the pager reads to find a frame, close together. */
struct incode_slot {
    uint32_t number;
    uint16_t chain; /* next frame of the same hash */
    uint8_t state;
};

/* How many leaves a brick has, 1 to INCODE_BRICK_LEAVES. */
static inline unsigned incode_frame_leaves(const struct incode_frame *f) {
    return (f->count + INCODE_LEAF_POINTS - 1U) / INCODE_LEAF_POINTS;
}

/* The tight boxes of a brick's leaves, in absolute coordinates; those past its
 * last leaf are that of its last point.  lo, hi: aligned to 64 bytes. */
void incode_frame_leaf_boxes(const struct incode_frame *f,
                             double lo[3][INCODE_BRICK_LEAVES],
                             double hi[3][INCODE_BRICK_LEAVES]);

/* The tight box of a brick; returns the longest side of its leaves. */
double incode_frame_box(const struct incode_frame *f, double lo[3],
                        double hi[3]);

/* Where pages come from. */
struct incode_page_source {
    void *context;
    /* Requests a page whose frame is reserved.  False: there is no credit now;
     * the pager requests it again later. */
    bool (*request)(void *context, uint32_t page);
};

struct incode_pager {
    struct incode_frame *frames;
    uint64_t *used; /* when each was last; WAITING more where it is not ready */
    uint64_t *oldest; /* at most the least of these of each group of frames */
    uint64_t time;
    struct incode_slot *slots; /* of each frame */
    uint16_t *heads;           /* hash of page numbers to frames */
    uint32_t frame_count, group_count, hash_mask;
    uint32_t loading, loading_max, held;
    uint32_t bricks;  /* pages below this are bricks */
    uint16_t free;    /* frames from here on were never used */
    uint64_t shuffle; /* state of the test's shuffle; 0: none */
    struct incode_page_source source;
    uint64_t requests, evictions;
    uint32_t frames_used; /* high water */
};

#define INCODE_NO_FRAME UINT16_MAX
#define INCODE_FRAME_WAITING (UINT64_C(1) << 63)

size_t incode_pager_bytes(uint32_t frames);

/* memory: aligned to 64 bytes; 1 <= frames < INCODE_NO_FRAME.  yield: counts
 * the work, which grows with the frames. */
void incode_pager_init(struct incode_pager *pager, void *memory,
                       uint32_t frames, uint32_t bricks,
                       struct incode_yield *yield);

/* The frame of a page that is ready, now the most recently used.  NULL: the
 * page is not ready, and is requested as far as credit and frames allow. */
struct incode_frame *incode_pager_get(struct incode_pager *pager,
                                      uint32_t page);

/* Whether the page is on its way. */
bool incode_pager_loading(const struct incode_pager *pager, uint32_t page);

/* A page that is on its way; INCODE_NONE: there is none.  Work: a pass over the
 * frames. */
uint32_t incode_pager_awaited(const struct incode_pager *pager);

/* 0, or -1 if the page was not requested or its size is wrong. */
int incode_pager_deliver(struct incode_pager *pager, uint32_t page,
                         const void *data, size_t bytes);

/* A page that was not requested: kept if it is on its way, or if a frame was
 * never used.  0, or -1 if its size is wrong. */
int incode_pager_put(struct incode_pager *pager, uint32_t page,
                     const void *data, size_t bytes);

/* Whether a frame was never used: nothing has been evicted yet. */
static inline bool incode_pager_has_free(const struct incode_pager *pager) {
    return pager->free < pager->frame_count;
}

/* _has: whether a page is ready. _copy: copies a page of points or boxes that
 * is ready as it arrived, and returns its bytes, at most INCODE_PAGE_BYTES; 0:
 * it is not ready, or of another kind.  Neither counts as a use. */
bool incode_pager_has(const struct incode_pager *pager, uint32_t page);
size_t incode_pager_copy(const struct incode_pager *pager, uint32_t page,
                         void *data);

/* The label of a page that has a frame, 0 at first; NULL: it has none. */
uint64_t *incode_pager_label(const struct incode_pager *pager, uint32_t page);

/* Makes one page ready that the shuffle keeps back: in one call of four at
 * random or, if `now`, at once.  False: none was made ready. */
bool incode_pager_release(struct incode_pager *pager, bool now);

/* The uniform grid of the paper, index `grid`: cells over the tight box of all
 * points, and the two lists that say which points lie in each, in pages of
 * 384 words: first[cell], and the vertex numbers sorted by cell. */

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
 * Beyond the end of a list, which only a faulty list asks for, it is 0. */
bool incode_cells_word(const struct incode_grid *g, uint32_t base, uint32_t i,
                       uint32_t *word, uint32_t *missing);

#endif
