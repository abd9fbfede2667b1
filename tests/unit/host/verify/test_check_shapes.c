/* Results that are whole and wrong: a tiling that is not Delaunay, one without
 * a point, a surface wound twice, two bodies in one place. */
#include <math.h>

#include "tests/unit/host/verify/check_world.h"

/* The triangulation of all points but one is a perfect one, and wrong. */
static void leave_out(struct fixture *f, const uint32_t vertex[120],
                      uint32_t row) {
    struct host_tetrahedra tets = {0};
    struct host_check_report r;
    uint32_t next = (row + 1) % 120, map[120];
    double xyz[360];
    memcpy(xyz, f->points.xyz, sizeof xyz);
    memcpy(xyz + 3 * row, f->points.xyz + 3 * next, 3 * sizeof *xyz);
    reference_delaunay(xyz, 120, &tets);
    memcpy(map, vertex, sizeof map);
    map[row < next ? row : next] = vertex[next]; /* stands for both */
    host_tetrahedra_map(&tets, map);
    host_tetrahedra_cut(&f->tets, 0);
    for (uint64_t i = 0; i < tets.count; i++)
        append(&f->tets, tets.v[i]);
    for (int depth = 0; depth < 2; depth++) {
        assert_int_equal(check(f, (enum host_check_depth)depth, &r),
                         HOST_UNVERIFIED);
        assert_non_null(strstr(r.text, "is a vertex of no tetrahedron"));
        assert_true(f->named[vertex[row]]);
    }
    host_tetrahedra_free(&tets);
}

TEST(a_left_out_point_is_found) {
    struct fixture f;
    uint32_t vertex[120] = {0};
    open_set(&f, "uniform", 120, 5);
    for (uint32_t v = 0; v < f.sites.count; v++)
        if (f.order.row[v] != INCODE_NONE)
            vertex[f.order.row[v]] = v;
    for (uint32_t row = 0; row < 120; row++)
        leave_out(&f, vertex, row);
    close_set(&f);
}

/* --- Tilings that are wrong ----------------------------------------------- */

/* Two tetrahedra on a facet to three about the edge of their apexes: false
 * where their union is not convex. */
static bool flip(struct fixture *f, uint64_t i, uint64_t j) {
    uint32_t(*v)[4] = f->tets.v;
    for (uint32_t c = 0; c < 4; c++) {
        uint32_t p[3], apex = INCODE_NONE, made[3][4];
        int shared = 0;
        host_facet_outward(v[i], c, p);
        for (int k = 0; k < 4; k++) {
            bool on = v[j][k] == p[0] || v[j][k] == p[1] || v[j][k] == p[2];
            shared += on;
            apex = on ? apex : v[j][k];
        }
        bool all = shared == 3;
        for (int k = 0; k < 3 && all; k++) {
            const uint32_t t[4] = {p[k], p[(k + 1) % 3], v[i][c], apex};
            memcpy(made[k], t, sizeof t);
            all = orientation(f, t) > 0;
        }
        if (all) {
            memcpy(v[i], made[0], sizeof made[0]);
            memcpy(v[j], made[1], sizeof made[1]);
            append(&f->tets, made[2]);
            return true;
        }
    }
    return false;
}

/* A flip leaves a tiling, which the one depth passes and the other does not;
 * both tetrahedra that are gone had the vertices that are named. */
static void flips(struct fixture *f) {
    for (uint64_t i = 0; i < f->tets.count && i < 60; i++) {
        for (uint64_t j = i + 1; j < f->tets.count; j++) {
            struct host_check_report r;
            uint32_t gone[4];
            memcpy(gone, f->tets.v[i], sizeof gone);
            if (!flip(f, i, j))
                continue;
            assert_int_equal(check(f, HOST_CHECK_TILING, &r), 0);
            assert_int_equal(check(f, HOST_CHECK_DELAUNAY, &r),
                             HOST_UNVERIFIED);
            assert_non_null(strstr(r.text, "are not Delaunay"));
            for (int k = 0; k < 4; k++)
                assert_true(f->named[gone[k]]);
            restore(f);
            break;
        }
    }
}

TEST(only_spheres_tell_a_flip) {
    for_each_set(flips);
}

/* Five points cut in both ways, besides all that is right: every new facet
 * belongs to two tetrahedra, both on one side. */
TEST(a_body_twice_is_found) {
    struct fixture f;
    int bodies = 0;
    open_set(&f, "uniform", 300, 8);
    for (int tries = 0; tries < 200000 && bodies <= 20; tries++) {
        struct host_check_report r;
        uint32_t p[5];
        for (int k = 0; k < 5; k++)
            p[k] = (uint32_t)draw(&f, f.sites.count);
        const uint32_t made[5][4] = {{p[0], p[1], p[2], p[3]},
                                     {p[0], p[2], p[1], p[4]},
                                     {p[0], p[1], p[4], p[3]},
                                     {p[1], p[2], p[4], p[3]},
                                     {p[2], p[0], p[4], p[3]}};
        bool all = true;
        for (int k = 0; k < 5; k++)
            all = all && is_row(&f, made[k]);
        if (all) {
            bodies++;
            for (int k = 0; k < 5; k++)
                append(&f.tets, made[k]);
            assert_int_equal(check(&f, HOST_CHECK_TILING, &r), HOST_UNVERIFIED);
            assert_non_null(strstr(r.text, "has both its tetrahedra on one "
                                           "side"));
            assert_true(f.named[p[0]]);
            restore(&f);
        }
    }
    assert_true(bodies > 20);
    close_set(&f);
}

/* A flat tetrahedron on a face of the cube, over two facets of the hull: all
 * facets fit, and the surface is as convex as it was. */
static bool cover(struct fixture *f, const uint32_t p[3]) {
    struct host_check_report r;
    for (uint32_t v = 0; v < f->sites.count; v++) {
        const uint32_t t[4] = {p[0], p[2], p[1], v};
        for (int k = 0; k < 3 && host_site_is_vertex(&f->sites, v) &&
                        orientation(f, t) == 0;
             k++) { /* the hull's other facet at edge k, from outside */
            const uint32_t q[3] = {p[(k + 1) % 3], p[k], v};
            if (!is_one_of(p, 3, v) && has_facet(f, q)) {
                append(&f->tets, t);
                assert_int_equal(check(f, HOST_CHECK_DELAUNAY, &r),
                                 HOST_UNVERIFIED);
                assert_int_equal(r.faults, 1);
                assert_non_null(strstr(r.text, "has no volume"));
                restore(f);
                return true;
            }
        }
    }
    return false;
}

TEST(flat_ones_are_found) {
    struct fixture f;
    int covered = 0;
    open_set(&f, "grid", 64, 1);
    for (uint64_t i = 0; i < f.right.count; i++) {
        for (uint32_t c = 0; c < 4; c++) {
            uint32_t p[3];
            host_facet_outward(f.right.v[i], c, p);
            const uint32_t other[3] = {p[0], p[2], p[1]};
            if (!has_facet(&f, other)) /* a facet of the hull */
                covered += cover(&f, p);
        }
    }
    assert_true(covered > 20);
    close_set(&f);
}

/* --- Surfaces ------------------------------------------------------------- */

/* Five tetrahedra about an axis, from each corner of a pentagon to the next but
 * one: positive, closed, of Euler characteristic 2 and convex at every edge,
 * but wound twice. */
TEST(a_surface_wound_twice_is_found) {
    static const double pi = 3.14159265358979323846;
    double xyz[21] = {0, 0, -1, 0, 0, 1};
    struct host_check_report r;
    struct fixture f;
    for (int i = 0; i < 5; i++) {
        xyz[6 + 3 * i] = cos(2 * pi * i / 5);
        xyz[7 + 3 * i] = sin(2 * pi * i / 5);
    }
    open_points(&f, xyz, 7);
    host_tetrahedra_cut(&f.tets, 0);
    for (uint32_t i = 0; i < 5; i++) {
        uint32_t t[4] = {vertex_of(&f, 0), vertex_of(&f, 1),
                         vertex_of(&f, 2 + i), vertex_of(&f, 2 + (i + 2) % 5)};
        if (orientation(&f, t) < 0) {
            uint32_t first = t[0];
            t[0] = t[1];
            t[1] = first;
        }
        append(&f.tets, t);
    }
    assert_int_equal(check(&f, HOST_CHECK_TILING, &r), HOST_UNVERIFIED);
    assert_non_null(strstr(r.text, "is a hull facet covered by another"));
    close_set(&f);
}

/* Odd and even points by themselves: every facet fits, and yet. */
TEST(two_bodies_are_found) {
    struct fixture f, part[2];
    double xyz[2][90], all[180];
    struct host_check_report r;
    for (int k = 0; k < 2; k++) {
        open_set(&part[k], "uniform", 30, 12 + (uint64_t)k);
        memcpy(xyz[k], part[k].points.xyz, sizeof xyz[k]);
        memcpy(all + 90 * k, xyz[k], sizeof xyz[k]);
    }
    open_points(&f, all, 60);
    host_tetrahedra_cut(&f.tets, 0);
    for (uint32_t k = 0; k < 2; k++) {
        for (uint64_t i = 0; i < part[k].right.count; i++) {
            uint32_t t[4];
            for (int d = 0; d < 4; d++) {
                uint32_t row = part[k].order.row[part[k].right.v[i][d]];
                t[d] = vertex_of(&f, row + 30 * k);
            }
            append(&f.tets, t);
        }
        close_set(&part[k]);
    }
    assert_int_equal(check(&f, HOST_CHECK_TILING, &r), HOST_UNVERIFIED);
    assert_non_null(strstr(r.text, "its Euler characteristic is not 2"));
    close_set(&f);
}

/* All tetrahedra at one vertex get a false vertex: a number out of range, which
 * is seen at once, or an unused slot, for which all is summed anew.  Both times
 * the same faults are counted, each once, with the vertex left alone. */
TEST(false_vertices_count_once) {
    struct fixture f;
    struct host_check_report r[2];
    uint32_t free_slot = 0, alone;
    open_set(&f, "uniform", 300, 1);
    while (host_site_is_vertex(&f.sites, free_slot))
        free_slot++;
    assert_in_range(free_slot, 1, f.sites.count - 1);
    alone = f.right.v[0][0];
    for (int run = 0; run < 2; run++) {
        restore(&f);
        for (uint64_t i = 0; i < f.tets.count; i++) {
            uint32_t *t = f.tets.v[i];
            if (t[0] == alone || t[1] == alone || t[2] == alone ||
                t[3] == alone) {
                t[t[0] == alone] =
                    run == 0 ? (uint32_t)f.sites.count : free_slot;
            }
        }
        assert_int_equal(check(&f, HOST_CHECK_DELAUNAY, &r[run]),
                         HOST_UNVERIFIED);
        assert_true(f.named[alone]);
    }
    assert_int_equal(r[0].faults, r[1].faults);
    assert_int_equal(r[0].distinct, 300);
    assert_int_equal(r[1].distinct, 300);
    close_set(&f);
}

/* Whether three vertices lie on one side of the box of the points. */
static bool is_on_box(const struct fixture *f, const uint32_t v[3]) {
    double p[3][3];
    bool on = false;
    for (int k = 0; k < 3; k++)
        host_site(&f->sites, v[k], p[k]);
    for (int d = 0; d < 3; d++) {
        on = on || (p[0][d] == p[1][d] && p[1][d] == p[2][d] &&
                    (p[0][d] <= f->order.lo[d] || p[0][d] >= f->order.hi[d]));
    }
    return on;
}

static int compare_vertices(const void *a, const void *b) {
    const uint32_t *x = a, *y = b;
    return *x < *y ? -1 : *x > *y;
}

/* Sums at vertices leave little to be paired one by one: the tetrahedra whose
 * lowest or second vertex is the lowest of a facet of the hull. */
TEST(sums_leave_little_to_pair) {
    struct fixture f;
    struct host_check_report r;
    static bool lowest[64 * 64];
    open_set(&f, "grid", 512, 1);
    assert_in_range(f.sites.count, 1, sizeof lowest / sizeof *lowest);
    assert_int_equal(check(&f, HOST_CHECK_DELAUNAY, &r), 0);
    assert_int_equal(r.paired, r.tetrahedra);
    assert_int_equal(check(&f, HOST_CHECK_TILING, &r), 0);
    uint64_t listed = 0;
    for (int count = 0; count < 2; count++) {
        for (uint64_t i = 0; i < f.tets.count; i++) {
            uint32_t v[4];
            memcpy(v, f.tets.v[i], sizeof v);
            qsort(v, 4, sizeof *v, compare_vertices);
            for (int k = 0; k < 4 && count == 0; k++) {
                uint32_t facet[3] = {v[k == 0], v[1 + (k <= 1)],
                                     v[2 + (k <= 2)]};
                lowest[facet[0]] = lowest[facet[0]] || is_on_box(&f, facet);
            }
            listed += count == 1 && (lowest[v[0]] || lowest[v[1]]);
        }
    }
    assert_int_equal(r.paired, listed);
    assert_true(listed < r.tetrahedra);
    close_set(&f);
}
