/* The judge of single tetrahedra and facets against trying all points: on true
 * tetrahedra, on false ones, on facets of the hull and at random, with ties,
 * and where coordinates leave the range of products. */
#include <math.h>

#include "host/verify/judge.h"
#include "tests/unit/host/verify/check_world.h"

static bool inside(const struct fixture *f, const uint32_t t[4], uint32_t v) {
    struct incode_tally tally = {0};
    double p[5][3];
    for (int k = 0; k < 4; k++)
        host_site(&f->sites, t[k], p[k]);
    host_site(&f->sites, v, p[4]);
    return incode_in_sphere(&tally, p[0], p[1], p[2], p[3], p[4]) > 0;
}

static bool is_delaunay(const struct fixture *f, const uint32_t t[4]) {
    for (uint32_t v = 0; v < f->sites.count; v++)
        if (host_site_is_vertex(&f->sites, v) && !is_one_of(t, 4, v) &&
            inside(f, t, v))
            return false;
    return true;
}

static uint32_t apex_of(const struct fixture *f, const uint32_t facet[3]) {
    uint32_t t[4] = {facet[0], facet[1], facet[2], INCODE_NONE};
    for (uint32_t v = 0; v < f->sites.count; v++) {
        const uint32_t u[4] = {facet[0], facet[1], facet[2], v};
        if (host_site_is_vertex(&f->sites, v) && !is_one_of(t, 4, v) &&
            orientation(f, u) > 0 && (t[3] == INCODE_NONE || inside(f, t, v)))
            t[3] = v;
    }
    return t[3];
}

static void facet_is_judged(const struct fixture *f,
                            const struct host_judge *judge,
                            const uint32_t facet[3]) {
    uint32_t apex = apex_of(f, facet);
    assert_int_equal(host_judge_apex(judge, facet), apex);
    assert_int_equal(host_judge_beyond(judge, facet), apex != INCODE_NONE);
}

static void tetrahedron_is_judged(struct fixture *f,
                                  const struct host_judge *judge,
                                  const uint32_t t[4]) {
    const uint32_t turned[4] = {t[0], t[1], t[3], t[2]};
    assert_true(host_judge_tetrahedron(judge, t));
    assert_false(host_judge_tetrahedron(judge, turned));
    for (uint32_t c = 0; c < 4; c++) {
        uint32_t p[3], apex;
        host_facet_outward(t, c, p);
        const uint32_t inward[3] = {p[0], p[2], p[1]};
        assert_int_equal(host_judge_apex(judge, inward), t[c]);
        facet_is_judged(f, judge, p);
        apex = host_judge_apex(judge, p);
        if (apex != INCODE_NONE) { /* the neighbour's, across the facet */
            const uint32_t wrong[4] = {t[0], t[1], t[2], apex};
            if (c < 3 && orientation(f, wrong) > 0) {
                assert_int_equal(host_judge_tetrahedron(judge, wrong),
                                 is_delaunay(f, wrong));
            }
        }
    }
}

static void random_ones_are_judged(struct fixture *f,
                                   const struct host_judge *judge) {
    for (int i = 0; i < 300; i++) {
        uint32_t t[4];
        for (int k = 0; k < 4; k++) {
            do {
                t[k] = (uint32_t)draw(f, f->sites.count);
            } while (!host_site_is_vertex(&f->sites, t[k]) ||
                     is_one_of(t, k, t[k]));
        }
        facet_is_judged(f, judge, t);
        bool right = orientation(f, t) > 0 && is_delaunay(f, t);
        assert_int_equal(host_judge_tetrahedron(judge, t), right);
    }
}

static void judge_all(struct fixture *f, uint64_t most) {
    struct host_judge judge;
    struct host_error error = {0};
    assert_int_equal(host_judge_make(&judge, &f->sites, &error), 0);
    for (uint64_t i = 0; i < f->tets.count && i < most; i++)
        tetrahedron_is_judged(f, &judge, f->tets.v[i]);
    random_ones_are_judged(f, &judge);
    host_judge_free(&judge);
}

TEST(judged_as_by_trying_all) {
    for (size_t i = 0; i < sizeof sets / sizeof *sets; i++) {
        struct fixture f;
        open_set(&f, sets[i].kind, sets[i].n, i + 1);
        judge_all(&f, 300);
        close_set(&f);
    }
}

/* Lattices whose steps no double has: points at, or a rounding beside, spheres
 * and the corners of boxes. */
TEST(judged_on_lattices) {
    static const double parts[][3] = {{10, 10, 10}, {3, 7, 11}};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        enum { SIDE = 8, POINTS = SIDE * SIDE * SIDE };
        struct fixture f;
        double xyz[3 * POINTS];
        for (int k = 0; k < POINTS; k++) {
            const int cell[3] = {k % SIDE, k / SIDE % SIDE, k / SIDE / SIDE};
            for (int d = 0; d < 3; d++)
                xyz[3 * k + d] = cell[d] / parts[i][d];
        }
        open_points(&f, xyz, POINTS);
        judge_all(&f, UINT64_MAX);
        close_set(&f);
    }
}

/* Axes far apart in size; products that overflow, and such that vanish. */
TEST(judged_at_the_ends_of_the_range) {
    static const int powers[][3] = {
        {400, 400, 400}, {-400, -400, -400}, {1000, 0, -1000}, {0, 0, -1060}};
    for (size_t i = 0; i < sizeof powers / sizeof *powers; i++) {
        struct fixture f;
        struct host_points points = {0};
        struct host_error error = {0};
        assert_int_equal(host_gen("uniform", 90, 3, &points, &error), 0);
        for (uint64_t k = 0; k < 270; k++)
            points.xyz[k] = scalbn(points.xyz[k] - 0.5, powers[i][k % 3]);
        open_points(&f, points.xyz, 90);
        host_points_free(&points);
        judge_all(&f, 100);
        close_set(&f);
    }
}

/* Groups of bricks, most of which need no look: the boxes decide rightly. */
TEST(judged_among_many) {
    struct host_judge judge;
    struct host_error error = {0};
    struct fixture f = {.state = 7};
    assert_int_equal(host_gen("bubbles", 12000, 5, &f.points, &error), 0);
    assert_int_equal(host_order_make(&f.order, "points", f.points.xyz,
                                     f.points.count, HOST_ADAPTIVE, 2, false,
                                     &error),
                     0);
    f.sites = host_sites_of_order(&f.order);
    assert_int_equal(host_judge_make(&judge, &f.sites, &error), 0);
    assert_true(judge.groups > 2);
    uint32_t v = 0;
    for (int i = 0; i < 60; i++) {
        uint32_t t[4] = {v, v + 1, v + 2, INCODE_NONE};
        facet_is_judged(&f, &judge, t);
        t[3] = host_judge_apex(&judge, t);
        if (t[3] != INCODE_NONE) {
            assert_int_equal(host_judge_tetrahedron(&judge, t),
                             is_delaunay(&f, t));
        }
        v = (uint32_t)draw(&f, f.order.bricks / 2) * INCODE_BRICK_POINTS;
    }
    host_judge_free(&judge);
    host_points_free(&f.points);
    host_order_free(&f.order);
}
