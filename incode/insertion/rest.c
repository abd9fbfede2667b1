#include "rest.h"

#include "incode/predicates/simd.h"
#include "region.h"

static void fill_up(struct incode_rest *rest) {
    for (uint32_t i = rest->count; i % 8 != 0; i++)
        for (int d = 0; d < 3; d++) {
            rest->lo[d][i] = __builtin_inf();
            rest->hi[d][i] = -__builtin_inf();
        }
}

/* Children [first, last) of a page of the level above; false: it is
 * missing. */
static bool add(struct incode_rest *rest, struct incode_maker *maker,
                uint32_t level, uint32_t first, uint32_t last) {
    const struct incode_tree *tree = &maker->tree;
    alignas(64) double lo[3][INCODE_FANOUT], hi[3][INCODE_FANOUT];
    if (first >= last)
        return true;
    const struct incode_frame *f = incode_pager_get(
        &maker->pager, tree->base[level + 1] + first / INCODE_FANOUT);
    if (f == NULL)
        return false;
    incode_boxes_axes(&f->page.boxes, lo, hi);
    for (; first < last; first++, rest->count++)
        for (int d = 0; d < 3; d++) {
            rest->lo[d][rest->count] = lo[d][first % INCODE_FANOUT];
            rest->hi[d][rest->count] = hi[d][first % INCODE_FANOUT];
        }
    return true;
}

bool incode_rest_set(struct incode_rest *rest, struct incode_maker *maker,
                     uint32_t before, uint32_t from) {
    const struct incode_tree *tree = &maker->tree;
    rest->count = 0;
    for (uint32_t level = 0; level + 1 < tree->levels; level++) {
        /* Whole pages go to the level above. */
        bool up = from % INCODE_FANOUT == 0 && level + 2 < tree->levels;
        uint32_t page = from / INCODE_FANOUT, end = (page + 1) * INCODE_FANOUT;
        end = end < tree->count[level] ? end : tree->count[level];
        if (!add(rest, maker, level, before - before % INCODE_FANOUT, before) ||
            (!up && !add(rest, maker, level, from, end)))
            return false;
        before /= INCODE_FANOUT;
        from = up ? page : page + 1;
    }
    fill_up(rest);
    return true;
}

static bool ball_reaches(const struct incode_rest *rest,
                         const struct incode_region *r) {
    for (uint32_t i = 0; i < rest->count; i += INCODE_VD_LANES) {
        incode_vd zero = incode_vd_all(0), square = zero;
        for (int d = 0; d < 3; d++) {
            incode_vd c = incode_vd_all(r->centre[d]);
            incode_vd gap = incode_vd_max(incode_vd_load(rest->lo[d] + i) - c,
                                          c - incode_vd_load(rest->hi[d] + i));
            gap = incode_vd_max(gap, zero);
            square = incode_vd_fma(gap, gap, square);
        }
        if (incode_vdm_bits(incode_vd_less(incode_vd_all(r->square), square)) !=
            INCODE_VD_ALL)
            return true;
    }
    return false;
}

bool incode_rest_reaches(const struct incode_rest *rest,
                         const struct incode_complex *x,
                         const struct incode_cell *c) {
    struct incode_region r;
    if (rest->count == 0)
        return false;
    if (!incode_region_set(&r, x, c))
        return true;
    if (!r.infinite)
        return ball_reaches(rest, &r);
    for (uint32_t i = 0; i < rest->count; i++) {
        const double lo[3] = {rest->lo[0][i], rest->lo[1][i], rest->lo[2][i]};
        const double hi[3] = {rest->hi[0][i], rest->hi[1][i], rest->hi[2][i]};
        if (incode_region_is_behind(&r, lo, hi))
            return true;
    }
    return false;
}
