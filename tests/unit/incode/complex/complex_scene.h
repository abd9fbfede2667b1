/* A complex in memory of its own, between guards, and what must hold of it
 * whenever nobody is at work on it.
 *
 * Memory: what is given, and 9 bytes a cell while it is checked. */
#ifndef TESTS_UNIT_COMPLEX_SCENE_H
#define TESTS_UNIT_COMPLEX_SCENE_H

#include <stdlib.h>
#include <string.h>

#include "host/mesh/tetrahedra.h"
#include "incode/complex/complex.h"
#include "tests/unit/test.h"

enum { SCENE_GUARD = 64, SCENE_FILL = 0xa5 };

struct scene {
    struct incode_complex x;
    struct incode_tally tally;
    bool each;     /* whether it is checked after each insertion */
    uint64_t seed; /* of the vertices that insertions start from */
    size_t bytes;
    uint8_t *block;
};

static inline uint32_t scene_draw(uint64_t *seed, uint32_t below) {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    return (uint32_t)((*seed * UINT64_C(0x9e3779b97f4a7c15) >> 32) * below >>
                      32);
}

static inline double scene_unit(uint64_t *seed) {
    return (scene_draw(seed, UINT32_MAX) +
            scene_draw(seed, 1 << 20) * 0x1p-20) *
           0x1p-32;
}

/* ---- memory ---- */

/* So many points and cells fill it. */
static inline size_t scene_used(uint32_t points, uint32_t cells) {
    return points * sizeof(struct incode_complex_point) +
           cells * sizeof(struct incode_cell);
}

/* Ample memory for n points, be it that they are not on skew lines. */
static inline size_t scene_bytes(uint32_t n) {
    return scene_used(n + 1, 16 * n + 64);
}

/* bytes: any; the memory begins where 8 divides the address. */
static inline void scene_open(struct scene *s, size_t bytes) {
    s->bytes = bytes;
    s->block = malloc(bytes + 2 * SCENE_GUARD);
    assert_non_null(s->block);
    memset(s->block, SCENE_FILL, bytes + 2 * SCENE_GUARD);
    incode_complex_init(&s->x, s->block + SCENE_GUARD, bytes);
}

static inline void scene_close(struct scene *s) {
    for (size_t i = 0; i < SCENE_GUARD; i++) {
        assert_int_equal(s->block[i], SCENE_FILL);
        assert_int_equal(s->block[SCENE_GUARD + s->bytes + i], SCENE_FILL);
    }
    free(s->block);
    s->block = NULL;
}

/* ---- what must hold ---- */

static inline int scene_orient(struct scene *s, const struct incode_cell *c,
                               unsigned i, uint32_t v) {
    const double *p[4];
    for (unsigned k = 0; k < 4; k++)
        p[k] = s->x.point[k == i ? v : c->v[k]].p;
    return incode_orient3d(&s->tally, p[0], p[1], p[2], p[3]);
}

static inline bool scene_outside(struct scene *s, const struct incode_cell *c,
                                 uint32_t v) {
    const struct incode_complex_point *q = s->x.point;
    return incode_in_sphere(&s->tally, q[c->v[0]].p, q[c->v[1]].p, q[c->v[2]].p,
                            q[c->v[3]].p, q[v].p) < 0;
}

/* The cells that are reached from the infinite vertex, each once; `state`: 1 of
 * theirs, 0 of the others. */
static inline uint32_t scene_reach(const struct scene *s, uint8_t *state,
                                   uint32_t *list) {
    uint32_t count = 1;
    memset(state, 0, s->x.cells);
    list[0] = s->x.point[INCODE_COMPLEX_INFINITE].cell;
    assert_true(list[0] < s->x.cells);
    state[list[0]] = 1;
    for (uint32_t done = 0; done < count; done++) {
        const struct incode_cell *c = incode_complex_cell(&s->x, list[done]);
        for (unsigned i = 0; i < 4; i++) {
            assert_true(c->n[i].cell < s->x.cells);
            if (state[c->n[i].cell] == 0) {
                state[c->n[i].cell] = 1;
                list[count++] = c->n[i].cell;
            }
        }
    }
    return count;
}

/* The free ones are all others, and each is in the list once. */
static inline void scene_check_free(const struct scene *s, uint8_t *state,
                                    uint32_t live) {
    uint32_t at = s->x.free;
    assert_int_equal(live + s->x.free_count + INCODE_COMPLEX_CELLS_FIRST,
                     s->x.cells);
    for (uint32_t i = 0; i < s->x.free_count; i++) {
        assert_true(at < s->x.cells);
        assert_int_equal(state[at], 0);
        state[at] = 2;
        at = incode_complex_cell(&s->x, at)->n[0].cell;
    }
}

/* The vertex of cell c's neighbour i that c has not.  The two share a facet,
 * which they see from opposite sides. */
static inline uint32_t scene_across(const struct scene *s, uint32_t at,
                                    unsigned i) {
    const struct incode_cell *c = incode_complex_cell(&s->x, at);
    const struct incode_cell *d = incode_complex_cell(&s->x, c->n[i].cell);
    unsigned back = 0, shared = 0, place[4], swaps = 0;
    for (unsigned k = 0; k < 4; k++)
        if (d->n[k].cell == at) {
            back = k;
            shared++;
        }
    assert_int_equal(shared, 1);
    for (unsigned k = 0; k < 4; k++) {
        place[k] = incode_cell_index(d, k == i ? d->v[back] : c->v[k]);
        assert_true(place[k] < 4);
        for (unsigned j = 0; j < k; j++) {
            assert_int_not_equal(place[j], place[k]);
            swaps += place[j] > place[k];
        }
    }
    assert_int_equal(swaps % 2, 1);
    assert_int_not_equal(d->v[back], c->v[i]);
    return d->v[back];
}

/* Positive orientation, empty spheres, a convex hull. */
static inline void scene_check_cell(struct scene *s, uint32_t at) {
    const struct incode_cell *c = incode_complex_cell(&s->x, at);
    unsigned beyond = incode_cell_index(c, INCODE_COMPLEX_INFINITE);
    for (unsigned i = 0; i < 4; i++) {
        assert_true(c->v[i] < s->x.points);
        assert_true(incode_complex_is_vertex(&s->x, c->v[i]));
        for (unsigned k = 0; k < i; k++)
            assert_int_not_equal(c->v[k], c->v[i]);
    }
    if (beyond == 4)
        assert_true(scene_orient(s, c, 0, c->v[0]) > 0);
    for (unsigned i = 0; i < 4; i++) {
        uint32_t v = scene_across(s, at, i);
        if (beyond == 4 && v != INCODE_COMPLEX_INFINITE) {
            assert_true(scene_outside(s, c, v));
        } else if (beyond != 4 && i != beyond) {
            int sign = scene_orient(s, c, beyond, v);
            assert_true(sign <= 0);
            if (sign == 0)
                assert_true(scene_outside(
                    s, incode_complex_cell(&s->x, c->n[beyond].cell), v));
        }
    }
}

/* The link of a vertex is one sphere: its n triangles are connected and have
 * n / 2 + 2 corners.  Returns n. */
static inline uint32_t scene_check_link(const struct scene *s, uint32_t v,
                                        uint32_t *cell_seen,
                                        uint32_t *point_seen, uint32_t *list) {
    uint32_t count = 1, corners = 0;
    list[0] = s->x.point[v].cell;
    cell_seen[list[0]] = v;
    for (uint32_t done = 0; done < count; done++) {
        const struct incode_cell *c = incode_complex_cell(&s->x, list[done]);
        assert_true(incode_cell_index(c, v) < 4);
        for (unsigned i = 0; i < 4; i++) {
            if (c->v[i] == v)
                continue;
            corners += point_seen[c->v[i]] != v;
            point_seen[c->v[i]] = v;
            if (cell_seen[c->n[i].cell] != v) {
                cell_seen[c->n[i].cell] = v;
                list[count++] = c->n[i].cell;
            }
        }
    }
    assert_int_equal(2 * corners, count + 4);
    return count;
}

static inline void scene_check_links(const struct scene *s, uint8_t *state,
                                     uint32_t *list, uint32_t live) {
    uint32_t *seen = malloc((s->x.cells + s->x.points) * sizeof *seen);
    uint32_t corners = 0;
    assert_non_null(seen);
    memset(seen, 0xff, (s->x.cells + s->x.points) * sizeof *seen);
    for (uint32_t v = 0; v < s->x.points; v++) {
        if (!incode_complex_is_vertex(&s->x, v))
            continue;
        assert_true(s->x.point[v].cell < s->x.cells);
        assert_int_equal(state[s->x.point[v].cell], 1);
        corners += scene_check_link(s, v, seen, seen + s->x.cells, list);
    }
    assert_int_equal(corners, 4 * live);
    free(seen);
}

/* Whether all is the Delaunay triangulation of the vertices, by its local
 * properties. */
static inline void scene_check(struct scene *s) {
    uint8_t *state = malloc(s->x.cells);
    uint32_t *list = malloc(s->x.cells * sizeof *list);
    assert_non_null(state);
    assert_non_null(list);
    uint32_t live = scene_reach(s, state, list);
    scene_check_free(s, state, live);
    for (uint32_t i = 0; i < live; i++)
        scene_check_cell(s, list[i]);
    scene_check_links(s, state, list, live);
    free(list);
    free(state);
}

/* ---- building ---- */

/* The first four of n points from `first` on that span space; false: none. */
static inline bool scene_four(struct scene *s, uint32_t first, uint32_t n,
                              uint32_t four[4]) {
    const struct incode_complex_point *q = s->x.point;
    uint32_t i = first + 2, k;
    while (i < first + n &&
           incode_collinear(q[first].p, q[first + 1].p, q[i].p))
        i++;
    if (i >= first + n)
        return false;
    for (k = i + 1; k < first + n; k++)
        if (incode_orient3d(&s->tally, q[first].p, q[first + 1].p, q[i].p,
                            q[k].p) != 0)
            break;
    const uint32_t found[4] = {first, first + 1, i, k};
    memcpy(four, found, sizeof found);
    return k < first + n;
}

/* An inserted vertex by chance. */
static inline uint32_t scene_near(struct scene *s) {
    uint32_t v;
    do {
        v = scene_draw(&s->seed, s->x.points);
    } while (!incode_complex_is_vertex(&s->x, v));
    return v;
}

/* Adds the n rows in this order and inserts them, four that span space first;
 * false: there are none. */
static inline bool scene_build(struct scene *s, const double (*p)[3],
                               const uint32_t *row, uint32_t n) {
    uint32_t four[4], first = s->x.points;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t v = incode_complex_add(&s->x, p[row[i]], row[i]);
        assert_int_equal(v, first + i);
        assert_false(incode_complex_is_vertex(&s->x, v));
    }
    if (!scene_four(s, first, n, four))
        return false;
    assert_true(incode_complex_begin(&s->x, &s->tally, four));
    for (uint32_t v = first; v < first + n; v++) {
        if (s->each)
            scene_check(s);
        if (!incode_complex_is_vertex(&s->x, v))
            assert_true(
                incode_complex_insert(&s->x, &s->tally, v, scene_near(s)));
        assert_true(incode_complex_is_vertex(&s->x, v));
    }
    scene_check(s);
    return true;
}

/* ---- what came of it ---- */

static inline void scene_append(struct host_tetrahedra *tets, uint32_t a,
                                uint32_t b, uint32_t c, uint32_t d) {
    struct host_error error = {0};
    uint32_t(*to)[4] = host_tetrahedra_room(tets, 1, &error);
    const uint32_t t[4] = {a, b, c, d};
    assert_non_null(to);
    memcpy(to, t, sizeof t);
    host_tetrahedra_keep(tets, 1);
}

/* The finite cells as rows, in canonical order. */
static inline void scene_tetrahedra(const struct scene *s,
                                    struct host_tetrahedra *tets) {
    const struct incode_complex_point *q = s->x.point;
    uint8_t *state = malloc(s->x.cells);
    uint32_t *list = malloc(s->x.cells * sizeof *list);
    assert_non_null(state);
    assert_non_null(list);
    uint32_t live = scene_reach(s, state, list);
    for (uint32_t i = 0; i < live; i++) {
        const struct incode_cell *c = incode_complex_cell(&s->x, list[i]);
        if (!incode_cell_is_infinite(c))
            scene_append(tets, q[c->v[0]].id, q[c->v[1]].id, q[c->v[2]].id,
                         q[c->v[3]].id);
    }
    host_tetrahedra_sort(tets);
    free(list);
    free(state);
}

/* Whether its finite cells are these. */
static inline void scene_compare(const struct scene *s,
                                 const struct host_tetrahedra *expected) {
    struct host_tetrahedra tets = {0};
    scene_tetrahedra(s, &tets);
    assert_int_equal(tets.count, expected->count);
    assert_memory_equal(tets.v, expected->v, tets.count * sizeof *tets.v);
    host_tetrahedra_free(&tets);
}

/* 0 to n - 1, shuffled. */
static inline void scene_shuffle(uint64_t *seed, uint32_t *row, uint32_t n) {
    for (uint32_t i = 0; i < n; i++) {
        uint32_t k = scene_draw(seed, i + 1);
        row[i] = row[k];
        row[k] = i;
    }
}

#endif
