/* Which cells are final: none whose sphere holds a point of the rest, or whose
 * facet's plane does, by exact predicates, for any brick as the first of the
 * rest, at any scale; and of the others most. */
#include "tests/unit/incode/maker/horizon_scene.h"

#include "incode/complex/complex.h"
#include "incode/points/rest.h"
#include "tests/unit/emulated.h"

enum { POINTS = 1300 };

static struct incode_maker maker;
static struct incode_rest rest;

/* Of cells of points before a brick: those whose spheres hold one of the rest,
 * the others, and which of these are told, by some boxes, by all. */
struct counts {
    uint64_t reached, free, final[2];
};

/* Whether a point is in the cell's sphere, or beyond its facet or in its plane.
 */
static bool touches(struct incode_tally *tally, const struct incode_complex *x,
                    const struct incode_cell *c, const double p[3])
{
    const double *q[4];
    unsigned k = incode_cell_index(c, INCODE_COMPLEX_INFINITE);
    for (unsigned i = 0; i < 4; i++)
        q[i] = i == k ? p : x->point[c->v[i]].p;
    if (k < 4)
        return incode_orient3d(tally, q[0], q[1], q[2], q[3]) >= 0;
    return incode_in_sphere(tally, q[0], q[1], q[2], q[3], p) > 0;
}

static bool rest_touches(struct scene *s, const struct incode_complex *x,
                         const struct incode_cell *c, uint32_t brick)
{
    for (uint32_t b = brick; b < s->order.bricks; b++)
        for (uint32_t i = 0; i < s->order.fill[b]; i++) {
            double p[3];
            host_vertex(&s->order, b * INCODE_BRICK_POINTS + i, p);
            if (touches(&s->tally, x, c, p))
                return true;
        }
    return false;
}

static bool looks(struct scene *s, const struct incode_complex *x,
                  const struct incode_cell *c)
{
    bool reached = incode_rest_looks(&rest, x, c);
    while (s->pages > 0) {
        deliver(s);
        reached = incode_rest_looks(&rest, x, c);
    }
    return reached;
}

/* Some of the points before the brick, the last ones, as a complex. */
static bool build(struct scene *s, struct incode_complex *x, uint32_t brick)
{
    uint32_t first = brick > 3 ? brick - 3 : 0, four[4] = {1, 2, 0, 0};
    const struct incode_complex_point *q = x->point;
    incode_complex_clear(x);
    for (uint32_t b = first; b < brick; b++)
        for (uint32_t i = 0; i < s->order.fill[b]; i++) {
            double p[3];
            uint32_t id = b * INCODE_BRICK_POINTS + i;
            host_vertex(&s->order, id, p);
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

static void check(struct scene *s, struct incode_complex *x, uint32_t brick,
                  struct counts *counts)
{
    while (!incode_rest_set(&rest, &maker, brick))
        deliver(s);
    incode_complex_tell_free(x);
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < x->cells; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        if (incode_cell_is_free(c) || below(20) != 0)
            continue;
        bool boxes = incode_rest_reaches(&rest, x, c);
        bool closely = looks(s, x, c);
        if (brick == s->order.bricks)
            assert_false(boxes || closely);
        if (rest_touches(s, x, c, brick)) {
            if (!boxes || !closely)
                fail_msg("brick %u, cell %u: final by %s", brick, i,
                         boxes ? "a close look" : "boxes");
            counts->reached++;
        } else {
            counts->free++;
            counts->final[0] += !boxes;
            counts->final[1] += !closely;
        }
    }
}

/* Points of a kind, times a power of two and as far off. */
static making *kind;
static double scale, off;

static void scaled(double p[3])
{
    kind(p);
    for (int d = 0; d < 3; d++)
        p[d] = (p[d] + off) * scale;
}

static void no_cell_that_is_reached_is_final(making *make, int exponent,
                                             double far, struct counts *counts)
{
    struct scene s;
    struct incode_complex x;
    enum { BYTES = 4 << 20 };
    void *memory = aligned(BYTES);
    kind = make;
    scale = ldexp(1, exponent);
    off = far;
    memset(counts, 0, sizeof *counts);
    open_scene(&s, scaled, POINTS);
    memset(&maker, 0, sizeof maker);
    maker.pager = s.pager;
    maker.tree = s.order.tree;
    memcpy(maker.lo, s.order.lo, sizeof maker.lo);
    memcpy(maker.hi, s.order.hi, sizeof maker.hi);
    incode_complex_init(&x, memory, BYTES);
    for (uint32_t brick = 1; brick <= s.order.bricks;
         brick += 1 + below(SANITIZED ? 20 : 5))
        if (build(&s, &x, brick))
            check(&s, &x, brick, counts);
    free(memory);
    close_scene(&s);
}

static void whole_numbers(double p[3])
{
    for (int d = 0; d < 3; d++)
        p[d] = below(12);
}

static void kinds_and_scales(void **unused)
{
    static making *const kinds[] = {
        volume,       plane,       sphere,        cylinder,   terrain,
        tiny_cluster, uneven_axes, whole_numbers, all_scales, far_plane};
    static const int exponents[] = {0,    -200, 200,  -470, 470,
                                    -536, 536,  -900, 900};
    struct counts counts;
    (void)unused;
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        for (size_t e = 0; e < sizeof exponents / sizeof *exponents; e++) {
            if (kinds[k] == all_scales && e > 0)
                continue;
            no_cell_that_is_reached_is_final(kinds[k], exponents[e],
                                             e % 2 ? 0x1p40 : 0, &counts);
            assert_true(counts.reached + counts.free > 0);
            /* Volumes and surfaces let most go. */
            if (e == 0 && (kinds[k] == volume || kinds[k] == whole_numbers))
                assert_true(counts.final[1] > counts.free * 6 / 10);
            if (e == 0 && kinds[k] == terrain)
                assert_true(counts.final[1] > counts.free * 4 / 10);
        }
}

/* Where squares of coordinates lose digits, or all of them; and where products
 * with a facet's normal overflow. */
static void squares_that_underflow(void **unused)
{
    struct counts counts;
    (void)unused;
    for (int e = 509; e < 541; e += SANITIZED ? 9 : 3)
        for (int sign = -1; sign < 2; sign += 2)
            no_cell_that_is_reached_is_final(e % 2 ? volume : cylinder,
                                             sign * e, 0, &counts);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kinds_and_scales),
        cmocka_unit_test(squares_that_underflow),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
