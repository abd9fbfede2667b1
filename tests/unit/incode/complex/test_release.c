/* A complex from which final cells are released goes on taking points: what was
 * released and what is left are the triangulation of all, each cell once,
 * whatever the order of the bricks, and none that is final is needed again.
 * Points that come later may be shown to it before. */
#include "cavity_scene.h"

#include "tests/unit/emulated.h"

enum { MOST = 400, BRICK = 20, KINDS = 5 };

static uint64_t seed = 88172645463325252u;

static void draw_set(unsigned kind, double (*p)[3]) {
    for (uint32_t i = 0; i < MOST; i++)
        for (int d = 0; d < 3; d++) {
            double x = scene_unit(&seed);
            p[i][d] = kind == 0   ? x /* volume */
                      : kind == 1 ? (i /
                                     (d == 0   ? 1
                                      : d == 1 ? 8
                                               : 64) %
                                     8)                     /* grid */
                      : kind == 2 ? (d == 2 ? 0.01 * x : x) /* slab */
                      : kind == 3 ? (d == 0 ? x : 0.02 * x) /* rod */
                                  : (i % 2 ? x + 3 : x * 0x1p-9) /* lumps */;
        }
}

/* Whether no point to come is in a cell's sphere or beyond its facet. */
static bool is_final(struct scene *s, const struct incode_cell *c,
                     const double (*p)[3], const uint32_t *row, uint32_t from,
                     uint32_t n) {
    unsigned k = incode_cell_index(c, INCODE_COMPLEX_INFINITE);
    const double *q[4];
    for (unsigned i = 0; i < 4; i++)
        q[i] = s->x.point[c->v[i]].p;
    for (uint32_t i = from; i < n; i++) {
        const double *r = p[row[i]];
        if (k < 4)
            q[k] = r;
        if (k < 4 ? incode_orient3d(&s->tally, q[0], q[1], q[2], q[3]) >= 0
                  : incode_in_sphere(&s->tally, q[0], q[1], q[2], q[3], r) > 0)
            return false;
    }
    return true;
}

/* What is there of a cell's facets. */
static void check_left(struct scene *s) {
    struct incode_complex *x = &s->x;
    uint32_t free = 0;
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < x->cells; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        if (incode_cell_is_free(c)) {
            free++;
            continue;
        }
        for (unsigned k = 0; k < 4; k++) {
            uint32_t n = c->n[k].cell;
            assert_true(incode_complex_is_vertex(x, c->v[k]));
            assert_true(n < x->cells);
            if (n < INCODE_COMPLEX_CELLS_FIRST)
                continue;
            const struct incode_cell *d = incode_complex_cell(x, n);
            assert_false(incode_cell_is_free(d));
            (void)scene_across(s, i, k);
        }
        if (!incode_cell_is_infinite(c))
            assert_int_equal(scene_orient(s, c, 0, c->v[0]), 1);
    }
    assert_int_equal(free, x->free_count);
    for (uint32_t v = 0; v < x->points; v++)
        if (incode_complex_is_vertex(x, v))
            assert_true(incode_cell_index(
                            incode_complex_cell(x, x->point[v].cell), v) < 4);
}

static void append(const struct scene *s, const struct incode_cell *c,
                   struct host_tetrahedra *tets) {
    const struct incode_complex_point *q = s->x.point;
    if (!incode_cell_is_infinite(c))
        scene_append(tets, q[c->v[0]].id, q[c->v[1]].id, q[c->v[2]].id,
                     q[c->v[3]].id);
}

/* Of those that are final as many as chance will; all: the others, too.  Says
 * how many. */
static uint32_t release(struct scene *s, const double (*p)[3],
                        const uint32_t *row, uint32_t from, uint32_t n,
                        struct host_tetrahedra *tets) {
    struct incode_complex *x = &s->x;
    uint32_t count = 0, part = 1 + scene_draw(&seed, 8);
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < x->cells; i++) {
        struct incode_cell *c = incode_complex_cell(x, i);
        if (incode_cell_is_free(c))
            continue;
        bool final = is_final(s, c, p, row, from, n) &&
                     (from == n || scene_draw(&seed, 8) < part);
        incode_cell_set_proved(c, final);
        count += final;
        if (final)
            append(s, c, tets);
    }
    incode_complex_release(x, &s->tally.yield);
    check_left(s);
    return count;
}

/* Some of the points to come, each of which a cell holds that is left. */
static void show(struct scene *s, const double (*p)[3], const uint32_t *row,
                 uint32_t from, uint32_t n) {
    bool listed;
    scene_prove_all(s);
    for (uint32_t i = from; i < n; i += 1 + scene_draw(&seed, 2 * BRICK))
        assert_true(scene_check_cavity(s, p[row[i]], &listed) > 0);
    scene_prove_none(s);
    check_left(s);
}

/* Bricks of points in slabs along an axis, these in any order; after some of
 * them what is final is released.  Returns the scans. */
static uint64_t stream(const double (*p)[3], const uint32_t *row, uint32_t n,
                       const struct host_tetrahedra *expected,
                       uint32_t *points) {
    struct scene s = {.seed = 7};
    struct host_tetrahedra tets = {0};
    uint32_t four[4], v[MOST];
    scene_open(&s, scene_bytes(n));
    for (uint32_t from = 0; from < n;) {
        uint32_t to = from == 0 ? 5 * BRICK : from + BRICK;
        to = to < n ? to : n;
        for (uint32_t i = from; i < to; i++) {
            v[i] = incode_complex_add(&s.x, p[row[i]], row[i]);
            assert_int_not_equal(v[i], INCODE_NONE);
            assert_false(incode_complex_is_vertex(&s.x, v[i]));
        }
        if (from == 0) {
            assert_true(scene_four(&s, 1, to, four));
            assert_true(incode_complex_begin(&s.x, &s.tally, four));
        }
        for (uint32_t i = from; i < to; i++)
            if (!incode_complex_is_vertex(&s.x, v[i]))
                assert_true(incode_complex_insert(&s.x, &s.tally, v[i],
                                                  scene_near(&s)));
        check_left(&s);
        from = to;
        if (from == n || scene_draw(&seed, 2) == 0)
            (void)release(&s, p, row, from, n, &tets);
        show(&s, p, row, from, n);
    }
    /* Nothing is left but room. */
    assert_int_equal(s.x.cells, s.x.free_count + INCODE_COMPLEX_CELLS_FIRST);
    *points = s.x.points;
    host_tetrahedra_sort(&tets);
    assert_int_equal(tets.count, expected->count);
    assert_memory_equal(tets.v, expected->v, tets.count * sizeof *tets.v);
    host_tetrahedra_free(&tets);
    uint64_t scans = s.x.scans;
    scene_close(&s);
    return scans;
}

static double (*sorted)[3];
static int axis;

static int compare(const void *a, const void *b) {
    double x = sorted[*(const uint32_t *)a][axis];
    double y = sorted[*(const uint32_t *)b][axis];
    return x < y ? -1 : x > y;
}

/* Slabs of a brick each along an axis, in order or in any. */
static void put_in_order(double (*p)[3], uint32_t *row, int along, bool mixed) {
    uint32_t slab[MOST / BRICK], copy[MOST];
    sorted = p;
    axis = along;
    qsort(row, MOST, sizeof *row, compare);
    if (!mixed)
        return;
    memcpy(copy, row, sizeof copy);
    scene_shuffle(&seed, slab, MOST / BRICK);
    for (uint32_t i = 0; i < MOST; i++)
        row[i] = copy[slab[i / BRICK] * BRICK + i % BRICK];
}

TEST(any_order_of_bricks) {
    static double p[MOST][3];
    uint32_t row[MOST], points, taken_again = 0;
    uint64_t scans = 0;
    for (unsigned round = 0; round < (SANITIZED ? 5 : 40); round++) {
        struct scene whole = {.seed = 9};
        struct host_tetrahedra expected = {0};
        draw_set(round % KINDS, p);
        scene_shuffle(&seed, row, MOST);
        scene_open(&whole, scene_bytes(MOST));
        assert_true(scene_build(&whole, (const double(*)[3])p, row, MOST));
        scene_tetrahedra(&whole, &expected);
        scene_close(&whole);
        put_in_order(p, row, (int)(round / KINDS % 3), round / 2 % 4 == 3);
        scans += stream((const double(*)[3])p, row, MOST, &expected, &points);
        taken_again += points <= MOST / 2;
        host_tetrahedra_free(&expected);
    }
    assert_true(scans > 0);
    assert_true(taken_again > 0);
}
