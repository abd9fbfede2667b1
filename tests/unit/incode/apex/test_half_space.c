#define TEST_OWN_MAIN
#include <stdalign.h>

#include "tests/unit/test.h"
#include <math.h>

#include "incode/apex/sphere.h"
#include "incode/apex/lanes.h"
#include "incode/apex/horizon.h"
#include "incode/predicates/predicates.h"
#include "incode/apex/query.h"

/* The shortcuts of the search against the predicates: what they rule out must
 * be ruled out exactly. */

static uint64_t state;

static double draw(void) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (double)(state >> 11) * 0x1p-53;
}

static size_t below(size_t n) {
    return (size_t)(draw() * (double)n);
}

/* A lattice of side x side points in a plane that no axis is parallel to: each
 * coordinate is rounded, so the plane is rough in the last place. */
static size_t lattice(double (*p)[3], size_t side, double size) {
    static const double u[3] = {20, 20, -10}, v[3] = {-4, 22, 20};
    size_t n = 0;
    for (size_t i = 0; i < side; i++) {
        for (size_t j = 0; j < side; j++, n++)
            for (int d = 0; d < 3; d++)
                p[n][d] = (u[d] * (double)i + v[d] * (double)j) / 30 * size;
    }
    return n;
}

/* A random face of four points near each other, the last beyond it. */
static bool draw_face(const double *f[4], double (*p)[3], size_t n, size_t near,
                      struct incode_tally *tally) {
    size_t at = below(n - near);
    for (int i = 0; i < 4; i++)
        f[i] = p[at + below(near)];
    return f[0] != f[1] && f[0] != f[2] && f[1] != f[2] &&
           incode_orient3d(tally, f[0], f[1], f[2], f[3]) > 0;
}

static bool in_ball(const struct incode_ball *ball, const double v[3],
                    const double p[3], double scale) {
    double square = 0;
    for (int d = 0; d < 3; d++) {
        double gap = (p[d] - v[d]) * scale - ball->centre[d];
        square += gap * gap;
    }
    return sqrt(square) <= ball->radius;
}

static struct incode_half_space half_space_of(const double *const f[4],
                                              double (*p)[3], size_t n,
                                              double scale) {
    struct incode_half_space s = {.scale = scale};
    double b[3], c[3];
    for (int d = 0; d < 3; d++) {
        s.p[d] = f[0][d];
        b[d] = (f[1][d] - f[0][d]) * scale;
        c[d] = (f[2][d] - f[0][d]) * scale;
    }
    incode_cross(s.n, b, c);
    for (size_t i = 0; i < n; i++) {
        struct incode_dd top = {s.most[0], s.most[1]};
        struct incode_dd height = incode_half_space_height(&s, p[i]);
        if (incode_dd_minus(height, top).hi > 0) {
            s.most[0] = height.hi;
            s.most[1] = height.lo;
        }
    }
    return s;
}

TEST(ball_on_a_rough_plane) {
    enum { SIDE = 24, POINTS = SIDE * SIDE };
    static double p[POINTS][3];
    struct incode_tally tally = {0};
    size_t balls = 0, outside = 0, small = 0, firsts = 0;
    for (int k = 0; k < 400; k++) {
        double size = ldexp(1, (int)below(80) - 40), scale = 0.5 / size;
        size_t n = lattice(p, SIDE, size);
        const double *f[4];
        if (!draw_face(f, p, n, 3 * SIDE, &tally))
            continue;
        struct incode_half_space half_space =
            half_space_of((const double **)f, p, n, scale);
        struct incode_near_degenerate degenerate = {.known = true,
                                                    .ball.radius = INFINITY,
                                                    .half_spaces = &half_space,
                                                    .count = 1};
        incode_near_degenerate_lessen(&degenerate, f, scale);
        balls += degenerate.ball.radius < INFINITY;
        small += degenerate.ball.radius < 12;
        for (size_t i = 0; i < n; i++) {
            if (p[i] == f[0] || p[i] == f[1] || p[i] == f[2] || p[i] == f[3])
                continue;
            bool first =
                incode_orient3d(&tally, f[0], f[1], f[2], p[i]) > 0 &&
                incode_in_sphere(&tally, f[0], f[1], f[2], f[3], p[i]) > 0;
            if (first) {
                assert_true(in_ball(&degenerate.ball, f[0], p[i], scale));
                firsts += degenerate.ball.radius < INFINITY;
            }
            if (incode_near_degenerate_outside(&degenerate, f[0], p[i],
                                               scale)) {
                outside++;
                assert_true(
                    incode_in_sphere(&tally, f[0], f[1], f[2], f[3], p[i]) < 0);
            }
        }
    }
    /* It must tell something, too. */

    assert_true(balls > 50 && small > 10 && firsts > 100 && outside > 10000);
}

/* Four points of a square of the lattice: in double precision their determinant
 * may cancel to nothing at all, and in twice the precision must not. */
TEST(spheres_of_rough_squares) {
    enum { SIDE = 24, POINTS = SIDE * SIDE };
    static double p[POINTS][3];
    struct incode_tally tally = {0};
    size_t vanished = 0, outside = 0;
    for (int k = 0; k < 4000; k++) {
        size_t n = lattice(p, SIDE, 1), at = below(n - 2 * SIDE - 2);
        const double *f[4] = {p[at], p[at + 1], p[at + SIDE], p[at + SIDE + 1]};
        double r[4][3], scale = 1.0 / 32;
        if (incode_orient3d(&tally, f[0], f[1], f[2], f[3]) <= 0)
            continue;
        struct incode_sphere s;
        for (int i = 1; i < 4; i++)
            for (int d = 0; d < 3; d++)
                r[i][d] = (f[i][d] - f[0][d]) * scale;
        incode_sphere_plane(&s, r[1], r[2]);
        incode_sphere_apex(&s, r[1], r[2], r[3]);
        vanished += s.det == 0;
        assert_true(incode_sphere_is_ill_conditioned(&s));
        incode_sphere_refine(&s, f[0], f[1], f[2], f[3], scale);
        assert_true(s.det > 0);
        for (size_t i = 0; i < n; i += 1 + below(7)) {
            for (int d = 0; d < 3; d++)
                r[0][d] = (p[i][d] - f[0][d]) * scale;
            if (incode_sphere_value(&s, r[0]) >= -incode_sphere_error(&s, r[0]))
                continue;
            outside++;
            assert_true(incode_in_sphere(&tally, f[0], f[1], f[2], f[3], p[i]) <
                        0);
        }
    }
    assert_true(vanished > 10 && outside > 100000);
}

/* The pencil of the face (0, b, c), but for its size; false: the square of the
 * face's sine is no more than `least`, by the maximum norm. */
static bool set_pencil(struct incode_pencil *pencil, const double b[3],
                       const double c[3], double least) {
    double n[3], cn[3], nb[3];
    incode_cross(n, b, c);
    double nn = incode_dot(n, n);
    double product = incode_max_norm(b) * incode_max_norm(c);
    if (!(nn > least * product * product))
        return false;
    incode_cross(cn, c, n);
    incode_cross(nb, n, b);
    for (int d = 0; d < 3; d++) {
        pencil->n[d] = n[d] / sqrt(nn);
        pencil->c0[d] =
            (incode_dot(b, b) * cn[d] + incode_dot(c, c) * nb[d]) / (2 * nn);
    }
    return true;
}

/* The places of points in a pencil against the predicates. */
TEST(places_in_a_pencil) {
    struct incode_tally tally = {0};
    size_t compared = 0;
    for (int k = 0; k < 200000; k++) {
        double p[5][3], b[3], c[3], r[2][3], t[2];
        struct incode_pencil pencil = {{0}, {0}, 1};
        for (int i = 0; i < 5; i++)
            for (int d = 0; d < 3; d++)
                p[i][d] = draw() * (k % 2 == 0 ? 1 : 1 + 1e-3 * (double)d);
        for (int d = 0; d < 3; d++) {
            b[d] = p[1][d] - p[0][d];
            c[d] = p[2][d] - p[0][d];
            r[0][d] = p[3][d] - p[0][d];
            r[1][d] = p[4][d] - p[0][d];
        }
        if (!set_pencil(&pencil, b, c, 1e-4))
            continue;
        pencil.size = fmax(fmax(incode_max_norm(b), incode_max_norm(c)),
                           incode_max_norm(pencil.c0));
        if (!incode_pencil_place(&pencil, r[0], &t[0]) ||
            !incode_pencil_place(&pencil, r[1], &t[1]))
            continue;
        assert_int_equal(incode_orient3d(&tally, p[0], p[1], p[2], p[3]), 1);
        if (incode_pencil_later(&pencil, t[0]) < t[1]) {
            assert_true(incode_in_sphere(&tally, p[0], p[1], p[2], p[3], p[4]) <
                        0);
            compared++;
        }
    }
    assert_true(compared > 10000);
}

/* The first of the local points, in float: none that is left out may come
 * before the bound. */
TEST(first_of_the_local_points) {
    static struct incode_local_points g;
    static const double lo[3] = {0, 0, 0}, hi[3] = {1, 1, 1};
    uint16_t out[INCODE_NEAR_ALL];
    size_t found = 0;
    for (int k = 0; k < 2000; k++) {
        double far = ldexp(1, (int)below(40));
        incode_local_reset(&g);
        g.around = 300;
        for (uint32_t i = 0; i < g.around; i++) {
            g.id[i] = i;
            for (int d = 0; d < 3; d++)
                g.p[d][i] = far + draw();
        }
        for (int d = 0; d < 3; d++) {
            g.around_lo[d] = far;
            g.around_hi[d] = far + 1;
        }
        g.per_unit = 0;
        double p[3] = {g.p[0][7], g.p[1][7], g.p[2][7]};
        incode_local_centre(&g, 7, p, 0.35, lo, hi);
        assert_true(g.near > 4 && g.self == 7);
        struct incode_pencil pencil;
        double b[3], c[3], t;
        incode_local_relative(&g, g.at[below(g.near)], b);
        incode_local_relative(&g, g.at[below(g.near)], c);
        if (!set_pencil(&pencil, b, c, 1e-2))
            continue;
        pencil.size = fmax(incode_max_norm(b), incode_max_norm(c));
        uint32_t count = incode_local_first(&g, &pencil, &t, out);
        found += count > 0;
        for (uint32_t i = 0; i < g.near && count > 0; i++) {
            double r[3], place;
            bool listed = false;
            for (uint32_t m = 0; m < count; m++)
                listed = listed || out[m] == g.at[i];
            incode_local_relative(&g, g.at[i], r);
            if (!listed && incode_pencil_place(&pencil, r, &place))
                assert_true(incode_pencil_later(&pencil, place) > t);
        }
    }
    assert_true(found > 500);
}

/* The point that comes first by the predicates alone, or NULL. */
static const double *first_of(const double *const f[3], const double *const *p,
                              size_t n, struct incode_tally *tally) {
    const double *first = NULL;
    for (size_t i = 0; i < n; i++)
        if (incode_orient3d(tally, f[0], f[1], f[2], p[i]) > 0 &&
            (first == NULL ||
             incode_in_sphere(tally, f[0], f[1], f[2], first, p[i]) > 0))
            first = p[i];
    return first;
}

/* A random face of a cubic lattice that is turned and rounded, and the other
 * corners of its cell: all on one sphere but for the rounding. */
TEST(close_candidates_of_a_rough_lattice) {
    static const double turn[3][3] = {
        {20, 20, -10}, {-4, 22, 20}, {22, -4, 20}};
    struct incode_tally tally = {0};
    size_t certain = 0, alone = 0;
    for (int k = 0; k < 50000; k++) {
        bool exact = k % 10 == 0;
        int power = exact ? 0 : (int)below(200) - 100;
        double corner[8][3], at[3];
        const double *q[8];
        for (int j = 0; j < 3; j++)
            at[j] = (double)below(100) - 50;
        for (size_t i = 0; i < 8; i++) {
            size_t other = below(i + 1);
            q[i] = q[other];
            q[other] = corner[i];
            for (int d = 0; d < 3; d++) {
                double sum = 0;
                for (int j = 0; j < 3; j++)
                    sum += turn[j][d] * (at[j] + (double)(i >> j & 1));
                corner[i][d] = ldexp(exact ? sum : sum / 30, power);
            }
        }
        struct incode_close_candidates close = {.count = 0};
        size_t n = 1 + below(5);
        for (size_t i = 0; i < n; i++)
            assert_true(incode_close_add(&close, q[3 + i]));
        uint32_t first = incode_close_first(
            &close, q[0], q[1], q[2], ldexp(1, -power - exact * 5), &tally);
        if (first == INCODE_CLOSE_NONE)
            continue;
        certain++;
        alone += n == 1;
        assert_ptr_equal(q[3 + first], first_of(q, q + 3, n, &tally));
    }
    /* Rounded alike, some corners share a sphere indeed. */
    assert_true(alone > 1000 && certain > 20000);
}

/* A tetrahedron of n points on a facet of their hull: its sphere is empty. */
static void draw_empty(const double *t[4], double (*p)[3], size_t n,
                       struct incode_tally *tally) {
    const double *others[64];
    size_t count;
    do {
        for (int i = 0; i < 3; i++)
            t[i] = p[below(n)];
        count = 0;
        for (size_t i = 0; i < n; i++)
            if (t[0] != t[1] && t[0] != t[2] && t[1] != t[2] &&
                incode_orient3d(tally, t[0], t[1], t[2], p[i]) > 0)
                others[count++] = p[i];
    } while (count < n - 3);
    t[3] = first_of(t, others, count, tally);
}

/* Points on a sphere up to rounding: what a radical plane rules out is outside.
 */
TEST(radical_bounds_on_a_rough_sphere) {
    enum { POINTS = 24 };
    static double p[POINTS][3];
    struct incode_tally tally = {0};
    size_t set = 0, out = 0;
    for (int k = 0; k < 300; k++) {
        struct incode_empty_spheres empty = {.count = 0};
        double size = ldexp(1, (int)below(40) - 20), scale = 1 / size;
        double at = k % 3 == 0 ? 0 : size * ldexp(1, (int)below(6));
        for (size_t i = 0; i < POINTS; i++) {
            double length = 0;
            for (int d = 0; d < 3; d++) {
                p[i][d] = draw() + draw() + draw() - 1.5;
                length += p[i][d] * p[i][d];
            }
            for (int d = 0; d < 3; d++)
                p[i][d] = at + size * p[i][d] / sqrt(length);
        }
        const double *t[4], *f[4];
        for (int i = 0; i < 3; i++) {
            draw_empty(t, p, POINTS, &tally);
            incode_empty_spheres_add(&empty, t, scale);
        }
        for (int m = 0; m < 20; m++) {
            if (!draw_face(f, p, POINTS, POINTS - 1, &tally))
                continue;
            struct incode_radical_bound c;
            double b[3], d[3], n[3], r[3];
            for (int i = 0; i < 3; i++) {
                b[i] = (f[1][i] - f[0][i]) * scale;
                d[i] = (f[2][i] - f[0][i]) * scale;
            }
            incode_cross(n, b, d);
            incode_radical_bound_set(&c, &empty, f, scale, n);
            set += c.set;
            for (size_t i = 0; i < POINTS && c.set; i++) {
                double far = 0;
                for (int j = 0; j < 3; j++) {
                    r[j] = (p[i][j] - f[0][j]) * scale;
                    far += fabs(r[j]);
                }
                if (incode_dot(c.g, r) - far * c.slack > c.level) {
                    out++;
                    assert_true(incode_in_sphere(&tally, f[0], f[1], f[2], f[3],
                                                 p[i]) < 0);
                }
            }
        }
    }
    assert_true(set > 500 && out > 2000);
}

/* A sphere of much larger scale: what a radical plane by it rules out is
 * outside, and where the products leave the range of doubles there is none. */
TEST(radical_bounds_across_scales) {
    struct incode_tally tally = {0};
    size_t set = 0, out = 0;
    for (int power = 0; power < 1020; power += 4) {
        double big = ldexp(1, power / 2), small = ldexp(1, -power / 2);
        double large[4][3] = {
            {big, 0, 0}, {2 * big, 0, big}, {2 * big, big, 0}, {3 * big, 0, 0}};
        double face[4][3] = {
            {0, 0, 0}, {0, small, 0}, {small, 0, 0}, {0, 0, small}};
        const double *const t[4] = {large[0], large[1], large[2], large[3]};
        const double *const f[4] = {face[0], face[2], face[1], face[3]};
        struct incode_empty_spheres empty = {.count = 0};
        struct incode_radical_bound c;
        const double n[3] = {1, 1, 1};
        if (incode_orient3d(&tally, t[0], t[1], t[2], t[3]) > 0) {
            incode_empty_spheres_add(&empty, t, 1 / big);
        } else {
            const double *const u[4] = {t[0], t[2], t[1], t[3]};
            incode_empty_spheres_add(&empty, u, 1 / big);
        }
        assert_int_equal(empty.count, 1);
        assert_true(incode_orient3d(&tally, f[0], f[1], f[2], f[3]) > 0);
        incode_radical_bound_set(&c, &empty, f, 1 / small, n);
        set += c.set;
        for (int i = 0; i < 64 && c.set; i++) {
            int place[3] = {i % 4, i / 4 % 4, i / 16};
            const double r[3] = {0.25 * place[0], 0.25 * place[1],
                                 0.25 * place[2]};
            const double p[3] = {small * r[0], small * r[1], small * r[2]};
            if (incode_dot(c.g, r) - c.slack * (r[0] + r[1] + r[2]) > c.level)
                out += incode_in_sphere(&tally, f[0], f[1], f[2], f[3], p) >= 0;
        }
    }
    assert_true(set > 100 && out == 0);
}

/* A point so near the vertex that their difference is lost when it is scaled:
 * where it lies in the pencil is not known, so it lessens nothing. */
TEST(a_difference_that_vanishes) {
    const double v[3] = {0, 0, 0}, b[3] = {0x1p60, 0, 0}, c[3] = {0, 0x1p60, 0};
    const double near[3] = {0, 0, 0x1p-1060}, within[3] = {0x1p58, 0x1p58, 1};
    struct incode_near_degenerate degenerate = {
        .known = true, .regular = true, .c0 = {0.5, 0.5, 0}};
    degenerate.ball.radius = INFINITY;
    incode_near_degenerate_lessen(&degenerate,
                                  (const double *[]){v, b, c, near}, 0x1p-60);
    assert_true(isinf(degenerate.ball.radius));
    incode_near_degenerate_lessen(&degenerate,
                                  (const double *[]){v, b, c, within}, 0x1p-60);
    assert_true(degenerate.ball.radius < 0.8);
}

/* A face so small beside its units that products vanish: the sphere's centre is
 * lost, and a box that holds the sphere may hold the apex. */
TEST(a_sphere_that_vanishes) {
    for (int power = -1074; power < 0; power++) {
        double size = ldexp(1, power);
        const double b[3] = {size, 0, 0}, c[3] = {0, size, 0};
        const double apex[3] = {0, 0, size};
        alignas(64) double lo[3][32], hi[3][32];
        struct incode_query q = {.question = INCODE_QUERY_APEX, .scale = 1};
        incode_sphere_plane(&q.sphere, b, c);
        incode_sphere_apex(&q.sphere, b, c, apex);
        incode_sphere_refine(&q.sphere, q.pv, b, c, apex, 1);
        incode_query_start(&q, 3, apex);
        for (int i = 0; i < 32; i++) {
            for (int d = 0; d < 3; d++) {
                lo[d][i] = i < 16 ? ldexp(-size, 60 * i) : 0;
                hi[d][i] = ldexp(size, 60 * (i % 16));
            }
        }
        const double *const low[3] = {lo[0], lo[1], lo[2]};
        const double *const high[3] = {hi[0], hi[1], hi[2]};
        assert_int_equal(incode_query_boxes(&q, low, high, 32), UINT32_MAX);
    }
}

int main(void) {
    state = 88172645463325252u;
    return test_run();
}
