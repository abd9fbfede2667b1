/* The Delaunay triangulation of some of the points, which grows point by point
 * (Bowyer, Computer Journal 24, 1981; Watson, ibid.): the cells whose spheres
 * hold the new point, those in conflict, are replaced by cells between the
 * point and the boundary of their union.  The predicates break ties, so the
 * triangulation of its points is unique.
 *
 * Outside the hull there are infinite cells, one beyond each of its facets,
 * with the vertex INCODE_COMPLEX_INFINITE; so every cell has four neighbours.
 *
 * Memory: given by its owner, 32 bytes a point and 32 a cell, of which there
 * are some 7 a point; 40 KB of stack. */
#ifndef INCODE_COMPLEX_H
#define INCODE_COMPLEX_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "incode/pages/bricks.h"
#include "incode/predicates/predicates.h"

enum {
    INCODE_COMPLEX_POINTS_MAX = 65534,
    INCODE_COMPLEX_CELLS_MAX = (1 << 23) - 2,
    INCODE_COMPLEX_CAVITY = 640,      /* cells tested for a point */
    INCODE_CELL_NONE = (1 << 24) - 1, /* at the end of a list by n[0] */
    INCODE_COMPLEX_INFINITE = 0,      /* the vertex beyond the hull */
    /* In the place of a neighbour that has been released, a finite and an
     * infinite one. */
    INCODE_COMPLEX_GONE = 0,
    INCODE_COMPLEX_GONE_INFINITE = 1,
    INCODE_COMPLEX_CELLS_FIRST = 2
};

/* A cell of positive orientation, were its infinite vertex a point beyond the
 * facet; v[3] is finite.  n[i].cell: the neighbour opposite v[i].  A free
 * cell has v[0] = v[1], and n[0].cell is the next one. */
struct incode_cell {
    uint16_t v[4];
    struct {
        uint32_t cell : 24, low : 8; /* of sphere[i]: its last bits; n[3]: of
                                        a walk, within a call */
    } n[4];
    int16_t sphere[3]; /* with the scale: see cavity.h */
    uint8_t scale;
    uint8_t flags; /* INCODE_CELL_... */
};

enum {
    INCODE_CELL_MARK = 3,       /* 0 at each call, and after it */
    INCODE_CELL_PROVED = 3 * 4, /* 0 in a new cell, INCODE_CELL_FINAL, or as
                                   its owner likes */
    INCODE_CELL_INFINITE = 16,
    INCODE_CELL_SCALE = 7 * 32 /* the last bits of it */
};

/* In INCODE_CELL_PROVED: no point will be inserted that the sphere holds. */
enum { INCODE_CELL_FINAL = 1 };

struct incode_complex_point {
    double p[3];
    uint32_t id;   /* vertex number */
    uint32_t cell; /* one of its cells, or INCODE_NONE: it is no vertex */
};

_Static_assert(sizeof(struct incode_cell) == 32, "two in a cache line");
_Static_assert(sizeof(struct incode_complex_point) == 32, "here, too");

struct incode_complex {
    /* Points from the start of the memory, cells from its end: cell i is
     * cell[-i]. */
    struct incode_complex_point *point;
    struct incode_cell *cell;
    size_t bytes;
    uint32_t points;      /* with the infinite one, which is the first */
    uint32_t points_kept; /* room for so many at least */
    uint32_t cells;       /* used or free */
    uint32_t free, free_count;
    uint32_t free_point; /* by `id`, up to 0 */
    uint64_t searches;   /* insertions that tested all points for a near one */
    uint64_t scans;      /* insertions that tested all cells for a first one */
};

/* memory: aligned to 8 bytes; faster where it begins and ends at multiples of
 * 32. */
void incode_complex_init(struct incode_complex *x, void *memory, size_t bytes);

/* Keeps room for so many points, which cells do not take. */
void incode_complex_reserve(struct incode_complex *x, uint32_t points);

/* Forgets all. */
void incode_complex_clear(struct incode_complex *x);

/* Adds a point to those that may be inserted; it is no vertex yet.  Returns its
 * index, from 1 on, or INCODE_NONE: there is no room. */
uint32_t incode_complex_add(struct incode_complex *x, const double p[3],
                            uint32_t id);

/* Makes four of the points, which span space, the first vertices.  False: they
 * do not, or there is no room. */
bool incode_complex_begin(struct incode_complex *x, struct incode_tally *tally,
                          const uint32_t four[4]);

/* Releases the cells that are proved: none of their spheres will hold a point
 * that is inserted later.  Vertices without cells, and points that are no
 * vertex yet, are forgotten, and their slots are used again. n[0] and the
 * points' `cell` may have been used for lists before. */
void incode_complex_release(struct incode_complex *x,
                            struct incode_yield *yield);

/* Inserts a point that is no vertex yet.  The walk begins at the vertex `near`,
 * which should be close.  False: there is no room, or the same point is a
 * vertex; nothing has changed. */
bool incode_complex_insert(struct incode_complex *x, struct incode_tally *tally,
                           uint32_t v, uint32_t near);

/* The cells in conflict with a point, 0 if it is a vertex.  INCODE_NONE: these
 * and the cells around them are more than INCODE_COMPLEX_CAVITY. near: as
 * above. */
uint32_t incode_complex_cavity(struct incode_complex *x,
                               struct incode_tally *tally, const double p[3],
                               uint32_t near,
                               uint32_t cells[INCODE_COMPLEX_CAVITY]);

/* Whether a cell is in conflict with a point. */
bool incode_complex_gives_way(const struct incode_complex *x,
                              struct incode_tally *tally,
                              const struct incode_cell *c, const double p[3]);

/* Sets INCODE_CELL_PROVED of all cells in conflict with a point to 0, and
 * returns their number; *were: the number that had another value. */
uint32_t incode_complex_disprove(struct incode_complex *x,
                                 struct incode_tally *tally, const double p[3],
                                 uint32_t near, uint32_t *were);

/* Cells that are not free. */
static inline uint32_t
incode_complex_cells_used(const struct incode_complex *x) {
    return x->cells - x->free_count;
}

static inline bool incode_cell_is_free(const struct incode_cell *c) {
    return c->v[0] == c->v[1];
}

/* The owner's mark of a cell: 0 to 3. */
static inline unsigned incode_cell_proved(const struct incode_cell *c) {
    return (c->flags & (unsigned)INCODE_CELL_PROVED) / 4;
}

static inline void incode_cell_set_proved(struct incode_cell *c, unsigned to) {
    c->flags = (uint8_t)((c->flags & ~(unsigned)INCODE_CELL_PROVED) | to * 4);
}

/* Whether a point is a vertex. */
static inline bool incode_complex_is_vertex(const struct incode_complex *x,
                                            uint32_t v) {
    return x->point[v].cell != INCODE_NONE;
}

static inline struct incode_cell *
incode_complex_cell(const struct incode_complex *x, uint32_t i) {
    return x->cell - i;
}

/* Makes a cell the neighbour i of another. */
static inline void incode_cell_join(struct incode_cell *c, unsigned i,
                                    uint32_t to) {
    c->n[i].cell = to & (uint32_t)INCODE_CELL_NONE;
}

/* Where a vertex is in a cell: 0 to 3; 4: nowhere. */
static inline unsigned incode_cell_index(const struct incode_cell *c,
                                         uint32_t v) {
    return c->v[0] == v   ? 0
           : c->v[1] == v ? 1
           : c->v[2] == v ? 2
           : c->v[3] == v ? 3
                          : 4;
}

static inline bool incode_cell_is_infinite(const struct incode_cell *c) {
    return incode_cell_index(c, INCODE_COMPLEX_INFINITE) != 4;
}

#endif
