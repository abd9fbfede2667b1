/* Why the check suffices.
 *
 * Add up the boundaries of all tetrahedra, each facet seen from outside.  What
 * does not cancel is the boundary of the whole, as a chain.  If all tetrahedra
 * are positive, the number of them that cover a place (on no facet) is the
 * number of times that this boundary winds round the place.  If it is one
 * closed surface, convex at every edge and wound once, it bounds a convex body,
 * winds once round every place inside and not at all round one outside.  So the
 * tetrahedra tile that body.  As none overlaps another, each facet inside has
 * one tetrahedron on either side: they meet facet to facet.  Every point is a
 * vertex, so the body is the convex hull of the points.
 *
 * A tiling whose every inner facet has no vertex of one side inside the sphere
 * of the other is the Delaunay triangulation (Delaunay 1934): lifted, it is a
 * surface convex at each facet.  With the tie rule the lifted points are in
 * general position, and it is the only one. */
#include "check.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/mesh/adjacency.h"
#include "judge.h"
#include "parts.h"

enum { NAMED_MAX = 8 }; /* faults in the report's text */

/* --- Faults ----------------------------------------------------------- */

static bool make_fault_room(struct check *c) {
    uint64_t room = c->faults_room + c->faults_room / 2 + NAMED_MAX;
    struct check_fault *grown =
        realloc(c->fault, (size_t)room * sizeof *c->fault);
    if (grown == NULL) {
        host_fail_memory(c->error, "the faults");
        return false;
    }
    c->fault = grown;
    c->faults_room = room;
    return true;
}

void check_fault(struct check *c, const char *subject, const char *what,
                 const uint64_t *tets, int tet_count, const uint32_t *vertices,
                 int count) {
    struct check_fault f = {.subject = subject, .what = what};
    f.tets = (uint8_t)tet_count;
    f.vertices = (uint8_t)count;
    for (int i = 0; i < tet_count; i++) {
        f.tet[i] = tets[i];
    }
    for (int i = 0; i < count; i++) {
        f.vertex[i] = vertices[i];
    }
    (void)pthread_mutex_lock(&c->lock);
    c->report->faults++;
    /* Half of the slots are kept for faults at facets, which say more than
     * points without a tetrahedron. */
    uint64_t most = tet_count == 0 ? (c->faults_max + 1) / 2 : c->faults_max;
    if (c->faults_kept < most &&
        (c->faults_kept < c->faults_room || make_fault_room(c))) {
        c->fault[c->faults_kept++] = f;
    }
    (void)pthread_mutex_unlock(&c->lock);
}

void check_fail(struct check *c, const struct host_error *error) {
    (void)pthread_mutex_lock(&c->lock);
    if (error->code != 0 && c->error->code == 0) {
        *c->error = *error;
    }
    (void)pthread_mutex_unlock(&c->lock);
}

/* The row of the input that a vertex stands for. */
static unsigned row_of(const struct check *c, uint32_t vertex) {
    const struct host_order *order = c->sites->order;
    return order == NULL || vertex >= c->sites->count ? vertex
                                                      : order->row[vertex];
}

static void add_line(const struct check *c, const struct check_fault *f) {
    char *text = c->report->text;
    size_t used = strlen(text), room = sizeof c->report->text;
    used += (size_t)snprintf(text + used, room - used, "%s", f->subject);
    for (int i = 0; i < f->vertices; i++) {
        used += (size_t)snprintf(text + used, room - used, "%s%u",
                                 i == 0 ? " (" : " ", row_of(c, f->vertex[i]));
    }
    (void)snprintf(text + used, room - used, "%s%s\n",
                   f->vertices > 0 ? ") " : " ", f->what);
}

static void deliver(const struct check *c,
                    const struct host_check_listener *listener) {
    static_assert(sizeof c->report->text / NAMED_MAX >= 160,
                  "a line has a subject, five numbers, and what is wrong");
    for (uint64_t i = 0; i < c->faults_kept; i++) {
        const struct check_fault *f = &c->fault[i];
        if (i < NAMED_MAX) {
            add_line(c, f);
        }
        if (listener != NULL && i < listener->faults_max) {
            listener->fault(listener->context, f->tet, f->tets, f->vertex,
                            f->vertices, f->what);
        }
    }
}

static void verdict(const struct check *c) {
    const struct host_check_report *r = c->report;
    if (c->error->code == 0 && r->faults > 0) {
        int length = (int)strcspn(r->text, "\n");
        host_fail(c->error, HOST_UNVERIFIED,
                  "verify: %llu fault%s, the first: %.*s; this is not the "
                  "Delaunay triangulation of these points, make it again",
                  (unsigned long long)r->faults, r->faults == 1 ? "" : "s",
                  length, r->text);
    }
}

/* --- The boundary ----------------------------------------------------- */

static void hull_fault(void *context, const uint64_t *tets, int tet_count,
                       const uint32_t *vertices, int count, const char *what) {
    static const char *const subject[] = {"hull:", "point", "edge", "facet"};
    check_fault(context, subject[count], what, tets, tet_count, vertices,
                count);
}

struct beyond {
    struct check *c;
    struct host_judge judge;
};

/* A facet of the boundary with a point beyond it is not on the hull: a
 * tetrahedron there is missing or wrong. */
static void find_beyond(void *context, unsigned number) {
    (void)number;
    struct beyond *b = context;
    struct check *c = b->c;
    enum { TURN = 16 };
    uint64_t i;
    while ((i = check_take(c, TURN, c->hull.count)) < c->hull.count) {
        uint64_t end = check_end(i, TURN, c->hull.count);
        for (; i < end; i++) {
            const struct host_hull_facet *f = &c->hull.facet[i];
            uint32_t v[3];
            host_facet_outward(c->tets->v[f->tet], f->corner, v);
            if (host_judge_beyond(&b->judge, v)) {
                check_fault(c, "facet",
                            "has one tetrahedron, and points on the other side",
                            &f->tet, 1, v, 3);
            }
        }
    }
}

static int check_boundary(struct check *c) {
    struct host_hull_listener listener = {c, hull_fault};
    struct beyond b = {.c = c};
    uint64_t before = c->report->faults;
    if (host_hull_check(&c->hull, &listener, c->error) != 0) {
        return c->error->code;
    }
    c->report->hull_facets = c->hull.count;
    c->report->hull_vertices = c->hull.vertices;
    if (c->report->faults == before && !c->any_unused) {
        return 0;
    }
    if (host_judge_make(&b.judge, c->sites, c->error) == 0) {
        c->next = 0;
        host_fork_all(host_threads(), find_beyond, &b);
        host_judge_free(&b.judge);
    }
    return c->error->code;
}

/* --- All together ----------------------------------------------------- */

/* Ranges of whole words of `bad`, whose entries have 32 bits. */
static int cut_parts(struct check *c) {
    uint64_t count = c->tets->count, words = count / 64 + 1;
    unsigned threads = host_threads();
    c->parts = threads < CHECK_THREADS_MAX ? threads : CHECK_THREADS_MAX;
    while (c->parts < CHECK_PARTS_MAX && count / c->parts >= 1u << 30) {
        c->parts++;
    }
    if (count / c->parts >= 1u << 30) {
        return host_fail(c->error, HOST_BROKEN,
                         "verify: %llu tetrahedra cannot be checked, 2^34 at "
                         "most; take fewer points",
                         (unsigned long long)count);
    }
    for (unsigned i = 0; i < c->parts; i++) {
        uint64_t first = words * i / c->parts * 64;
        uint64_t last = words * (i + 1) / c->parts * 64;
        c->part[i].first = first < count ? first : count;
        c->part[i].last = last < count ? last : count;
    }
    return 0;
}

static int check_all(struct check *c) {
    if (getrandom(c->key, sizeof c->key, 0) != (ssize_t)sizeof c->key) {
        return host_fail(c->error, HOST_BROKEN,
                         "verify: the system gives no random numbers; look "
                         "into getrandom(2)");
    }
    if (cut_parts(c) != 0 || check_sums(c) != 0 || check_twins(c) != 0) {
        return c->error->code;
    }
    return check_boundary(c);
}

int host_check(const struct host_sites *sites,
               const struct host_tetrahedra *tets, enum host_check_depth depth,
               const struct host_check_listener *listener,
               struct host_check_report *report, struct host_error *error) {
    struct check c = {.sites = sites,
                      .tets = tets,
                      .depth = depth,
                      .report = report,
                      .error = error,
                      .faults_max = NAMED_MAX,
                      .hull = {.sites = sites, .tets = tets}};
    *report = (struct host_check_report){.points = sites->count,
                                         .tetrahedra = tets->count};
    if (listener != NULL && listener->faults_max > NAMED_MAX) {
        c.faults_max = listener->faults_max;
    }
    (void)pthread_mutex_init(&c.lock, NULL);
    check_all(&c);
    deliver(&c, listener);
    verdict(&c);
    for (unsigned i = 0; i < c.parts; i++) {
        host_unmap(c.part[i].list, (size_t)(c.part[i].last - c.part[i].first) *
                                       sizeof *c.part[i].list);
    }
    host_unmap(c.hot, (size_t)sites->count);
    host_unmap(c.bad, ((size_t)tets->count / 64 + 1) * sizeof *c.bad);
    host_hull_free(&c.hull);
    free(c.fault);
    (void)pthread_mutex_destroy(&c.lock);
    return error->code;
}
