#include "verify.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "edges.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/mesh/adjacency.h"
#include "host/order/duplicates.h"
#include "hull.h"
#include "incode/predicates/predicates.h"

enum {
    NAMED_MAX = 8,   /* offenders named */
    CHUNK = 1 << 12, /* vertices or tetrahedra a turn of a thread */
};

struct verify {
    const struct host_points *points;
    struct host_tetrahedra *tets;
    struct host_verify_report *report;
    struct host_error *error;
    uint32_t *lowest; /* [rows] lowest row of the same point */
    uint8_t *used;    /* [rows] 1: a vertex of some tetrahedron */
    struct host_adjacency adjacency;
    struct host_hull hull;
    pthread_mutex_t lock; /* of report, error, hull and next */
    uint64_t next;        /* first vertex or tetrahedron of no thread yet */
    bool positive;        /* every tetrahedron is */
};

static const double *at(const struct verify *v, uint32_t row)
{
    return v->points->xyz + 3 * (size_t)row;
}

/* --- Offenders -------------------------------------------------------- */

static void fault(struct verify *v, const uint32_t *vertex, int n,
                  const char *subject, const char *what)
{
    (void)pthread_mutex_lock(&v->lock);
    struct host_verify_report *r = v->report;
    size_t used = strlen(r->text), room = sizeof r->text - used;
    if (r->faults++ < NAMED_MAX && room > 160) {
        char *to = r->text + used;
        int length = snprintf(to, room, "%s", subject);
        for (int i = 0; i < n; i++) {
            length += snprintf(to + length, room - (size_t)length, "%s%u",
                               i == 0 ? " (" : " ", vertex[i]);
        }
        (void)snprintf(to + length, room - (size_t)length, "%s%s\n",
                       n > 0 ? ") " : " ", what);
    }
    (void)pthread_mutex_unlock(&v->lock);
}

static void tet_fault(struct verify *v, uint64_t tet, const char *what)
{
    fault(v, v->tets->v[tet], 4, "tetrahedron", what);
}

static void hull_fault(void *context, const uint32_t *vertices, int count,
                       const char *what)
{
    static const char *const subject[] = {"hull:", "point", "edge", "facet"};
    fault(context, vertices, count, subject[count], what);
}

static uint64_t take_chunk(struct verify *v, uint64_t total)
{
    (void)pthread_mutex_lock(&v->lock);
    uint64_t first = v->next < total && v->error->code == 0 ? v->next : total;
    v->next = first + CHUNK;
    (void)pthread_mutex_unlock(&v->lock);
    return first;
}

static void run(struct verify *v, void (*part)(void *, unsigned))
{
    v->next = 0;
    host_fork_all(host_threads(), part, v);
}

/* --- Rows and orientation --------------------------------------------- */

static void check_tetrahedron(struct verify *v, uint64_t i,
                              struct incode_tally *tally)
{
    const uint32_t *t = v->tets->v[i];
    for (int k = 0; k < 4; k++) {
        if (v->lowest[t[k]] != t[k]) {
            tet_fault(v, i, "uses a row that repeats an earlier one");
            __atomic_store_n(&v->positive, false, __ATOMIC_RELAXED);
            return;
        }
        __atomic_store_n(&v->used[t[k]], 1, __ATOMIC_RELAXED);
    }
    int s = incode_orient3d(tally, at(v, t[0]), at(v, t[1]), at(v, t[2]),
                            at(v, t[3]));
    if (s <= 0) {
        tet_fault(v, i,
                  s == 0 ? "has no volume" : "is of negative orientation");
        __atomic_store_n(&v->positive, false, __ATOMIC_RELAXED);
    }
}

static void check_tetrahedra(void *context, unsigned part)
{
    (void)part;
    struct verify *v = context;
    struct incode_tally tally = {0};
    uint64_t count = v->tets->count, i;
    while ((i = take_chunk(v, count)) < count) {
        uint64_t end = count - i < CHUNK ? count : i + CHUNK;
        for (; i < end; i++) {
            check_tetrahedron(v, i, &tally);
        }
    }
}

/* Numbers that are no rows stop the check: nothing can be said of them. */
static int check_rows(struct verify *v)
{
    for (uint64_t i = 0; i < v->tets->count; i++) {
        for (int k = 0; k < 4; k++) {
            if (v->tets->v[i][k] >= v->points->count) {
                tet_fault(v, i, "has a vertex that is no row of the points");
                return HOST_UNVERIFIED;
            }
        }
    }
    return 0;
}

static void check_vertices(struct verify *v)
{
    for (uint32_t row = 0; row < v->points->count; row++) {
        if (v->lowest[row] == row && v->used[row] == 0) {
            fault(v, &row, 1, "point", "is a vertex of no tetrahedron");
        }
    }
}

/* --- Facets ----------------------------------------------------------- */

/* Whether the facet's outward vertices are an even permutation of ascending
 * order: twins differ in it. */
static bool parity(const struct verify *v, const struct host_facet *f)
{
    uint32_t p[3];
    host_facet_outward(v->tets->v[f->tet], f->corner, p);
    return ((p[0] < p[1]) ^ (p[1] < p[2]) ^ (p[0] < p[2])) != 0;
}

static void check_pair(struct verify *v, const struct host_facet *f,
                       struct incode_tally *tally)
{
    const uint32_t *t = v->tets->v[f[0].tet];
    uint32_t apex = v->tets->v[f[1].tet][f[1].corner];
    if (parity(v, &f[0]) == parity(v, &f[1])) {
        uint32_t p[3];
        host_facet_outward(t, f[0].corner, p);
        fault(v, p, 3, "facet", "has both its tetrahedra on one side");
        return;
    }
    if (v->positive &&
        incode_in_sphere(tally, at(v, t[0]), at(v, t[1]), at(v, t[2]),
                         at(v, t[3]), at(v, apex)) > 0) {
        uint32_t five[5] = {t[0], t[1], t[2], t[3], apex};
        fault(v, five, 5, "tetrahedron and point",
              "are not Delaunay: the point lies in the sphere");
    }
}

static int check_group(struct verify *v, const struct host_group *group,
                       struct incode_tally *tally)
{
    const struct host_facet *f = group->facet;
    for (size_t i = 0, j; i < group->count; i = j) {
        for (j = i + 1; j < group->count && f[j].others == f[i].others; j++) {
        }
        if (j - i == 2) {
            check_pair(v, &f[i], tally);
        } else if (j - i > 2) {
            uint32_t p[3];
            host_facet_outward(v->tets->v[f[i].tet], f[i].corner, p);
            fault(v, p, 3, "facet", "belongs to more than two tetrahedra");
        } else {
            (void)pthread_mutex_lock(&v->lock);
            int code = host_hull_add(&v->hull, f[i].tet, f[i].corner, v->error);
            (void)pthread_mutex_unlock(&v->lock);
            if (code != 0) {
                return code;
            }
        }
    }
    return 0;
}

static void check_facets(void *context, unsigned part)
{
    (void)part;
    struct verify *v = context;
    struct incode_tally tally = {0};
    struct host_group group = {0};
    struct host_error error = {0};
    uint64_t vertices = v->points->count, p;
    while ((p = take_chunk(v, vertices)) < vertices) {
        uint64_t end = vertices - p < CHUNK ? vertices : p + CHUNK;
        for (; p < end && error.code == 0; p++) {
            if (host_adjacency_group(&v->adjacency, (uint32_t)p, &group,
                                     &error) == 0) {
                (void)check_group(v, &group, &tally);
            }
        }
    }
    host_group_free(&group);
    (void)pthread_mutex_lock(&v->lock);
    if (error.code != 0 && v->error->code == 0) {
        *v->error = error;
    }
    (void)pthread_mutex_unlock(&v->lock);
}

/* --- All together ----------------------------------------------------- */

static int compare_hull(const void *p, const void *q)
{
    const struct host_hull_facet *a = p, *b = q;
    if (a->tet != b->tet) {
        return a->tet < b->tet ? -1 : 1;
    }
    return a->corner < b->corner ? -1 : a->corner > b->corner;
}

static void check_euler(struct verify *v)
{
    const struct host_verify_report *r = v->report;
    uint64_t facets = (4 * r->tetrahedra + r->hull_facets) / 2;
    if (r->distinct + facets != r->edges + r->tetrahedra + 1) {
        char text[160];
        (void)snprintf(text, sizeof text,
                       "%llu vertices - %llu edges + %llu facets - %llu "
                       "tetrahedra is not 1",
                       (unsigned long long)r->distinct,
                       (unsigned long long)r->edges, (unsigned long long)facets,
                       (unsigned long long)r->tetrahedra);
        fault(v, NULL, 0, "Euler's relation fails:", text);
    }
}

static void check_all(struct verify *v)
{
    struct host_verify_report *r = v->report;
    if (check_rows(v) != 0) {
        return;
    }
    run(v, check_tetrahedra);
    check_vertices(v);
    if (host_adjacency_make(&v->adjacency, v->tets, (uint32_t)v->points->count,
                            v->error) != 0) {
        return;
    }
    run(v, check_facets);
    if (v->error->code != 0) {
        return;
    }
    host_adjacency_free(&v->adjacency); /* room for the edges */
    r->hull_facets = v->hull.count;
    if (host_edges_count(v->tets, (uint32_t)v->points->count, &r->edges,
                         v->error) != 0) {
        return;
    }
    check_euler(v);
    if (v->positive) {
        struct host_hull_listener listener = {v, hull_fault};
        if (v->hull.count > 0) {
            qsort(v->hull.facet, v->hull.count, sizeof *v->hull.facet,
                  compare_hull);
        }
        host_hull_check(&v->hull, &listener, v->error);
        r->hull_vertices = v->hull.vertices;
    }
}

static void verdict(struct verify *v)
{
    struct host_verify_report *r = v->report;
    if (v->error->code == 0 && r->faults > 0) {
        int length = (int)strcspn(r->text, "\n");
        host_fail(v->error, HOST_UNVERIFIED,
                  "verify: %llu fault%s, the first: %.*s; this is not the "
                  "Delaunay triangulation of these points, make it again",
                  (unsigned long long)r->faults, r->faults == 1 ? "" : "s",
                  length, r->text);
    }
}

int host_verify(const struct host_points *points, struct host_tetrahedra *tets,
                struct host_verify_report *report, struct host_error *error)
{
    *report = (struct host_verify_report){.points = points->count,
                                          .tetrahedra = tets->count};
    struct verify v = {.points = points,
                       .tets = tets,
                       .report = report,
                       .error = error,
                       .hull = {.points = points, .tets = tets},
                       .positive = true};
    size_t rows = (size_t)points->count;
    (void)pthread_mutex_init(&v.lock, NULL);
    v.lowest = host_map(rows * sizeof *v.lowest);
    v.used = host_map(rows);
    if (v.lowest == NULL || v.used == NULL ||
        (rows > 0 && (report->distinct = host_distinct_rows(points->xyz, rows,
                                                            v.lowest)) == 0)) {
        host_fail_memory(error, "the check");
    } else {
        host_tetrahedra_sort(tets);
        check_all(&v);
    }
    host_adjacency_free(&v.adjacency);
    host_hull_free(&v.hull);
    host_unmap(v.lowest, rows * sizeof *v.lowest);
    host_unmap(v.used, rows);
    (void)pthread_mutex_destroy(&v.lock);
    verdict(&v);
    return error->code;
}
