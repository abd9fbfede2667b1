#include "complex.h"

#include <string.h>

#include "cavity.h"
#include "incode/predicates/check.h"

enum { INFINITE = INCODE_COMPLEX_INFINITE, FIRST = INCODE_COMPLEX_CELLS_FIRST };

/* ---- memory ---- */

void incode_complex_init(struct incode_complex *x, void *memory, size_t bytes) {
    memset(x, 0, sizeof *x);
    x->point = memory;
    x->bytes = bytes / 8 * 8;
    uint8_t *end = (uint8_t *)memory + x->bytes;
    x->cell = (struct incode_cell *)(void *)(end - sizeof(struct incode_cell));
    incode_complex_clear(x);
}

void incode_complex_reserve(struct incode_complex *x, uint32_t points) {
    x->points_kept = points;
}

/* Whether so many more points and cells fit. */
bool incode_complex_has_room(const struct incode_complex *x, uint32_t points,
                             uint32_t cells) {
    uint32_t fresh = cells > x->free_count ? cells - x->free_count : 0;
    uint32_t all = x->points + points;
    all = all < x->points_kept ? x->points_kept : all;
    size_t used =
        all * sizeof *x->point + (x->cells + (size_t)fresh) * sizeof *x->cell;
    return used <= x->bytes &&
           x->points + points <= INCODE_COMPLEX_POINTS_MAX &&
           x->cells + fresh <= INCODE_COMPLEX_CELLS_MAX;
}

uint32_t incode_complex_take_cell(struct incode_complex *x) {
    uint32_t i = x->free;
    if (x->free_count == 0)
        return x->cells++;
    x->free = incode_complex_cell(x, i)->n[0].cell;
    x->free_count--;
    return i;
}

void incode_complex_free_cell(struct incode_complex *x, uint32_t i) {
    struct incode_cell *c = incode_complex_cell(x, i);
    c->v[0] = c->v[1];
    incode_cell_join(c, 0, x->free);
    x->free = i;
    x->free_count++;
}

uint32_t incode_complex_add(struct incode_complex *x, const double p[3],
                            uint32_t id) {
    uint32_t v = x->free_point;
    if (v == 0 && !incode_complex_has_room(x, 1, 0))
        return INCODE_NONE;
    if (v == 0)
        v = x->points++;
    else
        x->free_point = x->point[v].id;
    struct incode_complex_point *point = &x->point[v];
    memcpy(point->p, p, sizeof point->p);
    point->id = id;
    point->cell = INCODE_NONE;
    return v;
}

void incode_complex_clear(struct incode_complex *x) {
    const double nowhere[3] = {0, 0, 0};
    x->points = x->cells = x->free_count = 0;
    x->free_point = 0;
    (void)incode_complex_add(x, nowhere, INCODE_NONE);
}

/* ---- the first cells ---- */

/* What stands for released cells: infinite, and nothing is known of it. */
static void set_gone(struct incode_complex *x) {
    for (uint32_t i = 0; i < FIRST; i++) {
        struct incode_cell *c = incode_complex_cell(x, i);
        memset(c, 0, sizeof *c);
        for (unsigned k = 0; k < 4; k++)
            incode_cell_join(c, k, INCODE_CELL_NONE);
        c->scale = 0xff; /* with the next bits, an exponent of infinity */
        c->flags = INCODE_CELL_SCALE | INCODE_CELL_INFINITE;
    }
}

/* Brings the last vertex elsewhere. */
static void rotate(struct incode_cell *c) {
    struct incode_cell d = *c;
    for (unsigned i = 0; i < 4; i++) {
        /* 0 1 2 3 to 3 0 2 1 */
        unsigned from = i == 0 ? 3 : i == 1 ? 0 : i == 2 ? 2 : 1;
        c->v[i] = d.v[from];
        c->n[i] = d.n[from];
    }
}

bool incode_complex_begin(struct incode_complex *x, struct incode_tally *tally,
                          const uint32_t four[4]) {
    struct incode_complex_point *v = x->point;
    int sign = incode_orient3d(tally, v[four[0]].p, v[four[1]].p, v[four[2]].p,
                               v[four[3]].p);
    INCODE_ASSERT(x->cells == 0);
    if (sign == 0 || !incode_complex_has_room(x, 0, FIRST + 5))
        return false;
    set_gone(x);
    x->cells = FIRST + 5;
    uint32_t second = four[sign > 0 ? 1 : 2], third = four[sign > 0 ? 2 : 1];
    *incode_complex_cell(x, FIRST) = (struct incode_cell){
        .v = {(uint16_t)four[0], (uint16_t)second, (uint16_t)third,
              (uint16_t)four[3]},
        .n = {{FIRST + 1, 0}, {FIRST + 2, 0}, {FIRST + 3, 0}, {FIRST + 4, 0}}};
    v[INFINITE].cell = FIRST + 1;
    for (unsigned i = 0; i < 4; i++)
        v[four[i]].cell = FIRST;
    for (unsigned i = 0; i < 4; i++) {
        /* The mirror of the first: vertex i is infinite, two others swapped. */
        struct incode_cell *c = incode_complex_cell(x, FIRST + 1 + i);
        unsigned a = (i + 1) % 4, b = (i + 2) % 4;
        *c = *incode_complex_cell(x, FIRST);
        c->v[i] = INFINITE;
        uint16_t first = c->v[a];
        c->v[a] = c->v[b];
        c->v[b] = first;
        for (unsigned k = 0; k < 4; k++)
            incode_cell_join(c, k,
                             FIRST + (k == i   ? 0
                                      : k == a ? b + 1
                                      : k == b ? a + 1
                                               : k + 1));
        if (i == 3)
            rotate(c);
    }
    for (uint32_t i = FIRST; i < FIRST + 5; i++)
        incode_complex_set_spheres(x, incode_complex_cell(x, i)->v[3], &i, 1);
    return true;
}

/* ---- insertion ---- */

bool incode_complex_insert(struct incode_complex *x, struct incode_tally *tally,
                           uint32_t v, uint32_t near) {
    INCODE_ASSERT(v < x->points && near < x->points && x->cells > 0 &&
                  !incode_complex_is_vertex(x, v) &&
                  incode_complex_is_vertex(x, near));
    uint32_t first =
        incode_complex_locate(x, tally, x->point[near].cell, x->point[v].p);
    if (first == INCODE_NONE)
        return false;
    enum incode_cavity_result r =
        incode_complex_insert_small(x, tally, v, first);
    if (r == INCODE_CAVITY_LARGE)
        r = incode_complex_insert_large(x, tally, v, first);
    return r == INCODE_CAVITY_FILLED;
}

static uint32_t
incode_complex_find_small(struct incode_complex *x, struct incode_tally *tally,
                          const double p[3], uint32_t first,
                          uint32_t cells[INCODE_COMPLEX_CAVITY]);

uint32_t incode_complex_cavity(struct incode_complex *x,
                               struct incode_tally *tally, const double p[3],
                               uint32_t near,
                               uint32_t cells[INCODE_COMPLEX_CAVITY]) {
    INCODE_ASSERT(near < x->points && incode_complex_is_vertex(x, near));
    uint32_t first = incode_complex_locate(x, tally, x->point[near].cell, p);
    return first == INCODE_NONE
               ? 0
               : incode_complex_find_small(x, tally, p, first, cells);
}

/* Insertions where few cells give way: all lists are on the stack, and hardly a
 * branch depends on what the points are. */

enum {
    FACETS_MAX = 220,
    POINTS_MAX = FACETS_MAX / 2 + 2,
    SLOTS_MAX = FACETS_MAX + INCODE_SPHERE_BATCH,
    LOOKED_AT_MAX = INCODE_COMPLEX_CAVITY, /* cells */
    AT_ONCE = 64,                          /* of them between two yields */
    WRITTEN = 40,                          /* new ones, likewise */
    WRITTEN_UNITS = WRITTEN / INCODE_SPHERE_BATCH * INCODE_SPHERE_UNITS
};

struct cavity {
    uint32_t gone, looked_at, facets;
    uint32_t cell[LOOKED_AT_MAX];   /* those that give way */
    uint32_t other[LOOKED_AT_MAX];  /* those looked at, with these */
    uint32_t facet[FACETS_MAX + 4]; /* 4 times the cell, and its index in it */
};

/* Takes the marks away. */
static void forget(struct incode_complex *x, const struct cavity *cavity) {
    for (uint32_t j = 0; j < cavity->looked_at; j++)
        incode_cell_unmark(incode_complex_cell(x, cavity->other[j]));
}

/* Neighbours of cells that give way, from `from` on, that were not looked at
 * yet. */
static void look_around(struct incode_complex *x, struct cavity *cavity,
                        uint32_t from) {
    struct incode_cell *cell = x->cell;
    uint32_t count = cavity->looked_at;
    for (uint32_t j = from; j < cavity->gone; j++) {
        const struct incode_cell *c = cell - cavity->cell[j];
        for (unsigned i = 0; i < 4; i++) {
            struct incode_cell *n = cell - c->n[i].cell;
            cavity->other[count] = c->n[i].cell;
            count += incode_cell_mark(n) == 0;
            n->flags |= INCODE_CELL_STAYS;
        }
    }
    cavity->looked_at = count;
}

/* Tells those of [from, end) that give way. */
static inline void tell(struct incode_complex *x, struct incode_tally *tally,
                        const double p[3], uint32_t from, uint32_t end,
                        struct cavity *cavity) {
    const struct incode_complex_point *point = x->point;
    struct incode_cell *cell = x->cell;
    uint32_t gone = cavity->gone;
    for (uint32_t j = from; j < end; j++) {
        double bound;
        struct incode_cell *c = cell - cavity->other[j];
        double t = incode_sphere_power(point, c, p, &bound);
        uint32_t goes = t < 0;
        if (__builtin_expect(!(__builtin_fabs(t) > bound), 0))
            goes = incode_complex_holds(x, tally, c, p);
        cavity->cell[gone] = cavity->other[j];
        gone += goes;
        c->flags |= (uint8_t)(2 * goes);
    }
    cavity->gone = gone;
}

/* The same of many. */
static __attribute__((noinline)) void
tell_many(struct incode_complex *x, struct incode_tally *tally,
          const double p[3], uint32_t from, struct cavity *cavity) {
    while (from < cavity->looked_at) {
        uint32_t left = cavity->looked_at - from;
        uint32_t end = from + (left < AT_ONCE ? left : AT_ONCE);
        incode_yield_after(&tally->yield, AT_ONCE);
        tell(x, tally, p, from, end, cavity);
        from = end;
    }
}

/* False: too many cells. */
static bool find(struct incode_complex *x, struct incode_tally *tally,
                 const double at[3], uint32_t first, struct cavity *cavity) {
    const double p[3] = {at[0], at[1], at[2]};
    uint32_t from = 0, due = AT_ONCE;
    incode_yield_after(&tally->yield, AT_ONCE);
    cavity->cell[0] = cavity->other[0] = first;
    cavity->gone = cavity->looked_at = 1;
    incode_complex_cell(x, first)->flags |= INCODE_CELL_GOES;
    while (from < cavity->gone) {
        uint32_t j = cavity->looked_at, gone = cavity->gone;
        if (j + 4 * (gone - from) > LOOKED_AT_MAX)
            return false;
        look_around(x, cavity, from);
        from = gone;
        if (__builtin_expect(cavity->looked_at <= due, 1)) {
            tell(x, tally, p, j, cavity->looked_at, cavity);
        } else {
            tell_many(x, tally, p, j, cavity);
            due = cavity->looked_at;
        }
    }
    return true;
}

/* The cells that hold p, as `first` does; INCODE_NONE: too many. */
static uint32_t
incode_complex_find_small(struct incode_complex *x, struct incode_tally *tally,
                          const double p[3], uint32_t first,
                          uint32_t cells[INCODE_COMPLEX_CAVITY]) {
    struct cavity cavity;
    bool all = find(x, tally, p, first, &cavity);
    forget(x, &cavity);
    memcpy(cells, cavity.cell, cavity.gone * sizeof *cells);
    return all ? cavity.gone : INCODE_NONE;
}

static bool list_facets(const struct incode_complex *x,
                        struct incode_yield *yield, struct cavity *cavity) {
    uint32_t facets = 0;
    incode_yield_after(yield, cavity->gone / 4);
    for (uint32_t j = 0; j < cavity->gone && facets <= FACETS_MAX; j++) {
        uint32_t at = cavity->cell[j];
        const struct incode_cell *c = incode_complex_cell(x, at);
        for (unsigned i = 0; i < 4; i++) {
            cavity->facet[facets] = at * 4 + i;
            facets += incode_cell_mark(incode_complex_cell(x, c->n[i].cell)) ==
                      INCODE_CELL_STAYS;
        }
    }
    cavity->facets = facets;
    return facets <= FACETS_MAX;
}

/* In `cell` of a point around the cavity, which gets another: its number. */
#define NUMBER (UINT32_C(1) << 31)

/* The new cells: on each facet of the boundary, whose points are numbered. */
struct filling {
    uint32_t cell[FACETS_MAX];
    uint32_t outer[FACETS_MAX]; /* the cell beyond the facet */
    uint8_t back[FACETS_MAX];   /* the facet's index there */
    uint16_t v[FACETS_MAX][4];
    uint8_t number[3][SLOTS_MAX]; /* of its vertices */
    uint16_t point[POINTS_MAX];   /* by number */
    uint32_t cell_of[POINTS_MAX]; /* one of its new cells */
    double p[3][POINTS_MAX];      /* as seen from the new one */
    double infinite[POINTS_MAX];
    /* The facet with the edge from one point to another. */
    uint8_t with_edge[POINTS_MAX][POINTS_MAX];
};

static void take_cells(struct incode_complex *x, const struct cavity *cavity,
                       uint32_t *cell) {
    uint32_t gone = cavity->gone, facets = cavity->facets;
    for (uint32_t f = 0; f < facets; f++)
        cell[f] = f < gone ? cavity->cell[f] : incode_complex_take_cell(x);
}

/* Those that give way and whose places nobody has taken are free. */
static void free_cells(struct incode_complex *x, const struct cavity *cavity) {
    for (uint32_t j = cavity->facets; j < cavity->gone; j++)
        incode_complex_free_cell(x, cavity->cell[j]);
}

/* Takes from the cells that give way what the new ones need to know; returns
 * how many points there are. */
static uint32_t number(struct incode_complex *x, const struct cavity *cavity,
                       struct filling *fill, uint32_t v) {
    struct incode_complex_point *point = x->point;
    struct incode_cell *cell = x->cell;
    uint32_t points = 0;
    for (uint32_t f = 0; f < cavity->facets; f++) {
        uint32_t at = cavity->facet[f] >> 2, i = cavity->facet[f] & 3, s[3];
        const struct incode_cell *c = cell - at;
        struct incode_cell *n = cell - c->n[i].cell;
        incode_cell_unmark(n);
        fill->outer[f] = c->n[i].cell;
        fill->back[f] =
            (uint8_t)((n->n[1].cell == at) + 2 * (n->n[2].cell == at) +
                      3 * (n->n[3].cell == at));
        for (unsigned k = 0; k < 3; k++) {
            uint16_t w = c->v[incode_cell_facet[i][k]];
            struct incode_complex_point *p = &point[w];
            bool known = (p->cell & NUMBER) != 0;
            s[k] = known ? p->cell & ~NUMBER : points;
            points += !known;
            p->cell = s[k] | NUMBER;
            fill->cell_of[s[k]] = fill->cell[f];
            fill->v[f][k] = w;
            fill->number[k][f] = (uint8_t)s[k];
            fill->point[s[k]] = w;
        }
        fill->v[f][3] = (uint16_t)v;
        fill->with_edge[s[1]][s[2]] = (uint8_t)f;
        fill->with_edge[s[2]][s[0]] = (uint8_t)f;
        fill->with_edge[s[0]][s[1]] = (uint8_t)f;
    }
    return points;
}

static void see_from(struct incode_complex *x, struct filling *fill,
                     uint32_t points, uint32_t v) {
    const double *o = x->point[v].p;
    for (uint32_t s = 0; s < points; s++) {
        bool infinite = fill->point[s] == INCODE_COMPLEX_INFINITE;
        struct incode_complex_point *point = &x->point[fill->point[s]];
        const double *p = infinite ? o : point->p;
        point->cell = fill->cell_of[s];
        fill->infinite[s] = infinite;
        for (int k = 0; k < 3; k++)
            fill->p[k][s] = p[k] - o[k];
    }
}

static inline void write_one(struct incode_complex *x,
                             const struct filling *fill, uint32_t f) {
    struct incode_cell *d = x->cell - fill->cell[f];
    uint32_t a = fill->number[0][f], b = fill->number[1][f],
             c = fill->number[2][f];
    memcpy(d->v, fill->v[f], sizeof d->v);
    incode_cell_join(d, 0, fill->cell[fill->with_edge[c][b]]);
    incode_cell_join(d, 1, fill->cell[fill->with_edge[a][c]]);
    incode_cell_join(d, 2, fill->cell[fill->with_edge[b][a]]);
    incode_cell_join(d, 3, fill->outer[f]);
    incode_cell_join(x->cell - fill->outer[f], fill->back[f], fill->cell[f]);
}

static void write(struct incode_complex *x, struct incode_yield *yield,
                  struct filling *fill, uint32_t facets) {
    enum { BATCH = INCODE_SPHERE_BATCH };
    struct incode_sphere_batch b;
    for (int i = 0; i < 3; i++)
        memset(&fill->number[i][facets], 0, BATCH);
    for (uint32_t first = 0; first < facets; first += BATCH) {
        uint32_t some = facets - first < BATCH ? facets - first : BATCH;
        for (int i = 0; i < 3; i++) {
            const uint8_t *s = &fill->number[i][first];
            for (int k = 0; k < 3; k++)
                for (uint32_t j = 0; j < BATCH; j++)
                    b.p[i][k][j] = fill->p[k][s[j]];
            for (uint32_t j = 0; j < BATCH; j++)
                b.infinite[i][j] = fill->infinite[s[j]];
        }
        incode_sphere_compute(&b);
        for (uint32_t j = 0; j < some; j++) {
            write_one(x, fill, first + j);
            incode_sphere_keep(x->cell - fill->cell[first + j], &b, j);
        }
        if (first % WRITTEN == 0)
            incode_yield_after(yield, WRITTEN_UNITS);
    }
}

enum incode_cavity_result
incode_complex_insert_small(struct incode_complex *x,
                            struct incode_tally *tally, uint32_t v,
                            uint32_t first) {
    struct cavity cavity;
    struct filling fill;
    if (!find(x, tally, x->point[v].p, first, &cavity) ||
        !list_facets(x, &tally->yield, &cavity)) {
        forget(x, &cavity);
        return INCODE_CAVITY_LARGE;
    }
    /* Cells that give way make room for others. */
    uint32_t more =
        cavity.facets > cavity.gone ? cavity.facets - cavity.gone : 0;
    if (!incode_complex_has_room(x, 0, more)) {
        forget(x, &cavity);
        return INCODE_CAVITY_FULL;
    }
    incode_yield_after(&tally->yield, cavity.facets / 4);
    take_cells(x, &cavity, fill.cell);
    see_from(x, &fill, number(x, &cavity, &fill, v), v);
    free_cells(x, &cavity);
    write(x, &tally->yield, &fill, cavity.facets);
    /* The analyser does not see that a cavity has facets.
     * NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign) */
    x->point[v].cell = fill.cell[0];
    return INCODE_CAVITY_FILLED;
}

/* --- release -------------------------------------------------------------- */

/* The neighbours of a cell that stays, and its vertices' cells. */
static void settle(struct incode_complex *x, uint32_t i) {
    struct incode_cell *c = incode_complex_cell(x, i);
    for (unsigned k = 0; k < 4; k++) {
        const struct incode_cell *n = incode_complex_cell(x, c->n[k].cell);
        x->point[c->v[k]].cell = i;
        if (incode_cell_proved(n) != 0)
            incode_cell_join(c, k,
                             incode_cell_is_infinite(n)
                                 ? INCODE_COMPLEX_GONE_INFINITE
                                 : INCODE_COMPLEX_GONE);
    }
}

/* Those of [first, end) that stay are settled, then the others are freed. */
static void settle_some(struct incode_complex *x, uint32_t first,
                        uint32_t end) {
    for (uint32_t i = first; i < end; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        if (!incode_cell_is_free(c) && incode_cell_proved(c) == 0)
            settle(x, i);
    }
}

static void free_some(struct incode_complex *x, uint32_t first, uint32_t end) {
    for (uint32_t i = first; i < end; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        if (!incode_cell_is_free(c) && incode_cell_proved(c) != 0)
            incode_complex_free_cell(x, i);
    }
}

enum {
    RELEASE_AT_ONCE = 128,
    UNITS = 64 /* points or cells between two yields */
};

void incode_complex_release(struct incode_complex *x,
                            struct incode_yield *yield) {
    for (uint32_t v = 0; v < x->points; v++) {
        if (v % RELEASE_AT_ONCE == 0)
            incode_yield_after(yield, UNITS / 8);
        x->point[v].cell = INCODE_NONE;
    }
    for (uint32_t i = FIRST; i < x->cells; i += RELEASE_AT_ONCE) {
        incode_yield_after(yield, UNITS);
        settle_some(x, i,
                    x->cells - i < RELEASE_AT_ONCE ? x->cells
                                                   : i + RELEASE_AT_ONCE);
    }
    for (uint32_t i = FIRST; i < x->cells; i += RELEASE_AT_ONCE) {
        incode_yield_after(yield, UNITS / 4);
        free_some(x, i,
                  x->cells - i < RELEASE_AT_ONCE ? x->cells
                                                 : i + RELEASE_AT_ONCE);
    }
    x->free_point = 0;
    for (uint32_t v = x->points - 1; v > 0; v--) {
        if (v % RELEASE_AT_ONCE == 0)
            incode_yield_after(yield, UNITS / 8);
        if (x->point[v].cell != INCODE_NONE)
            continue;
        x->point[v].id = x->free_point;
        x->free_point = v;
    }
}
