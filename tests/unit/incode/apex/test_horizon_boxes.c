/* A horizon's outcomes where pages are missing or boxes too many, its copies,
 * and that few boxes are reached where the points are flat. */
#include "tests/unit/incode/apex/horizon_scene.h"

/* ---- outcomes ---- */

/* All points but the vertex, or those on one side of its plane. */
static void half_space(const struct scene *s, uint32_t v, const double m[3],
                       struct incode_horizon_cap *cap) {
    double pv[3];
    host_vertex(&s->order, v, pv);
    assert_true(incode_horizon_cap(s->h, cap, pv, s->h->scale, m, 0, m));
}

TEST(a_missing_page_is_named) {
    struct scene s;
    uint32_t missing = 0, waits = 0, brick;
    struct incode_horizon_cap cap;
    open_scene(&s, terrain, 20000);
    brick = s.order.bricks / 2;
    while (try_horizon(&s, brick, 0.5, &missing) == INCODE_WAITING) {
        assert_true(missing >= s.order.bricks);
        assert_true(missing < s.order.tree.pages);
        assert_true(waits > 0 || missing == s.order.tree.pages - 1);
        assert_int_equal(s.h->count, 0);
        assert_int_equal(s.h->centre, INCODE_NONE);
        assert_false(incode_horizon_holds(s.h, s.lo, s.hi));
        deliver(&s);
        assert_true(waits++ < s.order.tree.pages);
    }
    assert_true(waits > 1);
    assert_int_equal(s.h->centre, brick);
    assert_true(incode_horizon_holds(s.h, s.lo, s.hi));

    const double up[3] = {0.1, 0.2, 1};
    const done_boxes none = {0};
    half_space(&s, draw_vertex(&s, brick), up, &cap);
    struct reached r;
    uint32_t i = 0, count = s.h->count;
    r.count = incode_horizon_reached(s.h, &cap, none, r.index);
    while (i < r.count && s.h->level[r.index[i]] == 0)
        i++;
    assert_true(i < r.count);
    uint32_t at = r.index[i], left = s.h->left[at];
    forget_pages(&s);
    assert_int_equal(incode_horizon_split(s.h, &s.walker, at, &cap, &missing),
                     INCODE_WAITING);
    assert_int_equal(missing, s.h->page[at]);
    assert_true(s.h->count == count && s.h->left[at] == left);
    deliver(&s);
    /* Once it is looked into, the same cap finds nothing new there. */
    for (int k = 0; k < 2; k++) {
        assert_int_equal(
            incode_horizon_split(s.h, &s.walker, at, &cap, &missing),
            INCODE_FINISHED);
        assert_true(s.h->count > count && s.h->left[at] != left);
        assert_int_equal(s.h->count - count,
                         __builtin_popcount(left & ~s.h->left[at]));
        count = k == 0 ? count : s.h->count;
    }
    close_scene(&s);
}

TEST(too_many_bricks_are_told) {
    struct scene s;
    uint32_t missing, brick = 7;
    open_scene(&s, volume, 30000);
    for (uint32_t p = 0; p < s.order.tree.pages; p++)
        (void)frame_of(&s, p);
    assert_int_equal(try_horizon(&s, brick, 1e3, &missing), INCODE_FULL);
    assert_int_equal(s.h->count, 0);
    assert_int_equal(s.h->centre, brick); /* it need not be tried again */
    assert_false(incode_horizon_holds(s.h, s.lo, s.hi));
    close_scene(&s);
}

/* What is done is not reached, and all else is. */
TEST(what_is_done_is_left_out) {
    struct scene s;
    const double up[3] = {0.1, 0.2, 1};
    struct incode_horizon_cap cap;
    open_scene(&s, terrain, 9000);
    make_horizon(&s, s.order.bricks / 2, 2);
    half_space(&s, draw_vertex(&s, s.h->centre), up, &cap);
    assert_true(split_all(&s, &cap));
    for (int k = 0; k < 20; k++) {
        done_boxes none = {0}, done = {0};
        struct reached all, rest;
        uint32_t kept = 0;
        for (size_t i = 0; i < sizeof done / sizeof *done; i++)
            for (unsigned bit = 0; bit < 64; bit++)
                done[i] |= (uint64_t)(below(3) == 0) << bit;
        all.count = incode_horizon_reached(s.h, &cap, none, all.index);
        rest.count = incode_horizon_reached(s.h, &cap, done, rest.index);
        for (uint32_t i = 0; i < all.count; i++) {
            uint32_t at = all.index[i];
            if ((done[at / 64] >> (at % 64) & 1) == 0)
                assert_true(kept < rest.count && rest.index[kept++] == at);
        }
        assert_int_equal(kept, rest.count);
        assert_true(kept > 0 && kept < all.count);
    }
    close_scene(&s);
}

/* ---- copies ---- */

/* As many copies as there is room for, no two the same. */
static void check_copies(const struct incode_horizon *h) {
    bool taken[COPIES] = {false};
    for (uint32_t i = 0; i < h->count; i++) {
        uint32_t copy = h->copy[i];
        if (copy == INCODE_NO_COPY)
            continue;
        assert_true(copy < h->room && !taken[copy]);
        taken[copy] = true;
    }
}

TEST(copies_give_way) {
    struct scene s;
    const double up[3] = {0.1, 0.2, 1}, down[3] = {-0.1, -0.2, -1};
    struct incode_horizon_cap cap;
    open_scene(&s, terrain, 40000);
    make_horizon(&s, s.order.bricks / 2, 2);
    uint32_t v = draw_vertex(&s, s.h->centre);
    half_space(&s, v, up, &cap);
    (void)split_all(&s, &cap);
    half_space(&s, v, down, &cap);
    (void)split_all(&s, &cap);
    assert_true(s.h->count > COPIES + 1);
    uint64_t *in = malloc(s.order.bricks * sizeof *in);
    assert_non_null(in);
    struct ball q = {.scale = s.h->scale, .det = 1};
    host_vertex(&s.order, v, q.v);
    for (s.h->room = COPIES / 2; s.h->room <= COPIES; s.h->room += 5) {
        for (uint32_t k = 0; k < 3 * s.h->count; k++) {
            uint32_t at = below(2) == 0 ? below(s.h->count) : k % s.h->count;
            for (int d = 0; d < 3; d++)
                q.m[d] = q.n[d] = even() * 0x1p5;
            if (s.h->level[at] != 0 ||
                !incode_horizon_cap(s.h, &cap, q.v, q.scale, q.m, q.det, q.n))
                continue;
            uint32_t b = s.h->page[at];
            in[b] = points_of_ball(&s, &q, b);
            assert_true((in[b] & ~bits_of(&s, at, &cap)) == 0);
            check_copies(s.h);
        }
        s.h->next = 0;
    }
    free(in);
    close_scene(&s);
}

/* ---- by a box ---- */

TEST(a_box_misses_no_leaf) {
    static making *const sets[] = {volume, tiny_cluster, large, denormal};
    for (size_t k = 0; k < sizeof sets / sizeof *sets; k++) {
        struct scene s;
        open_scene(&s, sets[k], 5000);
        for (int tries = 0; tries < 20; tries++) {
            struct seen seen = {{0}};
            struct incode_query q = {.question = INCODE_QUERY_BOX,
                                     .boxed = true};
            make_horizon(&s, below(s.order.bricks), draw());
            for (int d = 0; d < 3; d++) {
                double a = draw(), b = draw(), lo = s.lo[d], hi = s.hi[d];
                q.lo[d] = lo * fmax(a, b) + hi * (1 - fmax(a, b));
                q.hi[d] = lo * fmin(a, b) + hi * (1 - fmin(a, b));
            }
            assert_true(incode_horizon_holds(s.h, q.lo, q.hi));
            while (incode_horizon_box(s.h, &s.walker, &q, see, &seen) ==
                   INCODE_WAITING)
                deliver(&s);
            for (uint32_t v = 0; v < s.order.bricks * INCODE_BRICK_POINTS;
                 v++) {
                uint32_t b = v / INCODE_BRICK_POINTS, slot = v % 64;
                double p[3];
                bool in = slot < s.order.fill[b];
                host_vertex(&s.order, v, p);
                for (int d = 0; d < 3; d++)
                    in = in && p[d] >= q.lo[d] && p[d] <= q.hi[d];
                assert_true(!in || (seen.in[b] >> slot & 1) != 0);
            }
        }
        close_scene(&s);
    }
}

/* ---- few boxes are reached ---- */

/* Bricks that the ball of some radius reaches which touches the unit sphere at
 * a vertex, from within (side 1) or from without (-1); on average. */
static double touched(struct scene *s, double radius, double side) {
    uint32_t tries = 60, bricks = 0;
    for (uint32_t i = 0; i < tries; i++) {
        struct incode_horizon_cap cap;
        struct reached r;
        const done_boxes none = {0};
        double p[3], m[3], n[3];
        make_horizon(s, below(s->order.bricks), 0.5);
        host_vertex(&s->order, draw_vertex(s, s->h->centre), p);
        for (int d = 0; d < 3; d++) {
            n[d] = -side * p[d];
            m[d] = 2 * radius * s->h->scale * n[d];
        }
        assert_true(incode_horizon_cap(s->h, &cap, p, s->h->scale, m, 1, n));
        assert_true(split_all(s, &cap));
        r.count = incode_horizon_reached(s->h, &cap, none, r.index);
        for (uint32_t k = 0; k < r.count; k++)
            bricks += s->h->level[r.index[k]] == 0;
    }
    return (double)bricks / tries;
}

TEST(a_cap_beside_a_surface_reaches_little) {
    static const struct {
        double radius, side, most; /* twice what was counted */
    } balls[] = {{0.01, 1, 2.1}, {0.5, 1, 11},   {0.9, 1, 15},    {0.98, 1, 17},
                 {0.5, -1, 6.1}, {10, -1, 10.4}, {1000, -1, 10.3}};
    struct scene s;
    open_scene(&s, sphere, 4096);
    for (size_t i = 0; i < sizeof balls / sizeof *balls; i++) {
        double bricks = touched(&s, balls[i].radius, balls[i].side);
        assert_true(bricks >= 1 && bricks <= balls[i].most);
    }
    close_scene(&s);
}
