/* What the tests of points to come share: sets of many kinds and scales in
 * pages that are delivered as slowly as wanted, a complex of some of their
 * bricks, and which bricks a cell's sphere holds a point of, by exact
 * predicates.
 *
 * Memory: the set, its pages, and 4 MB for the complex. */
#ifndef TESTS_UNIT_POINTS_SCENE_H
#define TESTS_UNIT_POINTS_SCENE_H

#include "tests/unit/incode/apex/horizon_scene.h"

#include "incode/complex/complex.h"
#include "incode/apex/maker.h"
#include "tests/unit/emulated.h"

enum { POINTS = 1300, POINTS_BYTES = 4 << 20, BUILT = 3 /* bricks */ };

struct points_scene {
    struct scene set;
    struct incode_maker maker; /* its tree, pager and box alone */
    uint32_t page[QUEUE], pages;
    uint32_t limit; /* pages asked for at a time, at most */
    struct incode_complex x;
    struct incode_tally tally;
    void *memory; /* the complex's */
};

/* ---- pages ---- */

static inline bool points_request(void *context, uint32_t page) {
    struct points_scene *s = context;
    if (s->pages == s->limit)
        return false;
    s->page[s->pages++] = page;
    return true;
}

static inline void points_deliver(struct points_scene *s) {
    uint8_t page[INCODE_PAGE_BYTES];
    assert_true(s->pages > 0);
    while (s->pages > 0) {
        uint32_t number = s->page[--s->pages];
        size_t bytes = host_page(&s->set.order, number, page);
        assert_int_equal(
            incode_pager_deliver(&s->maker.pager, number, page, bytes), 0);
    }
}

/* No page is there. */
static inline void points_forget(struct points_scene *s, uint32_t frames,
                                 uint32_t limit) {
    uint32_t all = s->set.order.tree.pages;
    const struct incode_page_source source = {s, points_request};
    incode_pager_init(&s->maker.pager, s->set.frames,
                      frames < all ? frames : all, s->set.order.bricks,
                      &s->maker.counts.tally.yield);
    s->maker.pager.source = source;
    s->pages = 0;
    s->limit = limit;
}

/* ---- sets ---- */

static making *points_kind;
static double points_scale, points_off;

static inline void points_scaled(double p[3]) {
    points_kind(p);
    for (int d = 0; d < 3; d++)
        p[d] = (p[d] + points_off) * points_scale;
}

static inline void whole_numbers(double p[3]) {
    for (int d = 0; d < 3; d++)
        p[d] = below(12);
}

/* Points of a kind, times a power of two and as far off: the same whatever was
 * drawn before. */
static inline void points_open(struct points_scene *s, making *make,
                               int exponent, double far, uint32_t n) {
    memset(s, 0, sizeof *s);
    state = 1;
    points_kind = make;
    points_scale = ldexp(1, exponent);
    points_off = far;
    open_scene(&s->set, points_scaled, n);
    s->maker.tree = s->set.order.tree;
    memcpy(s->maker.lo, s->set.order.lo, sizeof s->maker.lo);
    memcpy(s->maker.hi, s->set.order.hi, sizeof s->maker.hi);
    points_forget(s, UINT32_MAX, QUEUE);
    s->memory = aligned(POINTS_BYTES);
    incode_complex_init(&s->x, s->memory, POINTS_BYTES);
}

static inline void points_close(struct points_scene *s) {
    free(s->memory);
    close_scene(&s->set);
}

/* Each kind at each scale. */
typedef void points_of_kind(making *make, int exponent, double far);

static inline void points_of_all_kinds(points_of_kind *check) {
    static making *const kinds[] = {
        volume,       plane,       sphere,        cylinder,   terrain,
        tiny_cluster, uneven_axes, whole_numbers, all_scales, far_plane};
    static const int exponents[] = {0,    -200, 200,  -470, 470,
                                    -536, 536,  -900, 900};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        for (size_t e = 0; e < sizeof exponents / sizeof *exponents; e++)
            if (kinds[k] != all_scales || e == 0)
                check(kinds[k], exponents[e], e % 2 ? 0x1p40 : 0);
}

/* Where squares of coordinates lose digits, or all of them; and where products
 * with a facet's normal overflow. */
static inline void points_that_underflow(points_of_kind *check) {
    for (int e = 509; e < 541; e += SANITIZED ? 9 : 3)
        for (int sign = -1; sign < 2; sign += 2)
            check(e % 2 ? volume : cylinder, sign * e, 0);
}

/* By how many bricks to go on: more where the test has the sanitizers in it,
 * but for sets that are not scaled, of which more is claimed. */
static inline uint32_t points_step(int exponent) {
    return 1 + below(SANITIZED && exponent != 0 ? 20 : 5);
}

/* ---- the complex ---- */

/* The last of the bricks [before, from); false: they do not span space. */
static inline bool points_build(struct points_scene *s, uint32_t before,
                                uint32_t from) {
    struct incode_complex *x = &s->x;
    const struct incode_complex_point *q = x->point;
    uint32_t four[4] = {1, 2, 0, 0};
    before = from - before > BUILT ? from - BUILT : before;
    incode_complex_clear(x);
    for (uint32_t b = before; b < from; b++)
        for (uint32_t i = 0; i < s->set.order.fill[b]; i++) {
            double p[3];
            uint32_t id = b * INCODE_BRICK_POINTS + i;
            host_vertex(&s->set.order, id, p);
            assert_int_not_equal(incode_complex_add(x, p, id), INCODE_NONE);
        }
    for (uint32_t v = 3; v < x->points && four[2] == 0; v++)
        if (!incode_collinear(q[1].p, q[2].p, q[v].p))
            four[2] = v;
    for (uint32_t v = 3; v < x->points && four[2] != 0 && four[3] == 0; v++)
        if (incode_orient3d(&s->tally, q[1].p, q[2].p, q[four[2]].p, q[v].p) !=
            0)
            four[3] = v;
    if (four[3] == 0 || !incode_complex_begin(x, &s->tally, four))
        return false;
    for (uint32_t v = 1; v < x->points; v++)
        if (!incode_complex_is_vertex(x, v))
            assert_true(incode_complex_insert(x, &s->tally, v, 1));
    return true;
}

/* ---- what is reached ---- */

/* Whether a point is in the cell's sphere, or beyond its facet or in its plane.
 */
static inline bool points_holds(struct points_scene *s, uint32_t cell,
                                const double p[3]) {
    const struct incode_cell *c = incode_complex_cell(&s->x, cell);
    const double *q[4];
    unsigned k = incode_cell_index(c, INCODE_COMPLEX_INFINITE);
    for (unsigned i = 0; i < 4; i++)
        q[i] = i == k ? p : s->x.point[c->v[i]].p;
    if (k < 4)
        return incode_orient3d(&s->tally, q[0], q[1], q[2], q[3]) >= 0;
    return incode_in_sphere(&s->tally, q[0], q[1], q[2], q[3], p) > 0;
}

/* Whether one of a brick is. */
static inline bool points_touch(struct points_scene *s, uint32_t cell,
                                uint32_t brick) {
    for (uint32_t i = 0; i < s->set.order.fill[brick]; i++) {
        double p[3];
        host_vertex(&s->set.order, brick * INCODE_BRICK_POINTS + i, p);
        if (points_holds(s, cell, p))
            return true;
    }
    return false;
}

#endif
