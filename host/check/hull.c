#include "hull.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/mesh/adjacency.h"
#include "incode/predicates/predicates.h"

enum {
    DIRECTIONS = 64,       /* rays tried before giving up */
    INSIDE_TRIES = 100000, /* tetrahedra tried for a point inside */
};

int host_hull_add(struct host_hull *hull, uint32_t tet, uint32_t corner,
                  struct host_error *error)
{
    if (hull->count == hull->capacity) {
        size_t capacity = 2 * hull->capacity + 1024;
        void *grown = realloc(hull->facet, capacity * sizeof *hull->facet);
        if (grown == NULL) {
            return host_fail_memory(error, "the facets of the hull");
        }
        hull->facet = grown;
        hull->capacity = capacity;
    }
    hull->facet[hull->count++] = (struct host_hull_facet){tet, corner};
    return 0;
}

void host_hull_free(struct host_hull *hull)
{
    free(hull->facet);
    hull->facet = NULL;
    hull->count = hull->capacity = 0;
}

struct check {
    struct host_hull *hull;
    const struct host_hull_listener *listener;
    struct incode_tally tally;
    const double *xyz;
    bool broken;
};

static void fault(struct check *c, const uint32_t *v, int n, const char *what)
{
    c->broken = true;
    c->listener->fault(c->listener->context, v, n, what);
}

static const double *at(const struct check *c, uint32_t vertex)
{
    return c->xyz + 3 * (size_t)vertex;
}

static void outward(const struct check *c, size_t facet, uint32_t v[3])
{
    const struct host_hull_facet *f = &c->hull->facet[facet];
    host_facet_outward(c->hull->tets->v[f->tet], f->corner, v);
}

/* +1 where p lies outside the facet's plane. */
static int side(struct check *c, const uint32_t v[3], const double *p)
{
    return incode_orient3d(&c->tally, at(c, v[0]), at(c, v[1]), at(c, v[2]), p);
}

/* --- Edges ------------------------------------------------------------ */

struct edge {
    uint32_t low, high;
    uint32_t facet; /* and which of its edges, times 4; 2^30 facets at most */
};

static int compare_edges(const void *p, const void *q)
{
    const struct edge *a = p, *b = q;
    if (a->low != b->low) {
        return a->low < b->low ? -1 : 1;
    }
    return a->high < b->high ? -1 : a->high > b->high;
}

/* No dent: the other facet's third vertex is not above this one.  Where it is
 * level, both must face the same way, or the surface folds back. */
static bool is_dent(struct check *c, const struct edge *a, const struct edge *b)
{
    uint32_t f[3], g[3];
    outward(c, a->facet / 4, f);
    outward(c, b->facet / 4, g);
    uint32_t far = g[(b->facet % 4 + 2) % 3];
    int s = side(c, f, at(c, far));
    if (s != 0) {
        return s > 0;
    }
    const struct host_hull_facet *facet = &c->hull->facet[a->facet / 4];
    uint32_t apex = c->hull->tets->v[facet->tet][facet->corner];
    return side(c, g, at(c, apex)) >= 0;
}

static void check_edges(struct check *c, const struct edge *edge, size_t n)
{
    for (size_t i = 0; i < n;) {
        size_t j = i + 1;
        while (j < n && compare_edges(&edge[i], &edge[j]) == 0) {
            j++;
        }
        uint32_t v[2] = {edge[i].low, edge[i].high};
        if (j - i != 2) {
            fault(c, v, 2, "is an edge of other than two hull facets");
            i = j;
            continue;
        }
        uint32_t f[3], g[3];
        outward(c, edge[i].facet / 4, f);
        outward(c, edge[i + 1].facet / 4, g);
        if (f[edge[i].facet % 4] == g[edge[i + 1].facet % 4]) {
            fault(c, v, 2, "has hull facets of opposite orientation");
        } else if (is_dent(c, &edge[i], &edge[i + 1])) {
            fault(c, v, 2, "is a dent of the hull");
        }
        i = j;
    }
}

static int compare_words(const void *p, const void *q)
{
    const uint32_t *a = p, *b = q;
    return *a < *b ? -1 : *a > *b;
}

static int count_vertices(struct check *c, struct host_error *error)
{
    size_t n = 3 * c->hull->count;
    uint32_t *v = malloc((n + 1) * sizeof *v);
    if (v == NULL) {
        return host_fail_memory(error, "the vertices of the hull");
    }
    for (size_t i = 0; i < c->hull->count; i++) {
        outward(c, i, v + 3 * i);
    }
    qsort(v, n, sizeof *v, compare_words);
    c->hull->vertices = n > 0;
    for (size_t i = 1; i < n; i++) {
        c->hull->vertices += v[i] != v[i - 1];
    }
    free(v);
    return 0;
}

static int walk_edges(struct check *c, struct host_error *error)
{
    size_t n = 3 * c->hull->count;
    struct edge *edge = malloc((n + 1) * sizeof *edge);
    if (edge == NULL || c->hull->count >= (size_t)1 << 30) {
        free(edge);
        return host_fail_memory(error, "the edges of the hull");
    }
    for (size_t i = 0; i < c->hull->count; i++) {
        uint32_t v[3];
        outward(c, i, v);
        for (uint32_t k = 0; k < 3; k++) {
            uint32_t p = v[k], q = v[(k + 1) % 3];
            edge[3 * i + k] = (struct edge){p < q ? p : q, p < q ? q : p,
                                            (uint32_t)(4 * i + k)};
        }
    }
    qsort(edge, n, sizeof *edge, compare_edges);
    check_edges(c, edge, n);
    free(edge);
    return 0;
}

/* --- Wound once ------------------------------------------------------- */

static uint64_t mix(uint64_t z)
{
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

/* A point about the middle of n vertices, a little off the symmetric place. */
static void blend(const struct check *c, const uint32_t *v, int n,
                  uint64_t seed, double p[3])
{
    double weight[4], sum = 0;
    for (int i = 0; i < n; i++) {
        uint64_t z = mix(seed * 4 + (uint64_t)i + 1);
        weight[i] = 1 + (double)(z >> 11) * 0x1p-53;
        sum += weight[i];
    }
    for (int d = 0; d < 3; d++) {
        p[d] = 0;
        for (int i = 0; i < n; i++) {
            p[d] += weight[i] / sum * at(c, v[i])[d];
        }
        /* The weights' rounding may lead beyond the largest double. */
        p[d] = fmax(fmin(p[d], DBL_MAX), -DBL_MAX);
    }
}

/* A double point strictly inside some tetrahedron. */
static bool find_inside(struct check *c, double p[3])
{
    uint64_t count = c->hull->tets->count;
    uint64_t tries = count < INSIDE_TRIES ? count : INSIDE_TRIES;
    for (uint64_t i = 0; i < tries; i++) {
        const uint32_t *v = c->hull->tets->v[count / tries * i];
        blend(c, v, 4, i, p);
        bool inside = true;
        for (uint32_t k = 0; k < 4 && inside; k++) {
            uint32_t f[3];
            host_facet_outward(v, k, f);
            inside = side(c, f, p) < 0;
        }
        if (inside) {
            return true;
        }
    }
    return false;
}

/* How many facets the ray from o through r crosses: -1 where it meets an
 * edge.  All facets face away from o. */
static int64_t crossings(struct check *c, const double *o, const double *r)
{
    int64_t count = 0;
    for (size_t i = 0; i < c->hull->count; i++) {
        uint32_t v[3];
        outward(c, i, v);
        int lowest = 1;
        for (int k = 0; k < 3 && lowest >= 0; k++) {
            /* positive: r lies to the left of the edge, seen from o */
            int s = incode_orient3d(&c->tally, o, at(c, v[k]),
                                    at(c, v[(k + 1) % 3]), r);
            lowest = s < lowest ? s : lowest;
        }
        if (lowest == 0) {
            return -1;
        }
        count += lowest > 0;
    }
    return count;
}

/* Without a double inside any tetrahedron (an axis that spans more powers of
 * two than doubles have) no ray can be drawn: then no vertex of the hull may
 * lie above any facet, and that the surface is wound once follows from Euler's
 * relation, which host_verify checks. */
static void check_thin(struct check *c)
{
    for (size_t i = 0; i < c->hull->count; i++) {
        uint32_t v[3], w[3];
        outward(c, i, v);
        for (size_t j = 0; j < c->hull->count; j++) {
            outward(c, j, w);
            for (int k = 0; k < 3; k++) {
                if (side(c, v, at(c, w[k])) > 0) {
                    fault(c, v, 3, "is a hull facet with a vertex above it");
                    return;
                }
            }
        }
    }
}

/* The points as large as they may be, axis by axis: exact, and no orientation
 * changes, but a body of denormals gets an inside.  NULL without memory. */
static double *magnified(const struct check *c)
{
    const struct host_points *points = c->hull->points;
    double *xyz = host_map(points->count * 3 * sizeof *xyz);
    for (uint64_t d = 0; d < 3 && xyz != NULL; d++) {
        double largest = 0;
        for (uint64_t i = 0; i < points->count; i++) {
            largest = fmax(largest, fabs(points->xyz[3 * i + d]));
        }
        int exponent = 0;
        (void)frexp(largest, &exponent);
        for (uint64_t i = 0; i < points->count; i++) {
            xyz[3 * i + d] = scalbn(points->xyz[3 * i + d], 1000 - exponent);
        }
        if (exponent > 1000) { /* scaling down might round */
            for (uint64_t i = 0; i < points->count; i++) {
                xyz[3 * i + d] = points->xyz[3 * i + d];
            }
        }
    }
    return xyz;
}

static void check_winding(struct check *c)
{
    double o[3], r[3];
    if (!find_inside(c, o)) {
        check_thin(c);
        return;
    }
    for (size_t i = 0; i < c->hull->count; i++) {
        uint32_t v[3];
        outward(c, i, v);
        if (side(c, v, o) >= 0) {
            fault(c, v, 3, "is a hull facet that faces inward");
            return;
        }
    }
    for (uint64_t i = 0; i < DIRECTIONS && c->hull->count > 0; i++) {
        uint32_t v[3];
        size_t facet = (size_t)(mix(i + 77) % c->hull->count);
        outward(c, facet, v);
        blend(c, v, 3, i, r);
        int64_t count = crossings(c, o, r);
        if (count > 1) {
            fault(c, v, 3, "is a hull facet covered by another");
        }
        if (count >= 0) {
            return;
        }
    }
    check_thin(c);
}

int host_hull_check(struct host_hull *hull,
                    const struct host_hull_listener *listener,
                    struct host_error *error)
{
    struct check c = {
        .hull = hull, .listener = listener, .xyz = hull->points->xyz};
    if (hull->count == 0) {
        fault(&c, NULL, 0, "there is no hull");
        return 0;
    }
    if (walk_edges(&c, error) != 0 || count_vertices(&c, error) != 0 ||
        c.broken) {
        return error->code;
    }
    double inside[3], *large = NULL;
    if (!find_inside(&c, inside)) {
        large = magnified(&c);
        if (large == NULL) {
            return host_fail_memory(error, "the points");
        }
        c.xyz = large;
    }
    check_winding(&c);
    host_unmap(large, hull->points->count * 3 * sizeof *large);
    return error->code;
}
