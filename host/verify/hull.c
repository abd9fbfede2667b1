#include "parts.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/mesh/adjacency.h"
#include "incode/predicates/predicates.h"

enum {
    DIRECTIONS = 64,       /* rays tried before giving up */
    INSIDE_TRIES = 100000, /* tetrahedra tried for a point inside */
    TURN = 1 << 10,        /* facets or vertices a turn of a thread */
    AROUND = 1 << 16,     /* bytes that a tetrahedron far from others touches */
    FACETS_MAX = 1 << 30, /* as edges are numbered */
};

int host_hull_add(struct host_hull *hull, uint64_t tet, uint32_t corner,
                  struct host_error *error) {
    if (hull->count == hull->capacity) {
        size_t capacity = 2 * hull->capacity + 1024;
        void *grown =
            host_remap(hull->facet, hull->capacity * sizeof *hull->facet,
                       capacity * sizeof *hull->facet);
        if (grown != NULL) {
            hull->facet = grown;
            hull->capacity = capacity;
        }
        if (grown == NULL || hull->count >= FACETS_MAX)
            return host_fail_memory(error, "the facets of the hull");
    }
    hull->facet[hull->count++] = (struct host_hull_facet){tet, corner};
    return 0;
}

void host_hull_free(struct host_hull *hull) {
    host_unmap(hull->facet, hull->capacity * sizeof *hull->facet);
    hull->facet = NULL;
    hull->count = hull->capacity = 0;
}

/* An edge at its lower vertex. */
struct edge {
    uint32_t high;
    uint32_t facet; /* and which of its edges, times 4 */
};

struct hull_check {
    struct host_hull *hull;
    const struct host_hull_listener *listener;
    bool scaled;
    double shift[3]; /* coordinates are moved by it, */
    int power[3];    /* then scaled */
    uint32_t *end;   /* [sites + 1] of the edges of a vertex */
    struct edge *edge;
    uint8_t *on; /* [sites] 1: a vertex of the hull */
    uint64_t next;
    bool broken;
    double inside[3], beyond[3]; /* a ray */
    uint64_t crossed;
    bool grazed; /* the ray meets an edge */
};

static void fault(struct hull_check *c, const uint64_t *tets, int tet_count,
                  const uint32_t *v, int n, const char *what) {
    __atomic_store_n(&c->broken, true, __ATOMIC_RELAXED);
    c->listener->fault(c->listener->context, tets, tet_count, v, n, what);
}

static void at(const struct hull_check *c, uint32_t vertex, double p[3]) {
    host_site(c->hull->sites, vertex, p);
    for (int d = 0; d < 3 && c->scaled; d++)
        p[d] = scalbn(p[d] - c->shift[d], c->power[d]);
}

static void outward(const struct hull_check *c, size_t facet, uint32_t v[3]) {
    const struct host_hull_facet *f = &c->hull->facet[facet];
    host_call_trim(AROUND);
    host_facet_outward(c->hull->tets->v[f->tet], f->corner, v);
}

/* +1 where p lies outside the facet's plane. */
static int side(const struct hull_check *c, const uint32_t v[3],
                const double *p) {
    struct incode_tally tally = {0};
    double a[3][3];
    for (int k = 0; k < 3; k++)
        at(c, v[k], a[k]);
    return incode_orient3d(&tally, a[0], a[1], a[2], p);
}

static int side_of_vertex(const struct hull_check *c, const uint32_t v[3],
                          uint32_t vertex) {
    double p[3];
    at(c, vertex, p);
    return side(c, v, p);
}

/* Calls function(c, first, last) for ranges of facets or vertices that together
 * are all, on all threads. */
struct all {
    struct hull_check *c;
    void (*function)(struct hull_check *c, size_t first, size_t last);
    uint64_t count;
};

static void run_some(void *context, unsigned part) {
    (void)part;
    const struct all *all = context;
    uint64_t i;
    while ((i = __atomic_fetch_add(&all->c->next, TURN, __ATOMIC_RELAXED)) <
           all->count) {
        uint64_t last = all->count - i < TURN ? all->count : i + TURN;
        host_call_trim((size_t)(last - i) * sizeof *all->c->edge);
        all->function(all->c, (size_t)i, (size_t)last);
    }
}

static void for_all(struct hull_check *c, uint64_t count,
                    void (*function)(struct hull_check *c, size_t first,
                                     size_t last)) {
    struct all all = {c, function, count};
    c->next = 0;
    host_fork_all(count > TURN ? host_threads() : 1, run_some, &all);
}

/* --- Edges ---------------------------------------------------------------- */

/* No dent: the other facet's third vertex is not above this one.  Where it is
 * level, both must face the same way, or the surface folds back. */
static bool is_dent(const struct hull_check *c, const struct edge *a,
                    const struct edge *b) {
    uint32_t f[3], g[3];
    outward(c, a->facet / 4, f);
    outward(c, b->facet / 4, g);
    int s = side_of_vertex(c, f, g[(b->facet % 4 + 2) % 3]);
    if (s != 0)
        return s > 0;
    const struct host_hull_facet *facet = &c->hull->facet[a->facet / 4];
    return side_of_vertex(c, g, c->hull->tets->v[facet->tet][facet->corner]) >=
           0;
}

static void check_edge(struct hull_check *c, uint32_t low,
                       const struct edge *edge, size_t n) {
    uint32_t v[2] = {low, edge->high}, f[3], g[3];
    uint64_t tets[2] = {c->hull->facet[edge[0].facet / 4].tet,
                        c->hull->facet[edge[n > 1].facet / 4].tet};
    if (n != 2) {
        fault(c, tets, n > 1 ? 2 : 1, v, 2,
              "is an edge of other than two hull facets");
        return;
    }
    outward(c, edge[0].facet / 4, f);
    outward(c, edge[1].facet / 4, g);
    if (f[edge[0].facet % 4] == g[edge[1].facet % 4])
        fault(c, tets, 2, v, 2, "has hull facets of opposite orientation");
    else if (is_dent(c, &edge[0], &edge[1]))
        fault(c, tets, 2, v, 2, "is a dent of the hull");
}

static int compare_edges(const void *p, const void *q) {
    const struct edge *a = p, *b = q;
    if (a->high != b->high)
        return a->high < b->high ? -1 : 1;
    return a->facet < b->facet ? -1 : a->facet > b->facet;
}

/* Moves the first of edges down to its place in the heap. */
static void sift_down(struct edge *edge, size_t at, size_t n) {
    struct edge e = edge[at];
    for (size_t child; (child = 2 * at + 1) < n; at = child) {
        child +=
            child + 1 < n && compare_edges(&edge[child], &edge[child + 1]) < 0;
        if (compare_edges(&e, &edge[child]) >= 0)
            break;
        edge[at] = edge[child];
    }
    edge[at] = e;
}

/* In place, as an edge array may be put aside. */
static void sort_many(struct edge *edge, size_t n) {
    for (size_t i = n / 2; i-- > 0;) {
        host_call_trim(HOST_CALL_AROUND);
        sift_down(edge, i, n);
    }
    for (size_t i = n; i-- > 1;) {
        struct edge e = edge[0];
        host_call_trim(HOST_CALL_AROUND);
        edge[0] = edge[i];
        edge[i] = e;
        sift_down(edge, 0, i);
    }
}

static void sort_edges(struct edge *edge, size_t n) {
    enum { FEW_MAX = 64 };
    if (n > FEW_MAX) {
        sort_many(edge, n);
        return;
    }
    for (size_t i = 1; i < n; i++) {
        struct edge e = edge[i];
        size_t j = i;
        for (; j > 0 && compare_edges(&e, &edge[j - 1]) < 0; j--)
            edge[j] = edge[j - 1];
        edge[j] = e;
    }
}

static void check_vertex(struct hull_check *c, size_t v) {
    struct edge *edge = c->edge + c->end[v];
    size_t n = c->end[v + 1] - c->end[v];
    sort_edges(edge, n);
    for (size_t i = 0, j; i < n; i = j) {
        for (j = i + 1; j < n && edge[j].high == edge[i].high; j++) {
        }
        check_edge(c, (uint32_t)v, edge + i, j - i);
    }
}

static void check_vertices(struct hull_check *c, size_t first, size_t last) {
    uint64_t vertices = 0;
    for (size_t v = first; v < last; v++) {
        if (c->on[v] != 0) {
            check_vertex(c, v);
            vertices++;
        }
    }
    (void)__atomic_fetch_add(&c->hull->vertices, vertices, __ATOMIC_RELAXED);
}

/* Counts, then fills: afterwards end[v] is where the edges of v begin. */
static void list_edges(struct hull_check *c) {
    uint32_t *next = c->end + 1, sum = 0;
    for (int fill = 0; fill < 2; fill++) {
        for (size_t i = 0; i < c->hull->count; i++) {
            uint32_t v[3];
            outward(c, i, v);
            for (uint32_t k = 0; k < 3; k++) {
                uint32_t p = v[k], q = v[(k + 1) % 3];
                uint32_t low = p < q ? p : q, high = p < q ? q : p;
                if (fill != 0) {
                    c->edge[next[low]] =
                        (struct edge){high, (uint32_t)(4 * i + k)};
                }
                next[low]++;
                c->on[p] = 1;
            }
        }
        for (uint64_t i = 0; i < c->hull->sites->count && fill == 0; i++) {
            uint32_t here = next[i];
            if (i % TURN == 0)
                host_call_trim(TURN * sizeof *next);
            next[i] = sum;
            sum += here;
        }
    }
}

/* A closed surface of triangles with as many vertices as a sphere's. */
static void check_euler(struct hull_check *c) {
    if (c->hull->count + 4 != 2 * c->hull->vertices)
        fault(c, NULL, 0, NULL, 0, "its Euler characteristic is not 2");
}

static int check_edges(struct hull_check *c, struct host_error *error) {
    size_t sites = (size_t)c->hull->sites->count, n = 3 * c->hull->count;
    c->end = host_map((sites + 1) * sizeof *c->end);
    c->on = host_map(sites);
    c->edge = host_map(n * sizeof *c->edge);
    if (c->end != NULL && c->on != NULL && c->edge != NULL) {
        list_edges(c);
        for_all(c, sites, check_vertices);
        check_euler(c);
    } else {
        host_fail_memory(error, "the edges of the hull");
    }
    host_unmap(c->end, (sites + 1) * sizeof *c->end);
    host_unmap(c->on, sites);
    host_unmap(c->edge, n * sizeof *c->edge);
    return error->code;
}

/* --- Wound once ----------------------------------------------------------- */

static uint64_t mix(uint64_t z) {
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

/* A point about the middle of n vertices, a little off the symmetric place. */
static void blend(const struct hull_check *c, const uint32_t *v, int n,
                  uint64_t seed, double p[3]) {
    double weight[4], sum = 0;
    for (int i = 0; i < n; i++) {
        uint64_t z = mix(seed * 4 + (uint64_t)i + 1);
        weight[i] = 1 + (double)(z >> 11) * 0x1p-53;
        sum += weight[i];
    }
    p[0] = p[1] = p[2] = 0;
    for (int i = 0; i < n; i++) {
        double q[3];
        at(c, v[i], q);
        for (int d = 0; d < 3; d++)
            p[d] += weight[i] / sum * q[d];
    }
    for (int d = 0; d < 3; d++) {
        /* The weights' rounding may lead beyond the largest double. */
        p[d] = fmax(fmin(p[d], DBL_MAX), -DBL_MAX);
    }
}

/* A double point strictly inside some tetrahedron. */
static bool find_inside(struct hull_check *c) {
    uint64_t count = c->hull->tets->count;
    uint64_t tries = count < INSIDE_TRIES ? count : INSIDE_TRIES;
    for (uint64_t i = 0; i < tries; i++) {
        const uint32_t *v = c->hull->tets->v[count / tries * i];
        bool inside = true;
        host_call_trim((size_t)5 * HOST_CALL_AROUND);
        for (int k = 0; k < 4; k++)
            inside = inside && v[k] < c->hull->sites->count;
        if (!inside)
            continue;
        blend(c, v, 4, i, c->inside);
        for (uint32_t k = 0; k < 4 && inside; k++) {
            uint32_t f[3];
            host_facet_outward(v, k, f);
            inside = side(c, f, c->inside) < 0;
        }
        if (inside)
            return true;
    }
    return false;
}

static void facet_fault(struct hull_check *c, size_t facet, const char *what) {
    uint32_t v[3];
    outward(c, facet, v);
    fault(c, &c->hull->facet[facet].tet, 1, v, 3, what);
}

static void check_facing(struct hull_check *c, size_t first, size_t last) {
    for (size_t facet = first; facet < last; facet++) {
        uint32_t v[3];
        outward(c, facet, v);
        if (side(c, v, c->inside) >= 0)
            facet_fault(c, facet, "is a hull facet that faces inward");
    }
}

/* Whether the ray crosses a facet: 1, 0, or -1 where it meets its edge.  All
 * facets face away from its start. */
static int crosses(const struct hull_check *c, size_t facet) {
    struct incode_tally tally = {0};
    uint32_t v[3];
    double p[3][3];
    int lowest = 1;
    outward(c, facet, v);
    for (int k = 0; k < 3; k++)
        at(c, v[k], p[k]);
    for (int k = 0; k < 3 && lowest >= 0; k++) {
        /* positive: the ray passes on the left of the edge */
        int s =
            incode_orient3d(&tally, c->inside, p[k], p[(k + 1) % 3], c->beyond);
        lowest = s < lowest ? s : lowest;
    }
    return lowest > 0 ? 1 : lowest == 0 ? -1 : 0;
}

static void count_crossed(struct hull_check *c, size_t first, size_t last) {
    for (size_t facet = first; facet < last; facet++) {
        int crossed = crosses(c, facet);
        if (crossed < 0)
            __atomic_store_n(&c->grazed, true, __ATOMIC_RELAXED);
        else if (crossed > 0)
            (void)__atomic_fetch_add(&c->crossed, 1, __ATOMIC_RELAXED);
    }
}

/* Without a double inside any tetrahedron (an axis that spans more powers of
 * two than doubles have) no ray can be drawn: then no vertex of the hull may
 * lie above any facet.  So each sheet of the surface covers the boundary of one
 * convex body, and with all its extreme vertices; two sheets would have an
 * Euler characteristic beyond 2 for the vertices that they share. */
static void check_thin_facet(struct hull_check *c, size_t facet) {
    uint32_t v[3], w[3];
    outward(c, facet, v);
    for (size_t j = 0; j < c->hull->count; j++) {
        outward(c, j, w);
        for (int k = 0; k < 3; k++) {
            if (side_of_vertex(c, v, w[k]) > 0) {
                facet_fault(c, facet, "is a hull facet with a vertex above it");
                return;
            }
        }
    }
}

static void check_thin(struct hull_check *c, size_t first, size_t last) {
    for (size_t facet = first; facet < last; facet++)
        check_thin_facet(c, facet);
}

static void check_rays(struct hull_check *c) {
    for (uint64_t i = 0; i < DIRECTIONS; i++) {
        uint32_t v[3];
        size_t facet = (size_t)(mix(i + 77) % c->hull->count);
        outward(c, facet, v);
        blend(c, v, 3, i, c->beyond);
        c->crossed = 0;
        c->grazed = false;
        for_all(c, c->hull->count, count_crossed);
        if (!c->grazed) {
            if (c->crossed > 1)
                facet_fault(c, facet, "is a hull facet covered by another");
            return;
        }
    }
    for_all(c, c->hull->count, check_thin);
}

/* Whether a - b is a double: the error of the difference is 0 (Knuth, The Art
 * of Computer Programming 2, 4.2.2). */
static bool is_exact_difference(double a, double b) {
    double d = a - b, bb = a - d;
    return isfinite(d) && (a - (d + bb)) + (bb - b) == 0.0;
}

/* The lowest coordinate of each axis on which all points can be moved by it
 * exactly; else 0. */
static void find_shift(struct hull_check *c) {
    const struct host_sites *sites = c->hull->sites;
    double lowest[3] = {INFINITY, INFINITY, INFINITY}, p[3];
    bool exact[3] = {true, true, true};
    for (int pass = 0; pass < 2; pass++) {
        for (uint64_t i = 0; i < sites->count; i++) {
            host_call_trim(sizeof p);
            host_site(sites, (uint32_t)i, p);
            for (int d = 0; d < 3; d++) {
                lowest[d] = fmin(lowest[d], p[d]);
                exact[d] = pass == 0 ||
                           (exact[d] && is_exact_difference(p[d], lowest[d]));
            }
        }
    }
    for (int d = 0; d < 3; d++)
        c->shift[d] = exact[d] && isfinite(lowest[d]) ? lowest[d] : 0.0;
}

/* The points at the origin and as large as they may be, axis by axis: exact,
 * and no orientation changes, but a body of denormals, or one that is a few ulp
 * thick, gets an inside. */
static void magnify(struct hull_check *c) {
    const struct host_sites *sites = c->hull->sites;
    double most[3] = {0}, p[3];
    find_shift(c);
    for (uint64_t i = 0; i < sites->count; i++) {
        host_call_trim(sizeof p);
        host_site(sites, (uint32_t)i, p);
        for (int d = 0; d < 3; d++)
            most[d] = fmax(most[d], fabs(p[d] - c->shift[d]));
    }
    for (int d = 0; d < 3; d++) {
        int exponent = 0;
        (void)frexp(most[d], &exponent);
        /* scaling down might round */
        c->power[d] = exponent > 1000 ? 0 : 1000 - exponent;
    }
    c->scaled = true;
}

static void check_winding(struct hull_check *c) {
    bool inside = find_inside(c);
    if (!inside) {
        magnify(c);
        inside = find_inside(c);
    }
    if (!inside) {
        for_all(c, c->hull->count, check_thin);
        return;
    }
    for_all(c, c->hull->count, check_facing);
    if (!c->broken)
        check_rays(c);
}

int host_hull_check(struct host_hull *hull,
                    const struct host_hull_listener *listener,
                    struct host_error *error) {
    struct hull_check c = {.hull = hull, .listener = listener};
    hull->vertices = 0;
    if (hull->count == 0)
        fault(&c, NULL, 0, NULL, 0, "there is no hull");
    else if (check_edges(&c, error) == 0 && !c.broken)
        check_winding(&c);
    return error->code;
}
