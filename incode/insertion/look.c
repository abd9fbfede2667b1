#include "look.h"

#include <stdalign.h>
#include <string.h>

#include "incode/predicates/check.h"

enum {
    PAGES = INCODE_LEVELS_MAX + 16, /* a call */
    ADD_UNITS = 16                  /* of work: twice the precision, perhaps */
};

void incode_look_init(struct incode_look *look, struct incode_maker *maker,
                      const uint64_t *passed, uint64_t *wanted) {
    double extent = 0;
    for (int d = 0; d < 3; d++) {
        double half = maker->hi[d] * 0.5 - maker->lo[d] * 0.5;
        extent = half > extent ? half : extent;
    }
    look->scale = incode_scale_for(extent);
    look->maker = maker;
    look->passed = passed;
    look->wanted = wanted;
}

void incode_look_begin(struct incode_look *look, bool every, uint32_t first,
                       uint32_t last) {
    look->every = every;
    look->pass_first = first;
    look->pass_last = last;
    look->at = 0;
    look->count = 0;
    look->reached = 0;
}

void incode_look_add(struct incode_look *look, const struct incode_complex *x,
                     uint32_t cell) {
    struct incode_region r;
    const struct incode_cell *c = incode_complex_cell(x, cell);
    INCODE_ASSERT(!incode_look_is_full(look));
    incode_maker_breathe(look->maker, ADD_UNITS);
    if (!incode_region_set_sharp(&r, x, c, look->scale) &&
        !incode_region_set(&r, x, c))
        incode_region_set_all(&r);
    incode_regions_set(&look->regions, look->count, &r);
    look->cell[look->count++] = cell;
}

static bool is_set(const uint64_t *bits, uint32_t i) {
    return (bits[i / 64] >> i % 64 & 1) != 0;
}

static uint32_t count_of(uint64_t cells) {
    return (uint32_t)__builtin_popcountll(cells);
}

/* Those of some cells that may reach a child. */
static uint64_t meeting(const struct incode_look *look,
                        const struct incode_boxes *boxes, unsigned child,
                        const double lo[3], const double hi[3],
                        uint64_t cells) {
    struct incode_lifted l;
    incode_maker_breathe(look->maker, 2 + count_of(cells) / 2);
    uint64_t met = incode_regions_meeting(&look->regions, cells, lo, hi);
    if (met == 0 || !incode_boxes_lifted(boxes, child, &l))
        return met;
    incode_maker_breathe(look->maker, count_of(met));
    return incode_regions_meeting_lifted(&look->regions, met, boxes, &l);
}

/* Whether bricks [first, end) need no look. */
static bool is_passed(const struct incode_look *look, uint32_t first,
                      uint32_t end) {
    if (end <= look->at ||
        (first >= look->pass_first && end <= look->pass_last))
        return true;
    return end - first == 1 && (is_set(look->passed, first) ||
                                (look->every && is_set(look->wanted, first)));
}

/* Looks at what is below page `index` of a level of boxes, whose children have
 * `span` bricks each. */
static enum incode_look_result look_below(struct incode_look *look,
                                          uint32_t level, uint32_t index,
                                          uint64_t span, uint64_t cells) {
    const struct incode_tree *tree = &look->maker->tree;
    const struct incode_frame *f =
        incode_pager_get(&look->maker->pager, tree->base[level] + index);
    if (f == NULL)
        return INCODE_LOOK_WAITING;
    if (look->pages-- == 0)
        return INCODE_LOOK_MORE;
    alignas(64) double lo[3][INCODE_FANOUT], hi[3][INCODE_FANOUT];
    const struct incode_boxes boxes = f->page.boxes;
    uint32_t first = index * INCODE_FANOUT;
    uint32_t count = tree->count[level - 1] - first;
    count = count < INCODE_FANOUT ? count : INCODE_FANOUT;
    incode_maker_breathe(look->maker, 4);
    incode_boxes_axes(&boxes, lo, hi);
    for (uint32_t i = 0; i < count; i++) {
        uint64_t end = (first + i + 1) * span;
        end = end < tree->bricks ? end : tree->bricks;
        if (is_passed(look, (uint32_t)((first + i) * span), (uint32_t)end))
            continue;
        const double from[3] = {lo[0][i], lo[1][i], lo[2][i]};
        const double to[3] = {hi[0][i], hi[1][i], hi[2][i]};
        cells &= look->every ? ~UINT64_C(0) : ~look->reached;
        uint64_t met = meeting(look, &boxes, i, from, to, cells);
        if (met != 0 && level > 1) {
            enum incode_look_result r = look_below(look, level - 1, first + i,
                                                   span / INCODE_FANOUT, met);
            if (r != INCODE_LOOK_DONE)
                return r;
        }
        if (met != 0 && level == 1) {
            look->wanted[(first + i) / 64] |= UINT64_C(1) << (first + i) % 64;
            look->reached |= met;
        }
        look->at = (uint32_t)end;
    }
    return INCODE_LOOK_DONE;
}

enum incode_look_result incode_look_go(struct incode_look *look) {
    const struct incode_tree *tree = &look->maker->tree;
    uint64_t span = 1;
    if (tree->levels < 2 || look->count == 0)
        return INCODE_LOOK_DONE;
    look->pages = PAGES;
    for (uint32_t level = 2; level < tree->levels; level++)
        span *= INCODE_FANOUT;
    return look_below(look, tree->levels - 1, 0, span,
                      ~UINT64_C(0) >> (INCODE_LOOK_CELLS - look->count));
}
