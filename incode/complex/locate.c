#include <string.h>

#include "cavity.h"
#include "incode/predicates/check.h"

enum { INFINITE = INCODE_COMPLEX_INFINITE };

/* orient3d of a cell with p in the place of its vertex i. */
static int orient_with(const struct incode_complex *x,
                       struct incode_tally *tally, const struct incode_cell *c,
                       unsigned i, const double p[3]) {
    const double *q[4];
    for (unsigned k = 0; k < 4; k++)
        q[k] = k == i ? p : x->point[c->v[k]].p;
    return incode_orient3d(tally, q[0], q[1], q[2], q[3]);
}

/* Whether it stands for cells that have been released. */
static bool is_gone(const struct incode_complex *x,
                    const struct incode_cell *c) {
    return c > incode_complex_cell(x, INCODE_COMPLEX_CELLS_FIRST);
}

bool incode_complex_holds(const struct incode_complex *x,
                          struct incode_tally *tally,
                          const struct incode_cell *c, const double p[3]) {
    unsigned i = incode_cell_index(c, INFINITE);
    if (is_gone(x, c))
        return false;
    if (i < 4) {
        int sign = orient_with(x, tally, c, i, p);
        if (sign != 0)
            return sign > 0;
        /* In the facet's plane its circle decides, which the sphere beyond it
         * shares. */
        c = incode_complex_cell(x, c->n[i].cell);
        if (is_gone(x, c))
            return false;
    }
    return incode_in_sphere(tally, x->point[c->v[0]].p, x->point[c->v[1]].p,
                            x->point[c->v[2]].p, x->point[c->v[3]].p, p) > 0;
}

/* Whether a vertex of the cell is at p. */
static bool has_point(const struct incode_complex *x,
                      const struct incode_cell *c, const double p[3]) {
    for (unsigned i = 0; i < 4; i++)
        if (c->v[i] != INFINITE &&
            incode_lexicographic(x->point[c->v[i]].p, p) == 0)
            return true;
    return false;
}

bool incode_complex_gives_way(const struct incode_complex *x,
                              struct incode_tally *tally,
                              const struct incode_cell *c, const double p[3]) {
    double bound, t = incode_sphere_power(x->point, c, p, &bound);
    return t < -bound || (!(t > bound) && !has_point(x, c, p) &&
                          incode_complex_holds(x, tally, c, p));
}

/* From a finite cell downhill: to the neighbour of which p has the least power,
 * as computed, as long as that decreases.  The facet between two spheres is in
 * the plane where their powers are equal, so downhill is towards p. */
static uint32_t descend(const struct incode_complex *x,
                        struct incode_tally *tally, uint32_t at,
                        const double p[3], bool *found) {
    double bound, least;
    const struct incode_cell *c = incode_complex_cell(x, at);
    least = incode_sphere_power(x->point, c, p, &bound);
    *found = least < -bound;
    while (!*found) {
        uint32_t next = INCODE_NONE;
        incode_yield_after(&tally->yield, 3);
        for (unsigned i = 0; i < 4; i++) {
            const struct incode_cell *n = incode_complex_cell(x, c->n[i].cell);
            double t = incode_sphere_power(x->point, n, p, &bound);
            if (t < -bound) {
                *found = true;
                return c->n[i].cell;
            }
            bool better = t < least && !incode_sphere_is_infinite(n);
            least = better ? t : least;
            next = better ? c->n[i].cell : next;
        }
        if (next == INCODE_NONE)
            return at;
        at = next;
        c = incode_complex_cell(x, at);
    }
    return at;
}

/* The finite cell that p is in, or an infinite one beyond a facet that p is
 * beyond; INCODE_NONE: what has been released is on the way.  A visibility
 * walk, which ends as the triangulation is regular (Edelsbrunner, Combinatorica
 * 10, 1990). */
static uint32_t walk(const struct incode_complex *x, struct incode_tally *tally,
                     uint32_t at, const double p[3]) {
    uint32_t before = INCODE_NONE;
    for (uint32_t steps = 0; steps <= x->cells; steps++) {
        uint32_t next = INCODE_NONE;
        const struct incode_cell *c = incode_complex_cell(x, at);
        if (incode_cell_is_infinite(c))
            return at;
        incode_yield_after(&tally->yield, 4);
        bool barred = false;
        for (unsigned i = 0; i < 4 && next == INCODE_NONE; i++) {
            if (c->n[i].cell == before || orient_with(x, tally, c, i, p) >= 0)
                continue;
            if (c->n[i].cell >= INCODE_COMPLEX_CELLS_FIRST)
                next = c->n[i].cell;
            else
                barred = true;
        }
        if (next == INCODE_NONE)
            return barred ? INCODE_NONE : at;
        before = at;
        at = next;
    }
    return INCODE_NONE; /* a point that is there already, perhaps */
}

/* Looks at all cells that are not final. */
static uint32_t scan(struct incode_complex *x, struct incode_tally *tally,
                     const double p[3]) {
    x->scans++;
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < x->cells; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        incode_yield_after(&tally->yield, 1);
        if (!incode_cell_is_free(c) &&
            incode_cell_proved(c) != INCODE_CELL_FINAL &&
            incode_complex_gives_way(x, tally, c, p))
            return i;
    }
    return INCODE_NONE;
}

/* The vertex nearest to p, up to rounding; INFINITE: squares overflow. */
static uint32_t nearest(const struct incode_complex *x,
                        struct incode_tally *tally, const double p[3]) {
    uint32_t best = INFINITE;
    double least = __builtin_inf();
    for (uint32_t v = 1; v < x->points; v++) {
        const struct incode_complex_point *q = &x->point[v];
        double square = 0;
        if (v % 8 == 0)
            incode_yield_after(&tally->yield, 2);
        for (int d = 0; d < 3; d++)
            square += (q->p[d] - p[d]) * (q->p[d] - p[d]);
        if (square < least && q->cell != INCODE_NONE) {
            least = square;
            best = v;
        }
    }
    return best;
}

/* From one cell on; INCODE_NONE: what has been released is on the way. */
static uint32_t go(const struct incode_complex *x, struct incode_tally *tally,
                   uint32_t from, const double p[3]) {
    bool found = false;
    const struct incode_cell *c = incode_complex_cell(x, from);
    unsigned i = incode_cell_index(c, INFINITE);
    from = i < 4 ? c->n[i].cell : from;
    if (from < INCODE_COMPLEX_CELLS_FIRST)
        return INCODE_NONE;
    from = descend(x, tally, from, p, &found);
    return found ? from : walk(x, tally, from, p);
}

/* Where the way is barred, it may be free from the nearest vertex, which has a
 * cell that holds p. */
uint32_t incode_complex_locate(struct incode_complex *x,
                               struct incode_tally *tally, uint32_t from,
                               const double p[3]) {
    from = go(x, tally, from, p);
    if (from == INCODE_NONE) {
        uint32_t near = nearest(x, tally, p);
        x->searches++;
        if (near != INFINITE)
            from = go(x, tally, x->point[near].cell, p);
    }
    if (from == INCODE_NONE)
        from = scan(x, tally, p);
    return from != INCODE_NONE && has_point(x, incode_complex_cell(x, from), p)
               ? INCODE_NONE
               : from;
}

/* Insertions where any number of cells gives way: lists go through the cells
 * themselves. */

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
        incode_yield_after(&tally->yield, 4);
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
static void forget(struct incode_complex *x, struct incode_yield *yield,
                   uint32_t first) {
    uint32_t next;
    for (uint32_t at = first; at != INCODE_NONE; at = next) {
        struct incode_cell *c = incode_complex_cell(x, at);
        unsigned proved = incode_cell_proved(c);
        next = next_of(c);
        incode_yield_after(yield, INCODE_SPHERE_UNITS);
        incode_complex_set_spheres(x, c->v[3], &at, 1);
        incode_cell_set_proved(c, proved);
        for (unsigned i = 0; i < 4; i++)
            incode_cell_unmark(incode_complex_cell(x, c->n[i].cell));
    }
}

/* Puts a cell between each facet of the boundary and the new point. */
static void fill(struct incode_complex *x, struct incode_yield *yield,
                 uint32_t first, uint32_t v) {
    struct incode_cell *c;
    uint32_t some[BATCH], count = 0;
    for (uint32_t at = first; at != INCODE_NONE; at = next_of(c)) {
        c = incode_complex_cell(x, at);
        incode_yield_after(yield, 1);
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
                incode_yield_after(yield, BATCH_UNITS);
                incode_complex_set_spheres(x, v, some, count);
                count = 0;
            }
        }
    }
    incode_yield_after(yield, BATCH_UNITS);
    incode_complex_set_spheres(x, v, some, count);
}

/* The new cell beyond the facet of the new point and the edge of a cell that
 * gives way, at facet j, without its vertices i and j: around the edge, through
 * the cells that give way.  `pivot`, beside the edge, is what the next cell is
 * left opposite to. */
static uint32_t around_edge(const struct incode_complex *x,
                            struct incode_yield *yield, uint32_t at, unsigned i,
                            unsigned j) {
    const struct incode_cell *c = incode_complex_cell(x, at);
    uint32_t next = c->n[i].cell;
    uint16_t pivot = c->v[j];
    while ((next & NEW) == 0) {
        const struct incode_cell *d = incode_complex_cell(x, next);
        unsigned back = 0;
        incode_yield_after(yield, 1);
        while (d->n[back].cell != at)
            back++;
        at = next;
        next = d->n[incode_cell_index(d, pivot)].cell;
        pivot = d->v[back];
    }
    return next & ~NEW;
}

/* Joins the new cells to each other. */
static void join(struct incode_complex *x, struct incode_yield *yield,
                 uint32_t first) {
    const struct incode_cell *c;
    for (uint32_t at = first; at != INCODE_NONE; at = next_of(c)) {
        c = incode_complex_cell(x, at);
        for (unsigned j = 0; j < 4; j++) {
            if ((c->n[j].cell & NEW) == 0)
                continue;
            struct incode_cell *d = incode_complex_cell(x, c->n[j].cell & ~NEW);
            incode_cell_unmark(incode_complex_cell(x, d->n[3].cell));
            incode_yield_after(yield, 1);
            for (unsigned k = 0; k < 3; k++)
                incode_cell_join(d, k,
                                 around_edge(x, yield, at,
                                             incode_cell_index(c, d->v[k]), j));
        }
    }
}

enum incode_cavity_result
incode_complex_insert_large(struct incode_complex *x,
                            struct incode_tally *tally, uint32_t v,
                            uint32_t first) {
    struct incode_yield *yield = &tally->yield;
    uint32_t facets = find(x, tally, x->point[v].p, first);
    if (!incode_complex_has_room(x, 0, facets)) {
        forget(x, yield, first);
        return INCODE_CAVITY_FULL;
    }
    fill(x, yield, first, v);
    join(x, yield, first);
    /* What gave way is free. */
    uint32_t next;
    for (uint32_t at = first; at != INCODE_NONE; at = next) {
        next = next_of(incode_complex_cell(x, at));
        incode_yield_after(yield, 1);
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
        incode_yield_after(&tally->yield, 1);
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
