/* Memory of any size: what does not fit is told, and leaves all as it was; and
 * what the first four points may be. */
#include "complex_scene.h"

#include <math.h>

enum {
    ROWS = 25,
    SPHERE = 300,
    BEFORE = 288,
    MEMORY_MAX = 16384,
    LEAST = INCODE_COMPLEX_CELLS_FIRST + 5 /* cells */
};

static uint64_t seed;

static int begin(void **unused) {
    (void)unused;
    seed = 88172645463325252u;
    return 0;
}

/* Two skew lines, and between them what takes many of their cells away; then
 * some of a grid. */
static void draw_set(double (*p)[3]) {
    memset(p, 0, ROWS * sizeof *p);
    for (int i = 0; i < 7; i++) {
        p[2 * i][0] = p[2 * i + 1][1] = i;
        p[2 * i + 1][2] = 1;
    }
    p[14][0] = p[14][1] = p[14][2] = 0.25;
    for (int i = 15, z = 2; i < ROWS; i++) {
        p[i][0] = i % 2 - 3;
        p[i][1] = i % 3;
        p[i][2] = z;
        z += i % 6 == 5 ? 2 : 0;
    }
}

/* ---- what may not change ---- */

struct state {
    uint32_t points, cells, free, free_count;
    struct incode_complex_point point[ROWS + 2];
    struct incode_cell cell[MEMORY_MAX / sizeof(struct incode_cell)];
};

/* All but marks; the list of free cells is in their neighbours. */
static void take_state(const struct scene *s, struct state *to) {
    const struct incode_complex *x = &s->x;
    uint8_t used[MEMORY_MAX / sizeof(struct incode_cell)];
    uint32_t list[MEMORY_MAX / sizeof(struct incode_cell)];
    memset(to, 0, sizeof *to);
    assert_true(x->points <= ROWS + 2);
    to->points = x->points;
    to->cells = x->cells;
    to->free = x->free_count > 0 ? x->free : 0;
    to->free_count = x->free_count;
    for (uint32_t v = 0; v < x->points; v++) {
        memcpy(to->point[v].p, x->point[v].p, sizeof x->point[v].p);
        to->point[v].id = x->point[v].id;
        to->point[v].cell = x->cells > 0 ? x->point[v].cell : 0;
    }
    if (x->cells > 0)
        (void)scene_reach(s, used, list);
    for (uint32_t i = 0; i < x->cells; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        memcpy(to->cell[i].v, c->v, sizeof c->v);
        memcpy(to->cell[i].n, c->n, sizeof c->n);
        if (used[i] == 0)
            continue;
        /* Marks are 0 by now. */
        memcpy(to->cell[i].sphere, c->sphere, sizeof c->sphere);
        to->cell[i].scale = c->scale;
        to->cell[i].flags = c->flags;
        assert_int_equal(c->flags & INCODE_CELL_MARK, 0);
    }
}

/* Inserts a point; where it does not fit, twice, and compares. */
static bool try_insert(struct scene *s, uint32_t v) {
    static struct state before, after;
    uint32_t near = scene_near(s);
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < s->x.cells; i++)
        incode_cell_set_proved(incode_complex_cell(&s->x, i), 1 + i % 3);
    take_state(s, &before);
    if (incode_complex_insert(&s->x, &s->tally, v, near)) {
        assert_true(incode_complex_is_vertex(&s->x, v));
        return true;
    }
    for (int i = 0; i < 2; i++) {
        assert_false(incode_complex_is_vertex(&s->x, v));
        take_state(s, &after);
        assert_memory_equal(&before, &after, sizeof before);
        if (i == 0)
            assert_false(
                incode_complex_insert(&s->x, &s->tally, v, scene_near(s)));
    }
    return false;
}

/* ---- memory of each size ---- */

/* The point's index where there is room for it, INCODE_NONE where not. */
static uint32_t try_add(struct scene *s, const double p[3], uint32_t row) {
    size_t used = scene_used(s->x.points + 1, s->x.cells);
    uint32_t expected = used <= s->bytes ? s->x.points : INCODE_NONE;
    uint32_t v = incode_complex_add(&s->x, p, row);
    assert_int_equal(v, expected);
    return v;
}

/* Takes what fits of the rows, and tells of each whether it does.  late: a
 * point is added when its turn comes, else all are at first.  cells: so many
 * there are with each row, and all before. */
static uint32_t fill(struct scene *s, const double (*p)[3], bool late,
                     const uint32_t *cells, uint32_t *row) {
    const uint32_t four[4] = {1, 2, 3, 4};
    uint32_t added = 0, count = 0, most = late ? 4 : ROWS;
    while (added < most && try_add(s, p[added], added) != INCODE_NONE)
        added++;
    if (added < 4)
        return 0;
    bool room = scene_used(s->x.points, LEAST) <= s->bytes;
    assert_int_equal(incode_complex_begin(&s->x, &s->tally, four), room);
    if (!room)
        return 0;
    for (uint32_t i = 0; i < ROWS; i++) {
        if (late && i >= 4)
            added += try_add(s, p[i], i) != INCODE_NONE;
        if (i >= added)
            break;
        if (i >= 4) {
            bool fits = scene_used(s->x.points, cells[i]) <= s->bytes;
            bool inserted = try_insert(s, i + 1);
            /* Once one is left out, the others need other cells. */
            if (count == i)
                assert_int_equal(inserted, fits);
            if (!inserted)
                continue;
        }
        row[count++] = i;
    }
    scene_check(s);
    return count;
}

TEST_WITH(each_size_of_memory, begin, NULL) {
    double p[ROWS][3];
    const double(*xyz)[3] = (const double(*)[3])p;
    uint32_t cells[ROWS], row[ROWS], taken[ROWS + 1] = {0}, four[4];
    struct scene s = {.seed = 7};
    draw_set(p);
    scene_open(&s, MEMORY_MAX);
    for (uint32_t i = 0; i < ROWS; i++)
        assert_int_equal(try_add(&s, p[i], i), i + 1);
    assert_true(scene_four(&s, 1, ROWS, four));
    assert_int_equal(four[3], 4);
    assert_true(incode_complex_begin(&s.x, &s.tally, four));
    for (uint32_t i = 4; i < ROWS; i++) {
        assert_true(try_insert(&s, i + 1));
        cells[i] = s.x.cells;
    }
    size_t enough = scene_used(s.x.points, s.x.cells);
    scene_close(&s);
    for (size_t bytes = 0; bytes <= enough; bytes += 8)
        for (int late = 0; late < 2; late++) {
            struct scene other = {.seed = 9};
            struct host_tetrahedra tets = {0};
            scene_open(&s, bytes);
            uint32_t count = fill(&s, xyz, late != 0, cells, row);
            taken[count]++;
            if (count > 0) {
                scene_open(&other, MEMORY_MAX);
                assert_true(scene_build(&other, xyz, row, count));
                scene_tetrahedra(&other, &tets);
                scene_compare(&s, &tets);
                host_tetrahedra_free(&tets);
                scene_close(&other);
            }
            assert_true(bytes < enough || count == ROWS);
            scene_close(&s);
        }
    assert_true(taken[0] > 0 && taken[5] > 0 && taken[ROWS - 1] > 0);
    assert_int_equal(taken[ROWS], 2); /* all of it is needed */
}

/* What is left over of 8 bytes is not used. */
TEST_WITH(odd_sizes_of_memory, begin, NULL) {
    double p[ROWS][3];
    draw_set(p);
    for (size_t odd = 0; odd < 8; odd++) {
        struct scene s = {.seed = 7};
        uint32_t row[ROWS] = {0, 1, 2, 3, 4};
        scene_open(&s, scene_used(6, 16) + odd);
        assert_true(scene_build(&s, (const double(*)[3])p, row, 5));
        while (incode_complex_add(&s.x, p[5], 5) != INCODE_NONE)
            continue;
        for (size_t i = 0; i < odd; i++)
            assert_int_equal(s.block[SCENE_GUARD + s.bytes - 1 - i],
                             SCENE_FILL);
        scene_check(&s);
        scene_close(&s);
    }
}

/* The hub of a sphere, whose cavity is a large one, is refused any number of
 * times, which leaves no traces in the marks that its neighbours meet. */
TEST_WITH(refused_again_and_again, begin, NULL) {
    static double p[SPHERE + 1][3];
    uint32_t row[SPHERE], cells = 0, hub = SPHERE + 1;
    for (uint32_t i = 0; i < SPHERE; i++) {
        row[i] = i;
        for (int d = 0; d < 3; d++)
            p[i][d] = scene_unit(&seed) - 0.5;
        double r =
            sqrt(p[i][0] * p[i][0] + p[i][1] * p[i][1] + p[i][2] * p[i][2]);
        for (int d = 0; d < 3; d++)
            p[i][d] /= r;
    }
    for (int refusals = 0; refusals < 2; refusals++) {
        struct scene s = {.seed = 7};
        scene_open(&s, refusals == 0 ? scene_bytes(SPHERE)
                                     : scene_used(SPHERE + 2, cells));
        assert_true(scene_build(&s, (const double(*)[3])p, row, BEFORE));
        for (uint32_t i = BEFORE; i <= SPHERE; i++)
            assert_int_equal(try_add(&s, p[i], i), i + 1);
        for (uint32_t v = BEFORE + 1; v < hub; v++) {
            for (uint32_t i = 0; refusals > 0 && i < 100 + v % 64; i++)
                assert_false(
                    incode_complex_insert(&s.x, &s.tally, hub, scene_near(&s)));
            assert_true(
                incode_complex_insert(&s.x, &s.tally, v, scene_near(&s)));
        }
        assert_false(incode_complex_is_vertex(&s.x, hub));
        scene_check(&s);
        cells = s.x.cells;
        scene_close(&s);
    }
}

/* Indices have 16 bits. */
TEST_WITH(points_without_number, begin, NULL) {
    struct scene s = {.seed = 7};
    uint32_t v = 0, points = 1;
    scene_open(&s, scene_used(INCODE_COMPLEX_POINTS_MAX + 9, 0));
    while (v != INCODE_NONE) {
        const double p[3] = {points, points % 2, points % 3};
        v = incode_complex_add(&s.x, p, 5 * points);
        if (v != INCODE_NONE)
            assert_int_equal(v, points++);
    }
    assert_int_equal(points, INCODE_COMPLEX_POINTS_MAX);
    for (v = 1; v < points; v++) {
        assert_int_equal(s.x.point[v].id, 5 * v);
        assert_true(s.x.point[v].p[0] == v && s.x.point[v].p[2] == v % 3);
        assert_false(incode_complex_is_vertex(&s.x, v));
    }
    scene_close(&s);
}

/* ---- the first four ---- */

/* Any order of four is the one tetrahedron. */
TEST_WITH(either_orientation, begin, NULL) {
    const double p[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    struct host_tetrahedra tets = {0};
    scene_append(&tets, 0, 1, 2, 3);
    host_tetrahedra_sort(&tets);
    for (uint32_t i = 0; i < 256; i++) {
        const uint32_t four[4] = {1 + i % 4, 1 + i / 4 % 4, 1 + i / 16 % 4,
                                  1 + i / 64};
        struct scene s = {.seed = 7};
        uint32_t seen = 0;
        for (int k = 0; k < 4; k++)
            seen |= 1u << four[k];
        if (seen != 30)
            continue;
        scene_open(&s, scene_used(5, LEAST));
        for (uint32_t k = 0; k < 4; k++)
            assert_int_equal(try_add(&s, p[k], k), k + 1);
        assert_true(incode_complex_begin(&s.x, &s.tally, four));
        for (uint32_t k = 0; k < 5; k++)
            assert_true(incode_complex_is_vertex(&s.x, k));
        assert_int_equal(s.x.cells, LEAST);
        scene_check(&s);
        scene_compare(&s, &tets);
        scene_close(&s);
    }
    host_tetrahedra_free(&tets);
}

/* Four of a plane are none, on a circle or a line or not, and others may be
 * tried. */
TEST_WITH(four_in_a_plane, begin, NULL) {
    const double p[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                            {2, 0, 0}, {3, 0, 0}, {5, 7, 0}, {1, 2, 3}};
    static const uint32_t flat[3][4] = {
        {1, 2, 3, 4}, {1, 2, 5, 6}, {7, 3, 1, 2}};
    static const uint32_t four[4] = {8, 3, 1, 2};
    struct scene s = {.seed = 7};
    static struct state before, after;
    scene_open(&s, MEMORY_MAX);
    for (uint32_t i = 0; i < 8; i++)
        assert_int_equal(try_add(&s, p[i], i), i + 1);
    take_state(&s, &before);
    for (int i = 0; i < 3; i++) {
        assert_false(incode_complex_begin(&s.x, &s.tally, flat[i]));
        take_state(&s, &after);
        assert_memory_equal(&before, &after, sizeof before);
        for (uint32_t v = 1; v <= 8; v++)
            assert_false(incode_complex_is_vertex(&s.x, v));
    }
    assert_true(incode_complex_begin(&s.x, &s.tally, four));
    for (uint32_t v = 4; v < 8; v++) {
        scene_check(&s);
        assert_true(try_insert(&s, v));
    }
    scene_check(&s);
    scene_close(&s);
}

/* What was there before leaves no traces. */
TEST_WITH(all_is_forgotten, begin, NULL) {
    double p[ROWS][3];
    struct scene s = {.each = true, .seed = 7};
    struct host_tetrahedra tets = {0};
    uint32_t row[ROWS];
    draw_set(p);
    scene_open(&s, MEMORY_MAX);
    for (int round = 0; round < 20; round++) {
        scene_shuffle(&seed, row, ROWS);
        incode_complex_clear(&s.x);
        assert_int_equal(s.x.points, 1);
        assert_true(scene_build(&s, (const double(*)[3])p, row, ROWS));
        if (round == 0)
            scene_tetrahedra(&s, &tets);
        scene_compare(&s, &tets);
    }
    host_tetrahedra_free(&tets);
    scene_close(&s);
}
