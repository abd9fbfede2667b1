/* A close look at cells: which bricks to come may hold a point of their
 * spheres, as far as all boxes tell, the lifted ones, too.
 *
 * Some cells at a time go down the tree together, so that a page is wanted once
 * for all of them, and each box is unpacked once.
 *
 * Memory: struct incode_look, about 8 KB, and bits of its owner's; stack for
 * the levels of boxes.  Work: some pages a call, 32 boxes of each for each of
 * the spheres that meet it.
 *
 *     incode_look_begin(&look, false, first, last);
 *     while (!incode_look_is_full(&look) && (cell = next()) != NONE)
 *         incode_look_add(&look, &x, cell);
 *     while (incode_look_go(&look) != INCODE_LOOK_DONE)
 *         deliver_what_is_asked_for();
 *     reached = incode_look_has_reached(&look, i);
 */
#ifndef INCODE_LOOK_H
#define INCODE_LOOK_H

#include "incode/apex/maker.h"
#include "region.h"

enum { INCODE_LOOK_CELLS = INCODE_REGIONS };

enum incode_look_result {
    INCODE_LOOK_DONE,
    INCODE_LOOK_MORE,   /* call again */
    INCODE_LOOK_WAITING /* for a page, which is asked for */
};

struct incode_look {
    struct incode_maker *maker;
    double scale; /* 2^k, of relative coordinates */
    /* A bit a brick: not to be looked at; reached, now or before. */
    const uint64_t *passed;
    uint64_t *wanted;
    bool every; /* all bricks that a cell reaches, not one */
    uint32_t pass_first, pass_last; /* bricks that are passed, too */
    uint32_t at;                    /* bricks before it have been looked at */
    uint32_t pages;                 /* left in this call */
    uint32_t count;
    uint64_t reached; /* a bit a cell */
    uint32_t cell[INCODE_LOOK_CELLS];
    struct incode_regions regions;
};

void incode_look_init(struct incode_look *look, struct incode_maker *maker,
                      const uint64_t *passed, uint64_t *wanted);

/* No cells yet; bricks [first, last) are passed.  every: all bricks that a cell
 * may reach become wanted, but which cells do is not told; else one of them,
 * for each cell that does. */
void incode_look_begin(struct incode_look *look, bool every, uint32_t first,
                       uint32_t last);

static inline bool incode_look_is_full(const struct incode_look *look) {
    return look->count == INCODE_LOOK_CELLS;
}

void incode_look_add(struct incode_look *look, const struct incode_complex *x,
                     uint32_t cell);

/* Looks at some pages. */
enum incode_look_result incode_look_go(struct incode_look *look);

/* Whether cell i of those added may reach a brick. */
static inline bool incode_look_has_reached(const struct incode_look *look,
                                           uint32_t i) {
    return (look->reached >> i & 1) != 0;
}

#endif
