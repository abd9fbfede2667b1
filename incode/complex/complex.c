#include "complex.h"

#include <string.h>

#include "cavity.h"
#include "incode/predicates/check.h"
#include "sphere.h"

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
