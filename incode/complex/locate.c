#include "cavity.h"
#include "sphere.h"

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
        incode_breathe(&tally->pause, 3);
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
        incode_breathe(&tally->pause, 4);
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
        incode_breathe(&tally->pause, 1);
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
            incode_breathe(&tally->pause, 2);
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
