/* What a close look tells of cells: one that reaches no brick has no point of
 * any that is not passed in its sphere, or beyond its facet or in its plane, by
 * exact predicates, at any scale; each brick with such a point is wanted where
 * all are asked for; most cells are let go; and neither how slowly pages come
 * nor which cells are looked at together changes anything. */
#include "points_scene.h"

#include "incode/insertion/insertion.h"

enum { MANY = 70000, BRICKS_MAX = 2048, WORDS = BRICKS_MAX / 64 };

static struct points_scene scene;
static struct incode_look look;

/* A bit a brick. */
struct bricks {
    uint64_t bits[WORDS];
};

static bool has(const struct bricks *b, uint32_t brick) {
    return (b->bits[brick / 64] >> brick % 64 & 1) != 0;
}

static void put(struct bricks *b, uint32_t brick) {
    b->bits[brick / 64] |= UINT64_C(1) << brick % 64;
}

static uint32_t count(const struct bricks *b) {
    uint32_t n = 0;
    for (int i = 0; i < WORDS; i++)
        n += (uint32_t)__builtin_popcountll(b->bits[i]);
    return n;
}

/* Some cells that are looked at together, and which bricks are passed. */
struct batch {
    uint32_t cell[INCODE_LOOK_CELLS], count;
    struct bricks passed;
    uint32_t pass_first, pass_last;
};

static bool is_passed(const struct batch *b, uint32_t brick) {
    return has(&b->passed, brick) ||
           (brick >= b->pass_first && brick < b->pass_last);
}

/* What a look has told, and how it got on. */
struct told {
    uint64_t reached;
    struct bricks wanted; /* with what was so before */
    uint64_t *sought;     /* [BRICKS_MAX], or NULL */
    uint32_t more, waiting;
};

/* Looks at cells [first, end) of a batch. */
static void look_at(struct points_scene *s, const struct batch *b, bool every,
                    uint32_t first, uint32_t end, struct told *told) {
    enum incode_step r;
    incode_look_init(&look, &s->maker, b->passed.bits, told->wanted.bits);
    look.sought = told->sought;
    incode_look_begin(&look, every, b->pass_first, b->pass_last);
    for (uint32_t i = first; i < end; i++) {
        assert_false(incode_look_is_full(&look));
        incode_look_add(&look, &s->x, b->cell[i]);
    }
    assert_int_equal(incode_look_is_full(&look),
                     end - first == INCODE_LOOK_CELLS);
    while ((r = incode_look_go(&look)) != INCODE_FINISHED) {
        if (r == INCODE_WAITING)
            points_deliver(s);
        told->waiting += r == INCODE_WAITING;
        told->more += r == INCODE_WORKED;
    }
    told->reached = 0;
    for (uint32_t i = 0; i < end - first; i++)
        told->reached |= (uint64_t)incode_look_has_reached(&look, i) << i;
}

/* Of cells: those whose spheres hold a point of a brick that is not passed, the
 * others, which of these are let go, and for which of these boxes along the
 * axes would not do. */
static struct counts {
    uint64_t reached, free, final, lifted, sought, held;
} counts;

/* Whether cell i of the last look meets a brick's box along the axes. */
static bool meets_a_box(const struct points_scene *s, const struct batch *b,
                        uint32_t i) {
    const struct host_order *order = &s->set.order;
    alignas(64) double lo[3][INCODE_FANOUT], hi[3][INCODE_FANOUT];
    for (uint32_t brick = 0; brick < order->bricks; brick++) {
        uint32_t k = brick % INCODE_FANOUT;
        if (k == 0)
            incode_boxes_axes(&order->boxes[brick / INCODE_FANOUT], lo, hi);
        const double from[3] = {lo[0][k], lo[1][k], lo[2][k]};
        const double to[3] = {hi[0][k], hi[1][k], hi[2][k]};
        if (!is_passed(b, brick) &&
            incode_regions_meeting(&look.regions, UINT64_C(1) << i, from, to))
            return true;
    }
    return false;
}

/* Which bricks that are not passed have a point of a cell. */
static struct bricks touched_by(struct points_scene *s, const struct batch *b,
                                uint32_t cell) {
    struct bricks touched = {{0}};
    for (uint32_t brick = 0; brick < s->set.order.bricks; brick++)
        if (!is_passed(b, brick) && points_touch(s, cell, brick))
            put(&touched, brick);
    return touched;
}

static void check_passed(const struct points_scene *s, const struct batch *b,
                         const struct bricks *wanted) {
    for (uint32_t brick = 0; brick < BRICKS_MAX; brick++)
        if (has(wanted, brick))
            assert_true(brick < s->set.order.bricks && !is_passed(b, brick));
}

/* Each point of a brick that is not passed and that a cell holds is sought, of
 * bricks that are wanted alone; of all points of these, few are. */
static void check_sought(struct points_scene *s, const struct batch *b) {
    static uint64_t sought[BRICKS_MAX];
    struct told told = {.sought = sought};
    memset(sought, 0, sizeof sought);
    look_at(s, b, true, 0, b->count, &told);
    for (uint32_t brick = 0; brick < s->set.order.bricks; brick++) {
        assert_int_equal(has(&told.wanted, brick), sought[brick] != 0);
        uint32_t fill = is_passed(b, brick) ? 0 : s->set.order.fill[brick];
        for (uint32_t i = 0; i < fill; i++) {
            double p[3];
            bool held = false, is = (sought[brick] >> i & 1) != 0;
            host_vertex(&s->set.order, brick * INCODE_BRICK_POINTS + i, p);
            for (uint32_t k = 0; k < b->count && !held; k++)
                held = points_holds(s, b->cell[k], p);
            if (held && !is)
                fail_msg("brick %u: point %u is not sought", brick, i);
            counts.sought += is;
            counts.held += held;
        }
    }
}

/* One brick for each cell, and all bricks for all. */
static void check_batch(struct points_scene *s, const struct batch *b,
                        struct told *one, struct told *every) {
    look_at(s, b, false, 0, b->count, one);
    look_at(s, b, true, 0, b->count, every);
    check_sought(s, b);
    check_passed(s, b, &one->wanted);
    check_passed(s, b, &every->wanted);
    for (int i = 0; i < WORDS; i++)
        assert_int_equal(one->wanted.bits[i] & ~every->wanted.bits[i], 0);
    assert_int_equal(count(&one->wanted) > 0, one->reached != 0);
    assert_true((int)count(&one->wanted) <= __builtin_popcountll(one->reached));
    for (uint32_t i = 0; i < b->count; i++) {
        struct bricks touched = touched_by(s, b, b->cell[i]);
        bool reached = (one->reached >> i & 1) != 0;
        if (count(&touched) > 0 && !reached)
            fail_msg("cell %u is let go", b->cell[i]);
        for (uint32_t brick = 0; brick < s->set.order.bricks; brick++)
            if (has(&touched, brick) && !has(&every->wanted, brick))
                fail_msg("cell %u: brick %u is not wanted", b->cell[i], brick);
        counts.reached += count(&touched) > 0;
        counts.free += count(&touched) == 0;
        counts.final += !reached;
        counts.lifted += !reached && meets_a_box(s, b, i);
    }
}

/* The same in batches of `size`, with few frames, one page at a time. */
static void check_pieces(struct points_scene *s, const struct batch *b,
                         uint32_t size, uint32_t frames, const struct told *one,
                         const struct told *every, struct told *last) {
    struct told piece = {0}, all = {0};
    uint64_t reached = 0;
    for (uint32_t first = 0; first < b->count; first += size) {
        uint32_t end = first + size < b->count ? first + size : b->count;
        points_forget(s, frames, 1);
        look_at(s, b, false, first, end, &piece);
        reached |= piece.reached << first;
        points_forget(s, frames, 1);
        look_at(s, b, true, first, end, &all);
    }
    assert_int_equal(reached, one->reached);
    assert_memory_equal(&all.wanted, &every->wanted, sizeof all.wanted);
    /* Of some cells at a time, there may be others. */
    assert_true(size < b->count ||
                memcmp(&piece.wanted, &one->wanted, sizeof piece.wanted) == 0);
    last->more += piece.more + all.more;
    last->waiting += piece.waiting + all.waiting;
}

/* ---- batches ---- */

/* Some of the cells, and their own bricks are passed. */
static void draw_batch(const struct points_scene *s, uint32_t before,
                       uint32_t from, uint32_t one_of, struct batch *b) {
    uint32_t cells = s->x.cells - INCODE_COMPLEX_CELLS_FIRST;
    uint32_t first = below(cells);
    memset(b, 0, sizeof *b);
    b->pass_first = before;
    b->pass_last = from;
    for (uint32_t k = 0; k < cells && b->count < INCODE_LOOK_CELLS; k++) {
        uint32_t i = INCODE_COMPLEX_CELLS_FIRST + (first + k) % cells;
        if (!incode_cell_is_free(incode_complex_cell(&s->x, i)) &&
            below(one_of) == 0)
            b->cell[b->count++] = i;
    }
}

/* Of the bricks before the own ones, or of all. */
static void pass_some(const struct points_scene *s, struct batch *b,
                      uint32_t first, uint32_t last, uint32_t one_of) {
    for (uint32_t brick = first; brick < last; brick++)
        if (below(one_of) == 0)
            put(&b->passed, brick);
    assert_true(last <= s->set.order.bricks);
}

/* All are passed that come before the own ones, or some of any; or these are
 * the first. */
static void look_at_some(struct points_scene *s, uint32_t before, uint32_t from,
                         bool in_order) {
    struct batch b;
    struct told one = {0}, every = {0}, last = {0};
    draw_batch(s, before, from, 20, &b);
    if (in_order)
        pass_some(s, &b, 0, before, 1);
    else if (below(2) == 0)
        pass_some(s, &b, 0, s->set.order.bricks, 3);
    check_batch(s, &b, &one, &every);
    if (from == s->set.order.bricks && in_order)
        assert_int_equal(one.reached, 0);
    check_pieces(s, &b, 1 + below(INCODE_LOOK_CELLS), 2 + below(3), &one,
                 &every, &last);
    points_forget(s, UINT32_MAX, QUEUE);
}

static void no_cell_that_reaches_is_let_go(making *make, int exponent,
                                           double far) {
    points_open(&scene, make, exponent, far, POINTS);
    for (int in_order = 0; in_order < 2; in_order++) {
        memset(&counts, 0, sizeof counts);
        for (uint32_t from = 1; from <= scene.set.order.bricks;
             from += points_step(exponent)) {
            uint32_t before = below(2) == 0 ? 0 : below(from);
            if (points_build(&scene, before, from))
                look_at_some(&scene, before, from, in_order != 0);
        }
        assert_true(counts.reached + counts.free > 0);
    }
    points_close(&scene);
    /* Volumes and surfaces let most go. */
    if (exponent == 0 && (make == volume || make == whole_numbers))
        assert_true(counts.final > counts.free * 6 / 10 &&
                    counts.sought < counts.held + counts.held / 10);
    if (exponent == 0 && make == terrain)
        assert_true(counts.final > counts.free * 4 / 10);
    if (exponent == 0 && (make == terrain || make == plane || make == sphere))
        assert_true(counts.lifted > 0);
}

TEST(kinds_and_scales) {
    points_of_all_kinds(no_cell_that_reaches_is_let_go);
}

TEST(squares_that_underflow) {
    points_that_underflow(no_cell_that_reaches_is_let_go);
}

/* ---- many levels ---- */

/* Some pages of boxes have no brick that is not passed. */
static void through_many_levels(making *make, uint32_t frames) {
    struct told resumed = {0};
    memset(&counts, 0, sizeof counts);
    points_open(&scene, make, 0, 0, MANY);
    uint32_t bricks = scene.set.order.bricks;
    assert_int_equal(scene.maker.tree.levels, 4);
    assert_true(bricks <= BRICKS_MAX);
    for (int round = 0; round < (SANITIZED ? 4 : 12); round++) {
        struct batch b;
        struct told one = {0}, every = {0};
        uint32_t from = 1 + below(bricks), before = from - 1 - below(from);
        if (!points_build(&scene, before, from))
            continue;
        draw_batch(&scene, before, from, 1 + below(8), &b);
        if (round % 2 > 0)
            pass_some(&scene, &b, 0, before, 1);
        if (round % 3 > 0)
            pass_some(&scene, &b, from, bricks, 8);
        check_batch(&scene, &b, &one, &every);
        check_pieces(&scene, &b, round % 3 > 0 ? INCODE_LOOK_CELLS : 23, frames,
                     &one, &every, &resumed);
        points_forget(&scene, UINT32_MAX, QUEUE);
    }
    points_close(&scene);
    assert_true(resumed.waiting > 0);
    assert_true(counts.reached > 0);
    /* The same as above. */
    assert_true(counts.final > counts.free * (make == volume ? 6 : 4) / 10);
}

TEST(volumes_of_many_levels) {
    through_many_levels(volume, 3);
}

TEST(surfaces_of_many_levels) {
    through_many_levels(terrain, 5);
}

/* Some of the infinite cells, from all over. */
static void draw_infinite(const struct points_scene *s, struct batch *b) {
    uint32_t all = 0, seen = 0;
    memset(b, 0, sizeof *b);
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < s->x.cells; i++) {
            const struct incode_cell *c = incode_complex_cell(&s->x, i);
            if (incode_cell_is_free(c) || !incode_cell_is_infinite(c))
                continue;
            if (pass == 0)
                all++;
            else if (seen++ % (1 + all / INCODE_LOOK_CELLS) == 0)
                b->cell[b->count++] = i;
        }
}

/* Half-spaces that hold nearly all points: whatever pages are there, one call
 * does not look at all that are needed. */
TEST(more_than_a_call_looks_at) {
    points_open(&scene, sphere, 0, 0, MANY);
    uint32_t bricks = scene.set.order.bricks;
    assert_true(bricks <= BRICKS_MAX);
    for (uint32_t from = BUILT; from < bricks; from += bricks / 3) {
        struct told one = {0}, every = {0}, warm = {0}, resumed = {0};
        struct batch b;
        assert_true(points_build(&scene, 0, from));
        draw_infinite(&scene, &b);
        b.pass_first = from - BUILT;
        b.pass_last = from;
        check_batch(&scene, &b, &one, &every);
        /* Now all pages are there. */
        look_at(&scene, &b, true, 0, b.count, &warm);
        assert_true(warm.waiting == 0 && warm.more > 0);
        assert_true(count(&warm.wanted) > bricks / 2);
        assert_memory_equal(&warm.wanted, &every.wanted, sizeof warm.wanted);
        check_pieces(&scene, &b, INCODE_LOOK_CELLS, 4, &one, &every, &resumed);
        assert_true(resumed.waiting > bricks / INCODE_FANOUT);
        points_forget(&scene, UINT32_MAX, QUEUE);
    }
    points_close(&scene);
}

/* ---- what is asked of it ---- */

/* Bricks that are wanted stay so; they need no look where all are asked for,
 * and one where cells are told. */
TEST(what_was_wanted_before) {
    struct batch b;
    uint32_t again = 0;
    points_open(&scene, volume, 0, 0, POINTS);
    uint32_t bricks = scene.set.order.bricks;
    for (uint32_t from = 1; from < bricks; from++) {
        struct told one = {0}, every = {0}, told = {0}, full = {0};
        if (!points_build(&scene, 0, from))
            continue;
        draw_batch(&scene, 0, from, 4, &b);
        check_batch(&scene, &b, &one, &every);
        for (uint32_t brick = 0; brick < bricks; brick++)
            put(&full.wanted, brick);
        told.wanted = full.wanted;
        look_at(&scene, &b, true, 0, b.count, &told);
        assert_memory_equal(&told.wanted, &full.wanted, sizeof told.wanted);
        look_at(&scene, &b, false, 0, b.count, &told);
        assert_memory_equal(&told.wanted, &full.wanted, sizeof told.wanted);
        assert_int_equal(told.reached, one.reached);
        again += told.reached != 0;
    }
    points_close(&scene);
    assert_true(again > 0);
}

/* Nothing is wanted of no cells, nor where all is passed, either way. */
TEST(nothing_to_look_at) {
    struct batch b;
    struct told told = {0};
    points_open(&scene, volume, 0, 0, POINTS);
    uint32_t bricks = scene.set.order.bricks;
    assert_true(points_build(&scene, 0, BUILT));
    for (int way = 0; way < 6; way++) {
        draw_batch(&scene, 0, way < 2 ? 0 : bricks, 1, &b);
        if (way >= 4) {
            b.pass_first = b.pass_last = way < 5 ? 0 : bricks;
            pass_some(&scene, &b, 0, bricks, 1);
        }
        assert_int_equal(b.count, INCODE_LOOK_CELLS);
        look_at(&scene, &b, way % 2 == 0, 0, way < 2 ? 0 : b.count, &told);
        assert_int_equal(told.reached, 0);
        assert_int_equal(count(&told.wanted), 0);
    }
    points_close(&scene);
}
