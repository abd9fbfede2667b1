#include "section.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"

/* Differences of doubles that are far apart, or next to 0, want the range of
 * the longer format. */
typedef long double wide;

enum {
    BLOCK = 1 << 12, /* rows between two trims */
    AROUND = 1 << 16 /* bytes that one place far from others touches */
};

/* What all of this module's functions know. */
struct cut {
    const double *xyz;
    uint64_t *above; /* a bit a point: it is above the plane */
    size_t above_bytes;
    struct host_plane plane;
    unsigned side[2]; /* the axes of the picture */
    wide lo[2], scale;
};

static void bounds(const struct host_points *points, unsigned axis, double *lo,
                   double *hi) {
    *lo = *hi = points->xyz[axis];
    for (uint64_t i = 1; i < points->count; i++) {
        if (i % BLOCK == 0)
            host_call_trim(BLOCK * 3 * sizeof *points->xyz);
        double x = points->xyz[3 * i + axis];
        *lo = x < *lo ? x : *lo;
        *hi = x > *hi ? x : *hi;
    }
}

double host_plane_middle(const struct host_points *points, unsigned axis) {
    double lo, hi;
    bounds(points, axis, &lo, &hi);
    double middle = (double)(((wide)lo + (wide)hi) / 2);
    return middle > lo ? middle : hi;
}

struct host_plane host_plane_through_middle(const struct host_points *points) {
    unsigned least = 2;
    wide extent[3];
    for (unsigned d = 0; d < 3; d++) {
        double lo, hi;
        bounds(points, d, &lo, &hi);
        extent[d] = (wide)hi - (wide)lo;
    }
    for (unsigned d = 2; d-- > 0;) {
        /* What random points differ in by chance decides nothing. */
        least = extent[d] < 0.75L * extent[least] ? d : least;
    }
    return (struct host_plane){least, host_plane_middle(points, least)};
}

static bool is_above(const struct cut *c, uint32_t v) {
    return (c->above[v / 64] >> v % 64 & 1) != 0;
}

/* How many vertices are above the plane, and which are: first those, then the
 * others.  The points themselves, which lie in no order, are read of a
 * tetrahedron that is cut alone. */
static unsigned split(const struct cut *c, const uint32_t v[4],
                      const double *vertex[4]) {
    unsigned above = 0, below = 4;
    bool all = c->above_bytes <= host_call_share();
    host_call_trim(all ? sizeof(uint32_t[4]) : 4 * AROUND);
    for (unsigned k = 0; k < 4; k++) {
        vertex[is_above(c, v[k]) ? above++ : --below] =
            c->xyz + 3 * (uint64_t)v[k];
    }
    host_call_trim(above > 0 && above < 4 ? 4 * AROUND : 0);
    return above;
}

static int find_above(struct cut *c, const struct host_points *points,
                      struct host_error *error) {
    c->above_bytes = ((size_t)points->count / 64 + 1) * sizeof *c->above;
    c->above = host_map(c->above_bytes);
    if (c->above == NULL)
        return host_fail_memory(error, "the points above the plane");
    for (uint64_t i = 0; i < points->count; i++) {
        if (i % BLOCK == 0)
            host_call_trim(BLOCK * 3 * sizeof *points->xyz);
        bool above = points->xyz[3 * i + c->plane.axis] >= c->plane.at;
        c->above[i / 64] |= (uint64_t)above << i % 64;
    }
    return 0;
}

/* Where the plane meets the edge, which is the same for all that share it. */
static void meet(const struct cut *c, const double *above, const double *below,
                 wide at[2]) {
    unsigned axis = c->plane.axis;
    wide t = ((wide)c->plane.at - (wide)below[axis]) /
             ((wide)above[axis] - (wide)below[axis]);
    for (unsigned d = 0; d < 2; d++) {
        unsigned side = c->side[d];
        at[d] = (wide)below[side] + t * ((wide)above[side] - (wide)below[side]);
    }
}

/* The corners of the cell of vertices of which `above` are above. */
static unsigned corners(const struct cut *c, const double *vertex[4],
                        unsigned above, wide at[4][2]) {
    static const unsigned quadrilateral[4][2] = {
        {0, 2}, {0, 3}, {1, 3}, {1, 2}};
    if (above == 2) {
        for (unsigned k = 0; k < 4; k++) {
            meet(c, vertex[quadrilateral[k][0]], vertex[quadrilateral[k][1]],
                 at[k]);
        }
        return 4;
    }
    for (unsigned k = 0; k < 3; k++) {
        meet(c, vertex[above == 1 ? 0 : k], vertex[above == 1 ? k + 1 : 3],
             at[k]);
    }
    return 3;
}

static wide length(const double *a, const double *b) {
    wide x = (wide)a[0] - (wide)b[0], y = (wide)a[1] - (wide)b[1];
    wide z = (wide)a[2] - (wide)b[2];
    return sqrtl(x * x + y * y + z * z);
}

static double size_of(const double *vertex[4]) {
    wide first = length(vertex[0], vertex[1]) + length(vertex[0], vertex[2]) +
                 length(vertex[0], vertex[3]);
    wide others = length(vertex[1], vertex[2]) + length(vertex[1], vertex[3]) +
                  length(vertex[2], vertex[3]);
    return (double)logl((first + others) / 6);
}

/* The first pass: how many cells there are, and their box. */
static uint64_t measure(struct cut *c, const struct host_tetrahedra *tets,
                        struct host_section *section) {
    wide hi[2] = {0, 0}, at[4][2];
    const double *vertex[4];
    uint64_t count = 0;
    for (uint64_t i = 0; i < tets->count; i++) {
        unsigned above = split(c, tets->v[i], vertex);
        if (above == 0 || above == 4)
            continue;
        unsigned n = corners(c, vertex, above, at);
        for (unsigned k = 0; k < n; k++) {
            for (unsigned d = 0; d < 2; d++) {
                bool first = count == 0 && k == 0;
                c->lo[d] = first || at[k][d] < c->lo[d] ? at[k][d] : c->lo[d];
                hi[d] = first || at[k][d] > hi[d] ? at[k][d] : hi[d];
            }
        }
        count++;
    }
    wide u = hi[0] - c->lo[0], v = hi[1] - c->lo[1];
    c->scale = u > v ? u : v;
    section->extent[0] = (double)u;
    section->extent[1] = (double)v;
    section->proportion[0] = c->scale > 0 ? (double)(u / c->scale) : 0.0;
    section->proportion[1] = c->scale > 0 ? (double)(v / c->scale) : 0.0;
    return count;
}

/* The second pass: the cells. */
static void take(const struct cut *c, const struct host_tetrahedra *tets,
                 struct host_section *section) {
    const double *vertex[4];
    wide at[4][2];
    double sum = 0.0;
    for (uint64_t i = 0; i < tets->count; i++) {
        unsigned above = split(c, tets->v[i], vertex);
        if (above == 0 || above == 4)
            continue;
        struct host_cell *cell = &section->cells[section->count++];
        host_call_trim(sizeof *cell);
        cell->corners = corners(c, vertex, above, at);
        cell->size = (float)size_of(vertex);
        sum += (double)cell->size;
        for (unsigned k = 0; k < cell->corners; k++)
            for (unsigned d = 0; d < 2; d++)
                cell->corner[k][d] = (float)((at[k][d] - c->lo[d]) / c->scale);
    }
    section->size_mean = sum / (double)section->count;
}

static int beside(const struct host_points *points, struct host_plane plane,
                  struct host_error *error) {
    double lo, hi;
    bounds(points, plane.axis, &lo, &hi);
    return host_fail(error, HOST_INPUT,
                     "--at %.17g: the plane passes beside the tetrahedra, or "
                     "touches them only; give a %c between %.17g and %.17g",
                     plane.at, "xyz"[plane.axis], lo, hi);
}

static int make(struct host_section *section, const struct host_points *points,
                const struct host_tetrahedra *tets, struct cut *c,
                struct host_error *error) {
    uint64_t count = measure(c, tets, section);
    if (section->proportion[0] <= 0.0 || section->proportion[1] <= 0.0)
        return beside(points, c->plane, error);
    section->cells = host_map(count * sizeof *section->cells);
    if (section->cells == NULL)
        return host_fail_memory(error, "the section");
    take(c, tets, section);
    return 0;
}

int host_section_make(struct host_section *section,
                      const struct host_points *points,
                      const struct host_tetrahedra *tets,
                      struct host_plane plane, struct host_error *error) {
    struct cut c = {.xyz = points->xyz, .plane = plane};
    memset(section, 0, sizeof *section);
    c.side[0] = plane.axis == 0 ? 1 : 0;
    c.side[1] = plane.axis == 2 ? 1 : 2;
    if (find_above(&c, points, error) == 0)
        (void)make(section, points, tets, &c, error);
    host_unmap(c.above, c.above_bytes);
    return error->code;
}

void host_section_free(struct host_section *section) {
    host_unmap(section->cells, section->count * sizeof *section->cells);
    memset(section, 0, sizeof *section);
}
