/* Insertions where any number of cells gives way: lists go through the cells
 * themselves. */
#include <string.h>

#include "cavity.h"
#include "incode/predicates/check.h"
#include "sphere.h"

/* In a cell that gives way, a neighbour that takes its place at a facet of the
 * boundary. */
#define NEW (UINT32_C(1) << 23)

enum {
    BATCH = 32, /* spheres at a time */
    BATCH_UNITS = BATCH / INCODE_SPHERE_BATCH * INCODE_SPHERE_UNITS
};

/* In a cell that gives way, instead of its sphere: the next of the list. */
static uint32_t next_of(const struct incode_cell *c) {
    uint32_t next;
    memcpy(&next, c->sphere, sizeof next);
    return next;
}

static void set_next(struct incode_cell *c, uint32_t next) {
    memcpy(c->sphere, &next, sizeof next);
}

/* Lists the cells that give way; returns how many facets are around them. */
static uint32_t find(struct incode_complex *x, struct incode_tally *tally,
                     const double p[3], uint32_t first) {
    uint32_t last = first, facets = 0;
    struct incode_cell *c = incode_complex_cell(x, first);
    c->flags |= INCODE_CELL_GOES;
    set_next(c, INCODE_NONE);
    for (uint32_t at = first; at != INCODE_NONE; at = next_of(c)) {
        c = incode_complex_cell(x, at);
        incode_breathe(&tally->pause, 4);
        for (unsigned i = 0; i < 4; i++) {
            uint32_t next = c->n[i].cell;
            struct incode_cell *n = incode_complex_cell(x, next);
            if (incode_cell_mark(n) == 0 &&
                incode_complex_gives_way(x, tally, n, p)) {
                n->flags |= INCODE_CELL_GOES;
                set_next(n, INCODE_NONE);
                set_next(incode_complex_cell(x, last), next);
                last = next;
            } else if (incode_cell_mark(n) != INCODE_CELL_GOES) {
                n->flags |= INCODE_CELL_STAYS;
                facets++;
            }
        }
    }
    return facets;
}

/* Takes the marks away and brings the spheres back. */
static void forget(struct incode_complex *x, struct incode_pause *pause,
                   uint32_t first) {
    uint32_t next;
    for (uint32_t at = first; at != INCODE_NONE; at = next) {
        struct incode_cell *c = incode_complex_cell(x, at);
        unsigned proved = incode_cell_proved(c);
        next = next_of(c);
        incode_breathe(pause, INCODE_SPHERE_UNITS);
        incode_complex_set_spheres(x, c->v[3], &at, 1);
        incode_cell_set_proved(c, proved);
        for (unsigned i = 0; i < 4; i++)
            incode_cell_unmark(incode_complex_cell(x, c->n[i].cell));
    }
}

/* Puts a cell between each facet of the boundary and the new point. */
static void fill(struct incode_complex *x, struct incode_pause *pause,
                 uint32_t first, uint32_t v) {
    struct incode_cell *c;
    uint32_t some[BATCH], count = 0;
    for (uint32_t at = first; at != INCODE_NONE; at = next_of(c)) {
        c = incode_complex_cell(x, at);
        incode_breathe(pause, 1);
        for (unsigned i = 0; i < 4; i++) {
            struct incode_cell *n = incode_complex_cell(x, c->n[i].cell);
            if (incode_cell_mark(n) != INCODE_CELL_STAYS)
                continue;
            uint32_t new = incode_complex_take_cell(x);
            struct incode_cell *d = incode_complex_cell(x, new);
            for (unsigned k = 0; k < 3; k++) {
                d->v[k] = c->v[incode_cell_facet[i][k]];
                x->point[d->v[k]].cell = new;
            }
            d->v[3] = (uint16_t)v;
            incode_cell_join(d, 3, c->n[i].cell);
            for (unsigned k = 0; k < 4; k++)
                incode_cell_join(n, k, n->n[k].cell == at ? new : n->n[k].cell);
            incode_cell_join(c, i, new | NEW);
            x->point[v].cell = new;
            some[count++] = new;
            if (count == BATCH) {
                incode_breathe(pause, BATCH_UNITS);
                incode_complex_set_spheres(x, v, some, count);
                count = 0;
            }
        }
    }
    incode_breathe(pause, BATCH_UNITS);
    incode_complex_set_spheres(x, v, some, count);
}

/* The new cell beyond the facet of the new point and the edge of a cell that
 * gives way, at facet j, without its vertices i and j: around the edge, through
 * the cells that give way.  `pivot`, beside the edge, is what the next cell is
 * left opposite to. */
static uint32_t around_edge(const struct incode_complex *x,
                            struct incode_pause *pause, uint32_t at, unsigned i,
                            unsigned j) {
    const struct incode_cell *c = incode_complex_cell(x, at);
    uint32_t next = c->n[i].cell;
    uint16_t pivot = c->v[j];
    while ((next & NEW) == 0) {
        const struct incode_cell *d = incode_complex_cell(x, next);
        unsigned back = 0;
        incode_breathe(pause, 1);
        while (d->n[back].cell != at)
            back++;
        at = next;
        next = d->n[incode_cell_index(d, pivot)].cell;
        pivot = d->v[back];
    }
    return next & ~NEW;
}

/* Joins the new cells to each other. */
static void join(struct incode_complex *x, struct incode_pause *pause,
                 uint32_t first) {
    const struct incode_cell *c;
    for (uint32_t at = first; at != INCODE_NONE; at = next_of(c)) {
        c = incode_complex_cell(x, at);
        for (unsigned j = 0; j < 4; j++) {
            if ((c->n[j].cell & NEW) == 0)
                continue;
            struct incode_cell *d = incode_complex_cell(x, c->n[j].cell & ~NEW);
            incode_cell_unmark(incode_complex_cell(x, d->n[3].cell));
            incode_breathe(pause, 1);
            for (unsigned k = 0; k < 3; k++)
                incode_cell_join(d, k,
                                 around_edge(x, pause, at,
                                             incode_cell_index(c, d->v[k]), j));
        }
    }
}

enum incode_cavity_result
incode_complex_insert_large(struct incode_complex *x,
                            struct incode_tally *tally, uint32_t v,
                            uint32_t first) {
    struct incode_pause *pause = &tally->pause;
    uint32_t facets = find(x, tally, x->point[v].p, first);
    if (!incode_complex_has_room(x, 0, facets)) {
        forget(x, pause, first);
        return INCODE_CAVITY_FULL;
    }
    fill(x, pause, first, v);
    join(x, pause, first);
    /* What gave way is free. */
    uint32_t next;
    for (uint32_t at = first; at != INCODE_NONE; at = next) {
        next = next_of(incode_complex_cell(x, at));
        incode_breathe(pause, 1);
        incode_complex_free_cell(x, at);
    }
    return INCODE_CAVITY_FILLED;
}

/* Where a cell's neighbour is in it. */
static unsigned side_of(const struct incode_cell *c, uint32_t neighbour) {
    return c->n[0].cell == neighbour   ? 0
           : c->n[1].cell == neighbour ? 1
           : c->n[2].cell == neighbour ? 2
                                       : 3;
}

/* Returns whether it was proved. */
static uint32_t disprove(struct incode_cell *c) {
    uint32_t was = incode_cell_proved(c) != 0;
    c->flags ^= INCODE_CELL_GOES;
    incode_cell_set_proved(c, 0);
    return was;
}

/* Goes through a cavity from one of its cells, depth first, with the way back
 * in the cells, and marks them; the second time it takes the marks away. */
static uint32_t go_through(struct incode_complex *x, struct incode_tally *tally,
                           const double p[3], uint32_t first, bool again,
                           uint32_t *were) {
    uint32_t at = first, count = 1;
    unsigned i = 0;
    *were += disprove(incode_complex_cell(x, first));
    while (i < 4 || at != first) {
        const struct incode_cell *c = incode_complex_cell(x, at);
        incode_breathe(&tally->pause, 1);
        if (i == 4) {
            uint32_t before = c->n[c->n[3].low].cell;
            i = side_of(incode_complex_cell(x, before), at) + 1;
            at = before;
            continue;
        }
        uint32_t next = c->n[i].cell;
        struct incode_cell *n = incode_complex_cell(x, next);
        if (again ? incode_cell_mark(n) != 0
                  : incode_cell_mark(n) == 0 &&
                        incode_complex_gives_way(x, tally, n, p)) {
            *were += disprove(n);
            n->n[3].low = (uint8_t)side_of(n, at);
            at = next;
            i = 0;
            count++;
        } else {
            i++;
        }
    }
    return count;
}

uint32_t incode_complex_disprove(struct incode_complex *x,
                                 struct incode_tally *tally, const double p[3],
                                 uint32_t near, uint32_t *were) {
    INCODE_ASSERT(near < x->points && incode_complex_is_vertex(x, near));
    uint32_t first = incode_complex_locate(x, tally, x->point[near].cell, p);
    *were = 0;
    if (first == INCODE_NONE)
        return 0;
    (void)go_through(x, tally, p, first, false, were);
    return go_through(x, tally, p, first, true, were);
}
