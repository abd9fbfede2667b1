/* Which cells are final: none whose sphere holds a point of the rest, or whose
 * facet's plane does, by exact predicates, whatever bricks are taken out of the
 * middle for the rest, at any scale; and of the others some. */
#include "points_scene.h"

#include "incode/insertion/insertion.h"

enum { MANY = 70000, VOLUME = 6 };

static struct points_scene scene;
static struct incode_rest rest;

/* Of cells of points of own bricks: those whose spheres hold one of the rest,
 * the others, and which of these are told. */
static struct counts { uint64_t reached, free, final; } counts;

static bool is_own(uint32_t brick, uint32_t before, uint32_t from) {
    return brick >= before && brick < from;
}

static bool rest_touches(struct points_scene *s, uint32_t cell, uint32_t before,
                         uint32_t from) {
    for (uint32_t b = 0; b < s->set.order.bricks; b++)
        if (!is_own(b, before, from) && points_touch(s, cell, b))
            return true;
    return false;
}

static void set_rest(struct points_scene *s, uint32_t before, uint32_t from) {
    uint32_t last = from + below(s->set.order.bricks - from + 1);
    while (!incode_rest_set(&rest, &s->maker, before, from, last))
        points_deliver(s);
    assert_true(rest.count <= INCODE_REST_MAX);
}

static void check(struct points_scene *s, uint32_t before, uint32_t from) {
    set_rest(s, before, from);
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < s->x.cells; i++) {
        const struct incode_cell *c = incode_complex_cell(&s->x, i);
        if (incode_cell_is_free(c) || below(20) != 0)
            continue;
        bool reached = incode_rest_reaches(&rest, &s->x, c);
        if (before == 0 && from == s->set.order.bricks)
            assert_false(reached);
        if (rest_touches(s, i, before, from)) {
            if (!reached)
                fail_msg("bricks %u to %u, cell %u is final", before, from, i);
            counts.reached++;
        } else {
            counts.free++;
            counts.final += !reached;
        }
    }
}

/* Each of some bricks ends the own ones, which begin with the first or any. */
static void no_cell_that_is_reached_is_final(making *make, int exponent,
                                             double far) {
    memset(&counts, 0, sizeof counts);
    points_open(&scene, make, exponent, far, POINTS);
    for (uint32_t from = 1; from <= scene.set.order.bricks;
         from += points_step(exponent)) {
        uint32_t before = below(2) == 0 ? 0 : below(from);
        if (points_build(&scene, before, from))
            check(&scene, before, from);
    }
    points_close(&scene);
    assert_true(counts.reached + counts.free > 0);
    /* Volumes let most go. */
    if (exponent == 0 && make == volume)
        assert_true(counts.final > counts.free * VOLUME / 10);
}

TEST(kinds_and_scales) {
    points_of_all_kinds(no_cell_that_is_reached_is_final);
}

TEST(squares_that_underflow) {
    points_that_underflow(no_cell_that_is_reached_is_final);
}

/* ---- the boxes ---- */

static bool is_in_rest(const double p[3]) {
    for (uint32_t i = 0; i < rest.count; i++) {
        bool in = true;
        for (int d = 0; d < 3; d++)
            in = in && p[d] >= rest.lo[d][i] && p[d] <= rest.hi[d][i];
        if (in)
            return true;
    }
    return false;
}

/* Every point of the rest is in its boxes. */
static void check_points(const struct points_scene *s, uint32_t before,
                         uint32_t from) {
    uint32_t step = 1 + s->set.order.bricks / 200;
    for (uint32_t b = 0; b < s->set.order.bricks; b++) {
        /* All at the ends, where levels meet, and some of the others. */
        bool near = b + 40 > before && b < from + 40;
        if (is_own(b, before, from) || (!near && b % step != 0))
            continue;
        for (uint32_t i = 0; i < s->set.order.fill[b]; i++) {
            double p[3];
            host_vertex(&s->set.order, b * INCODE_BRICK_POINTS + i, p);
            if (!is_in_rest(p))
                fail_msg("bricks %u to %u: %u is left out", before, from, b);
        }
    }
}

/* A box of a page is one of the rest's. */
static bool is_box_of_rest(const struct points_scene *s, uint32_t level,
                           uint32_t index) {
    const struct incode_tree *tree = &s->maker.tree;
    uint32_t page = tree->base[level + 1] + index / INCODE_FANOUT;
    alignas(64) double lo[3][INCODE_FANOUT], hi[3][INCODE_FANOUT];
    incode_boxes_axes(&s->set.order.boxes[page - tree->base[1]], lo, hi);
    for (uint32_t i = 0; i < rest.count; i++) {
        bool same = true;
        for (int d = 0; d < 3; d++)
            same = same && rest.lo[d][i] == lo[d][index % INCODE_FANOUT] &&
                   rest.hi[d][i] == hi[d][index % INCODE_FANOUT];
        if (same)
            return true;
    }
    return false;
}

static uint32_t opened; /* boxes of others' bricks */

/* The largest that hold no own brick, of those below a box of `span` bricks;
 * returns how many. */
static uint32_t check_largest(const struct points_scene *s, uint32_t level,
                              uint32_t index, uint32_t span, uint32_t before,
                              uint32_t from) {
    uint32_t first = index * span, last = first + span, count = 0;
    last = last < s->set.order.bricks ? last : s->set.order.bricks;
    if (first >= last)
        return 0;
    if (level + 1 < s->maker.tree.levels && (last <= before || first >= from)) {
        if (is_box_of_rest(s, level, index))
            return 1;
        /* Or it reaches into the own bricks' box, and is opened. */
        if (level == 0 || (first >= from && last <= rest.own_last))
            fail_msg("bricks %u to %u: no box of %u to %u", before, from, first,
                     last);
        opened++;
    }
    for (uint32_t i = 0; i < INCODE_FANOUT && level > 0; i++)
        count += check_largest(s, level - 1, index * INCODE_FANOUT + i,
                               span / INCODE_FANOUT, before, from);
    return count;
}

/* They are the rest's, and no others. */
static void check_boxes(struct points_scene *s, uint32_t before,
                        uint32_t from) {
    uint32_t span = 1;
    set_rest(s, before, from);
    check_points(s, before, from);
    for (uint32_t level = 1; level < s->maker.tree.levels; level++)
        span *= INCODE_FANOUT;
    assert_int_equal(rest.count, check_largest(s, s->maker.tree.levels - 1, 0,
                                               span, before, from));
}

/* Any of them are taken out, and those where pages of boxes begin and end. */
TEST(any_bricks_in_the_middle) {
    static const uint32_t ends[] = {0,   1,    31,   32,   33,  64,
                                    992, 1023, 1024, 1025, 1056};
    enum { ENDS = sizeof ends / sizeof *ends };
    points_open(&scene, volume, 0, 0, MANY);
    uint32_t bricks = scene.set.order.bricks;
    assert_true(scene.maker.tree.levels == 4 && bricks > ends[ENDS - 1]);
    points_forget(&scene, 24, 1);
    for (size_t i = 0; i < ENDS; i++) {
        check_boxes(&scene, ends[i], bricks);
        for (size_t k = 0; k < i; k++)
            if (!SANITIZED || below(6) == 0)
                check_boxes(&scene, ends[k], ends[i]);
    }
    for (int i = 0; i < (SANITIZED ? 5 : 40); i++) {
        uint32_t from = 1 + below(bricks);
        check_boxes(&scene, below(from), from);
    }
    assert_true(opened > 0);
    set_rest(&scene, 0, bricks);
    assert_int_equal(rest.count, 0);
    points_close(&scene);
}
