/* What the cavity of a point is, by exact predicates for every cell there is,
 * and whether a complex tells the same of it. */
#ifndef TESTS_UNIT_CAVITY_SCENE_H
#define TESTS_UNIT_CAVITY_SCENE_H

#include "complex_scene.h"

/* Whether p is in a cell's sphere or beyond its facet; in the facet's plane its
 * circle decides.  A sphere that has been released holds nothing that comes. */
static inline bool scene_holds(struct scene *s, const struct incode_cell *c,
                               const double p[3]) {
    const double *q[4];
    unsigned k = incode_cell_index(c, INCODE_COMPLEX_INFINITE);
    for (unsigned i = 0; i < 4; i++)
        q[i] = i == k ? p : s->x.point[c->v[i]].p;
    if (k < 4) {
        int sign = incode_orient3d(&s->tally, q[0], q[1], q[2], q[3]);
        if (sign != 0)
            return sign > 0;
        if (c->n[k].cell < INCODE_COMPLEX_CELLS_FIRST)
            return false;
        c = incode_complex_cell(&s->x, c->n[k].cell);
        for (unsigned i = 0; i < 4; i++)
            q[i] = s->x.point[c->v[i]].p;
    }
    return incode_in_sphere(&s->tally, q[0], q[1], q[2], q[3], p) > 0;
}

/* What an owner puts down of a cell here: 1 to 3. */
static inline unsigned scene_proof(uint32_t cell) {
    return 1 + cell % 3;
}

static inline void scene_prove_all(struct scene *s) {
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < s->x.cells; i++) {
        struct incode_cell *c = incode_complex_cell(&s->x, i);
        if (!incode_cell_is_free(c))
            incode_cell_set_proved(c, scene_proof(i));
    }
}

static inline void scene_prove_none(struct scene *s) {
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < s->x.cells; i++) {
        struct incode_cell *c = incode_complex_cell(&s->x, i);
        if (!incode_cell_is_free(c))
            incode_cell_set_proved(c, 0);
    }
}

/* Every byte of the cells, the first at the end. */
static inline struct incode_cell *scene_cells(const struct scene *s) {
    struct incode_cell *copy = malloc(s->x.cells * sizeof *copy);
    assert_non_null(copy);
    memcpy(copy, incode_complex_cell(&s->x, s->x.cells - 1),
           s->x.cells * sizeof *copy);
    return copy;
}

/* Which cells hold p: 1 in `hold`; how many. */
static inline uint32_t scene_cavity(struct scene *s, const double p[3],
                                    uint8_t *hold) {
    uint32_t count = 0;
    memset(hold, 0, s->x.cells);
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < s->x.cells; i++) {
        const struct incode_cell *c = incode_complex_cell(&s->x, i);
        hold[i] = !incode_cell_is_free(c) && scene_holds(s, c, p);
        count += hold[i];
    }
    return count;
}

/* Those of `hold` are listed, each once, or there are too many; no cell is
 * touched. */
static inline bool scene_check_listed(struct scene *s, const double p[3],
                                      const uint8_t *hold, uint32_t count) {
    uint32_t cells[INCODE_COMPLEX_CAVITY];
    uint8_t *left = malloc(s->x.cells);
    struct incode_cell *before = scene_cells(s);
    assert_non_null(left);
    memcpy(left, hold, s->x.cells);
    uint32_t listed =
        incode_complex_cavity(&s->x, &s->tally, p, scene_near(s), cells);
    assert_memory_equal(before, incode_complex_cell(&s->x, s->x.cells - 1),
                        s->x.cells * sizeof *before);
    if (listed == INCODE_NONE) {
        /* Those around them count, too, of which each has four at most. */
        assert_true(1 + 4 * count > INCODE_COMPLEX_CAVITY);
    } else {
        assert_int_equal(listed, count);
        for (uint32_t i = 0; i < listed; i++) {
            assert_true(cells[i] < s->x.cells);
            assert_int_equal(left[cells[i]], 1);
            left[cells[i]] = 0;
        }
    }
    free(before);
    free(left);
    return listed != INCODE_NONE;
}

/* Of the cells of `hold` nothing is put down any more; nothing else is another,
 * but for what is of a walk. */
static inline void scene_check_disproved(struct scene *s, const double p[3],
                                         const uint8_t *hold) {
    struct incode_cell *before = scene_cells(s);
    uint32_t were, hold_it = 0, proved = 0;
    uint32_t count =
        incode_complex_disprove(&s->x, &s->tally, p, scene_near(s), &were);
    for (uint32_t i = 0; i < s->x.cells; i++) {
        struct incode_cell old = before[s->x.cells - 1 - i];
        struct incode_cell new = *incode_complex_cell(&s->x, i);
        hold_it += hold[i] != 0;
        proved += hold[i] != 0 && incode_cell_proved(&old) != 0;
        if (hold[i] != 0)
            incode_cell_set_proved(&old, 0);
        else
            assert_int_equal(new.n[3].low, old.n[3].low);
        new.n[3].low = old.n[3].low;
        assert_int_equal(new.flags, old.flags);
        assert_memory_equal(&new, &old, sizeof new);
    }
    assert_int_equal(count, hold_it);
    assert_int_equal(were, proved);
    free(before);
}

/* All of it for a point that is no vertex; says how many cells hold it, and
 * whether they were listed.  What has been put down is as scene_prove_all
 * says, before and after. */
static inline uint32_t scene_check_cavity(struct scene *s, const double p[3],
                                          bool *listed) {
    uint8_t *hold = malloc(s->x.cells);
    assert_non_null(hold);
    uint32_t count = scene_cavity(s, p, hold);
    *listed = scene_check_listed(s, p, hold, count);
    scene_check_disproved(s, p, hold);
    for (uint32_t i = 0; i < s->x.cells; i++)
        if (hold[i] != 0)
            incode_cell_set_proved(incode_complex_cell(&s->x, i),
                                   scene_proof(i));
    free(hold);
    return count;
}

#endif
