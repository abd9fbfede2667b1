/* What boxes tell of the points to come: the highest ones, and all of them,
 * down to the points of bricks. */
#include <stdalign.h>
#include <string.h>

#include "insertion.h"
#include "incode/predicates/check.h"
#include "incode/predicates/simd.h"

/* --- rest ----------------------------------------------------------------- */

enum {
    FRAMES_LEFT = 2, /* to others */
    PAGE_UNITS = 4   /* of work, to unpack a page of boxes */
};

#define CUT_MOST 0.0625 /* of an edge of the own bricks' box */

static void fill_up(struct incode_rest *rest) {
    for (uint32_t i = rest->count; i % 8 != 0; i++)
        for (int d = 0; d < 3; d++) {
            rest->lo[d][i] = __builtin_inf();
            rest->hi[d][i] = -__builtin_inf();
        }
}

static bool is_apart(const struct incode_rest *rest, const double lo[3],
                     const double hi[3]) {
    bool apart = false;
    for (int d = 0; d < 3; d++)
        apart = apart || hi[d] <= rest->own_lo[d] || lo[d] >= rest->own_hi[d];
    return apart;
}

/* Cuts off what a box reaches into the own ones', where that is little: boxes
 * of pages are rounded. */
static bool cut_off(struct incode_rest *rest, const double lo[3],
                    const double hi[3]) {
    double least = CUT_MOST, *end = NULL, at = 0;
    for (int d = 0; d < 3; d++) {
        double edge = rest->own_hi[d] - rest->own_lo[d];
        double below = (hi[d] - rest->own_lo[d]) / edge;
        double above = (rest->own_hi[d] - lo[d]) / edge;
        if (below < least) {
            least = below;
            end = &rest->own_lo[d];
            at = hi[d];
        }
        if (above < least) {
            least = above;
            end = &rest->own_hi[d];
            at = lo[d];
        }
    }
    if (end != NULL)
        *end = at;
    return end != NULL;
}

/* Bricks below a page of a level. */
static uint64_t span_of(uint32_t level) {
    uint64_t span = 1;
    for (; level > 0; level--)
        span *= INCODE_FANOUT;
    return span;
}

/* Children [first, last) of a page of the level above; false: it is missing.
 * Others' that reach into the own bricks' box are opened, as far as there is
 * room for what is in them. */
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
    incode_maker_yield(maker, PAGE_UNITS);
    incode_boxes_axes(&f->page.boxes, lo, hi);
    uint64_t span = span_of(level);
    for (; first < last; first++) {
        uint32_t i = first % INCODE_FANOUT;
        bool own = first * span >= rest->own_first &&
                   (first + 1) * span <= rest->own_last;
        const double from[3] = {lo[0][i], lo[1][i], lo[2][i]};
        const double to[3] = {hi[0][i], hi[1][i], hi[2][i]};
        if (level > 0 && !own && rest->spare >= INCODE_FANOUT &&
            !is_apart(rest, from, to) && !cut_off(rest, from, to)) {
            uint32_t child = first * INCODE_FANOUT, end = child + INCODE_FANOUT;
            end = end < tree->count[level - 1] ? end : tree->count[level - 1];
            rest->spare -= INCODE_FANOUT;
            if (!add(rest, maker, level - 1, child, end))
                return false;
            continue;
        }
        for (int d = 0; d < 3; d++) {
            rest->lo[d][rest->count] = from[d];
            rest->hi[d][rest->count] = to[d];
        }
        rest->count++;
    }
    return true;
}

/* Bricks [first, last), by the fewest boxes; false: a page is missing. */
static bool add_bricks(struct incode_rest *rest, struct incode_maker *maker,
                       uint32_t first, uint32_t last) {
    const struct incode_tree *tree = &maker->tree;
    for (uint32_t level = 0; level + 1 < tree->levels && first < last;
         level++) {
        /* Whole pages go to the level above. */
        bool top = level + 2 == tree->levels;
        uint32_t up = (first + INCODE_FANOUT - 1) / INCODE_FANOUT;
        uint32_t end = last == tree->count[level] ? tree->count[level + 1]
                                                  : last / INCODE_FANOUT;
        uint32_t head = top || up > end ? last : up * INCODE_FANOUT;
        head = head < last ? head : last;
        uint32_t tail = top || up > end ? last : end * INCODE_FANOUT;
        if (!add(rest, maker, level, first, head) ||
            !add(rest, maker, level, tail, last))
            return false;
        first = up;
        last = top ? up : end;
    }
    return true;
}

/* The own bricks' box; false: a page is missing. */
static bool set_own(struct incode_rest *rest, struct incode_maker *maker,
                    uint32_t first, uint32_t last) {
    rest->count = rest->spare = 0;
    if (!add_bricks(rest, maker, first, last))
        return false;
    for (int d = 0; d < 3; d++) {
        rest->own_lo[d] = __builtin_inf();
        rest->own_hi[d] = -__builtin_inf();
        for (uint32_t i = 0; i < rest->count; i++) {
            double lo = rest->lo[d][i], hi = rest->hi[d][i];
            rest->own_lo[d] = lo < rest->own_lo[d] ? lo : rest->own_lo[d];
            rest->own_hi[d] = hi > rest->own_hi[d] ? hi : rest->own_hi[d];
        }
    }
    rest->count = 0;
    return true;
}

/* Has the boxes that reach into the own bricks' come first. */
static void part(struct incode_rest *rest) {
    rest->inner = 0;
    for (uint32_t i = 0; i < rest->count; i++) {
        const double from[3] = {rest->lo[0][i], rest->lo[1][i], rest->lo[2][i]};
        const double to[3] = {rest->hi[0][i], rest->hi[1][i], rest->hi[2][i]};
        if (is_apart(rest, from, to))
            continue;
        for (int d = 0; d < 3; d++) {
            rest->lo[d][i] = rest->lo[d][rest->inner];
            rest->hi[d][i] = rest->hi[d][rest->inner];
            rest->lo[d][rest->inner] = from[d];
            rest->hi[d][rest->inner] = to[d];
        }
        rest->inner++;
    }
}

/* Room for boxes that are opened.  All pages that are looked at must have a
 * frame at once: the ends of three ranges on each level, and those. */
static uint32_t spare_of(const struct incode_maker *maker) {
    uint32_t levels = maker->tree.levels - 1;
    uint32_t boxes = INCODE_REST_MAX - levels * 2 * INCODE_FANOUT;
    uint32_t frames = maker->pager.frame_count, ends = 4 * levels;
    uint32_t pages =
        frames > ends + FRAMES_LEFT ? frames - ends - FRAMES_LEFT : 0;
    return pages < boxes / INCODE_FANOUT ? pages * INCODE_FANOUT : boxes;
}

bool incode_rest_set(struct incode_rest *rest, struct incode_maker *maker,
                     uint32_t first, uint32_t from, uint32_t last) {
    const struct incode_tree *tree = &maker->tree;
    rest->own_first = first;
    /* The last page of a level may have fewer bricks. */
    rest->own_last = last == tree->bricks ? UINT32_MAX : last;
    if (!set_own(rest, maker, first, last))
        return false;
    rest->spare = spare_of(maker);
    if (!add_bricks(rest, maker, 0, first) ||
        !add_bricks(rest, maker, from, tree->bricks))
        return false;
    part(rest);
    fill_up(rest);
    return true;
}

bool incode_rest_set_own(struct incode_rest *rest, struct incode_maker *maker,
                         uint32_t from, uint32_t last) {
    rest->own_first = rest->own_last = 0;
    rest->count = rest->spare = 0;
    for (int d = 0; d < 3; d++) { /* no ball is within */
        rest->own_lo[d] = __builtin_inf();
        rest->own_hi[d] = -__builtin_inf();
    }
    if (!add_bricks(rest, maker, from, last))
        return false;
    rest->inner = rest->count;
    fill_up(rest);
    return true;
}

/* Whether a ball lies within the box of the own bricks, and so apart from all
 * boxes but the first.  These may touch the own one, as both comparisons are
 * strict.  A gap is wrong by u of itself, and its square by 3 u in all; the
 * radius has room for 32 u of itself (set_ball), of which it has used 3 u, and
 * is at least 2^-450, so that no square underflows that counts. */
static bool is_within(const struct incode_rest *rest,
                      const struct incode_region *r) {
    bool within = true;
    for (int d = 0; d < 3; d++) {
        double below = r->centre[d] - rest->own_lo[d];
        double above = rest->own_hi[d] - r->centre[d];
        double gap = below < above ? below : above;
        within = within && gap > 0 && r->square < gap * gap;
    }
    return within;
}

static bool ball_reaches(const struct incode_rest *rest,
                         const struct incode_region *r) {
    uint32_t count = is_within(rest, r) ? rest->inner : rest->count;
    for (uint32_t i = 0; i < count; i += INCODE_VD_LANES) {
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

/* --- look ----------------------------------------------------------------- */

enum {
    PAGES = INCODE_LEVELS_MAX + 16, /* a call */
    ADD_UNITS = 16,                 /* of work: twice the precision, perhaps */
    BRICK_UNITS = 8,                /* its points and a sphere */
    CLOSELY_MOST = 48               /* bricks, for each cell */
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
    look->sought = NULL;
    look->closely = false;
    look->first = 0;
    look->end = maker->tree.bricks;
}

void incode_look_begin(struct incode_look *look, bool every, uint32_t first,
                       uint32_t last) {
    look->every = every;
    look->pass_first = first;
    look->pass_last = last;
    look->bounded = false;
    look->at = look->first;
    look->count = 0;
    look->reached = 0;
    memset(look->tried, 0, sizeof look->tried);
}

void incode_look_add(struct incode_look *look, const struct incode_complex *x,
                     uint32_t cell) {
    struct incode_region r;
    const struct incode_cell *c = incode_complex_cell(x, cell);
    INCODE_ASSERT(!incode_look_is_full(look));
    incode_maker_yield(look->maker, ADD_UNITS);
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
    incode_maker_yield(look->maker, 2 + count_of(cells) / 2);
    uint64_t met = incode_regions_meeting(&look->regions, cells, lo, hi);
    if (met == 0 || !incode_boxes_lifted(boxes, child, &l))
        return met;
    incode_maker_yield(look->maker, count_of(met));
    return incode_regions_meeting_lifted(&look->regions, met, boxes, &l);
}

/* Whether bricks [first, end) need no look. */
static bool is_passed(const struct incode_look *look, uint32_t first,
                      uint32_t end) {
    if (end <= look->at || first >= look->end ||
        (first >= look->pass_first && end <= look->pass_last))
        return true;
    bool all = look->sought == NULL || look->sought[first] == ~UINT64_C(0);
    return end - first == 1 &&
           (is_set(look->passed, first) ||
            (look->every && all && is_set(look->wanted, first)));
}

/* Drops those of some cells that reach no point of a brick; false: its page is
 * missing.  A cell whose sphere passes close to the points of many bricks, as
 * do all of points on one sphere, is taken to reach one of them. */
static bool reach_points(struct incode_look *look, uint32_t brick,
                         uint64_t *cells) {
    const struct incode_frame *f = incode_pager_get(&look->maker->pager, brick);
    if (f == NULL)
        return false;
    uint64_t all = ~UINT64_C(0) >> (INCODE_BRICK_POINTS - f->count);
    for (uint64_t left = *cells; left != 0; left &= left - 1) {
        unsigned i = (unsigned)__builtin_ctzll(left);
        if (look->tried[i] == CLOSELY_MOST)
            continue;
        look->tried[i]++;
        incode_maker_yield(look->maker, BRICK_UNITS);
        if ((all & incode_regions_points(&look->regions, i, &f->page.brick)) ==
            0)
            *cells &= ~(UINT64_C(1) << i);
    }
    return true;
}

/* Notes that some cells may reach a brick, or, where that is asked for, those
 * of its points that they may reach; false: its page is missing. */
static bool want(struct incode_look *look, uint32_t brick, uint64_t cells) {
    uint64_t points = ~UINT64_C(0);
    if (look->sought != NULL) {
        const struct incode_frame *f =
            incode_pager_get(&look->maker->pager, brick);
        if (f == NULL)
            return false;
        uint64_t all = points >> (INCODE_BRICK_POINTS - f->count);
        points = look->sought[brick];
        for (; cells != 0 && points != all; cells &= cells - 1) {
            unsigned i = (unsigned)__builtin_ctzll(cells);
            incode_maker_yield(look->maker, BRICK_UNITS);
            points |=
                all & incode_regions_points(&look->regions, i, &f->page.brick);
        }
        look->sought[brick] = points;
    }
    if (points != 0)
        look->wanted[brick / 64] |= UINT64_C(1) << brick % 64;
    return true;
}

/* Whether a box meets the bounds. */
static bool is_in(const struct incode_look *look, const double lo[3],
                  const double hi[3]) {
    bool in = true;
    for (int d = 0; d < 3; d++)
        in = in && lo[d] <= look->hi[d] && hi[d] >= look->lo[d];
    return in;
}

/* Looks at what is below page `index` of a level of boxes, whose children have
 * `span` bricks each. */
static enum incode_step look_below(struct incode_look *look, uint32_t level,
                                   uint32_t index, uint64_t span,
                                   uint64_t cells) {
    const struct incode_tree *tree = &look->maker->tree;
    const struct incode_frame *f =
        incode_pager_get(&look->maker->pager, tree->base[level] + index);
    if (f == NULL)
        return INCODE_WAITING;
    if (look->pages-- == 0)
        return INCODE_WORKED;
    alignas(64) double lo[3][INCODE_FANOUT], hi[3][INCODE_FANOUT];
    const struct incode_boxes boxes = f->page.boxes;
    uint32_t first = index * INCODE_FANOUT;
    uint32_t count = tree->count[level - 1] - first;
    count = count < INCODE_FANOUT ? count : INCODE_FANOUT;
    incode_maker_yield(look->maker, PAGE_UNITS);
    incode_boxes_axes(&boxes, lo, hi);
    for (uint32_t i = 0; i < count; i++) {
        uint64_t end = (first + i + 1) * span;
        end = end < tree->bricks ? end : tree->bricks;
        if (is_passed(look, (uint32_t)((first + i) * span), (uint32_t)end))
            continue;
        const double from[3] = {lo[0][i], lo[1][i], lo[2][i]};
        const double to[3] = {hi[0][i], hi[1][i], hi[2][i]};
        if (look->bounded && !is_in(look, from, to))
            continue;
        cells &= look->every ? ~UINT64_C(0) : ~look->reached;
        uint64_t met = meeting(look, &boxes, i, from, to, cells);
        if (met != 0 && level > 1) {
            enum incode_step r = look_below(look, level - 1, first + i,
                                            span / INCODE_FANOUT, met);
            if (r != INCODE_FINISHED)
                return r;
        }
        if (met != 0 && level == 1) {
            if (look->closely && !reach_points(look, first + i, &met))
                return INCODE_WAITING;
            if (!want(look, first + i, met))
                return INCODE_WAITING;
            look->reached |= met;
        }
        look->at = (uint32_t)end;
    }
    return INCODE_FINISHED;
}

enum incode_step incode_look_go(struct incode_look *look) {
    const struct incode_tree *tree = &look->maker->tree;
    uint64_t span = 1;
    if (tree->levels < 2 || look->count == 0)
        return INCODE_FINISHED;
    look->pages = PAGES;
    for (uint32_t level = 2; level < tree->levels; level++)
        span *= INCODE_FANOUT;
    return look_below(look, tree->levels - 1, 0, span,
                      ~UINT64_C(0) >> (INCODE_LOOK_CELLS - look->count));
}
